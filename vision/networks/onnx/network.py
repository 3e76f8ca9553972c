"""What computes a network? ONNX Runtime, by the first of the recipe's providers that this installation has."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vision.errors import VisionError
from vision.networks.onnx.settings import OnnxSettings, Provider
from vision.objects import Tensor

SILENT = 4  # all that is logged comes as an exception too
PROVIDERS: Mapping[Provider, str] = {
    "cpu": "CPUExecutionProvider",
    "cuda": "CUDAExecutionProvider",
    "openvino": "OpenVINOExecutionProvider",
}


class Network:
    """The network of an ONNX file, ready to compute.

    Parameters
    ----------
    path : of the file.
    settings : with the name of the output to read, the providers to try and the threads.

    Attributes
    ----------
    runtime : what computes, with its version and provider.
    warnings : which providers would have been preferred.
    input_shape : sizes of the axes of its one input; 0 where the file leaves one open.

    Raises
    ------
    VisionError
        If the file cannot be read or computed, none of the providers is there, or it has several inputs or not the
        output.
    """

    def __init__(self, path: Path, settings: OnnxSettings) -> None:
        try:
            data = path.read_bytes()
        except OSError as error:
            raise VisionError(f"expected readable weights, got {error.strerror or error}") from error
        # Any: the package says nothing of its types.
        self._session: Any
        self._session, provider, lacking = _open(data, settings)
        self.runtime = f"{_version()}, {provider}"
        self.warnings = (f"{_version()} lacks {', '.join(lacking)} here: {provider} computes",) if lacking else ()
        inputs = self._session.get_inputs()
        if len(inputs) != 1:
            raise VisionError(f"expected a network with one input, got {len(inputs)}")
        self._input = inputs[0].name
        self.input_shape = tuple(size if isinstance(size, int) and size > 0 else 0 for size in inputs[0].shape)
        outputs, output = [one.name for one in self._session.get_outputs()], settings.output
        if output not in outputs and (output or len(outputs) != 1):
            wanted = f"an output named {output!r}" if output else "output = the name of one of several outputs"
            raise VisionError(f"expected {wanted}, got {', '.join(outputs)}")
        self._output = output or outputs[0]

    def run(self, planes: Tensor) -> Tensor:
        """Compute the output of (n, channels, height, width) planes.

        Raises
        ------
        VisionError
            If the network takes other planes.
        """
        try:
            return np.asarray(self._session.run([self._output], {self._input: planes})[0], np.float32)
        except Exception as error:  # as above
            raise VisionError(f"expected a network that takes {planes.shape!r}, got {_reason(error)}") from error


def _open(data: bytes, settings: OnnxSettings) -> tuple[object, Provider, list[Provider]]:
    """Start a session with the first provider that works; name it, and those that do not."""
    import onnxruntime  # here, since it takes a while and few runs need it

    options = onnxruntime.SessionOptions()
    options.log_severity_level = SILENT
    options.intra_op_num_threads = settings.threads
    # Threads that wait for the next look in a loop took as much of the processor again.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    there, lacking = onnxruntime.get_available_providers(), list[Provider]()
    for name in settings.providers:
        if PROVIDERS[name] in there:
            try:
                session = onnxruntime.InferenceSession(data, options, [PROVIDERS[name]], enable_fallback=0)
            except Exception as error:  # those of the package have no public base class
                problem = f"expected an ONNX file that ONNX Runtime can compute, got {_reason(error)}"
                raise VisionError(problem) from error
            if PROVIDERS[name] in session.get_providers():  # not if a library of it is missing
                return session, name, lacking
        lacking.append(name)
    known = ", ".join(name for name, theirs in PROVIDERS.items() if theirs in there)
    expected = f'expected one of the providers that {_version()} has here ({known}); add "cpu" to providers'
    raise VisionError(f"{expected}, got {', '.join(lacking)}")


def _version() -> str:
    import onnxruntime

    return f"ONNX Runtime {onnxruntime.__version__}"


def _reason(error: Exception) -> str:
    """Cut a library's message to one line; codes and places in its own source come first, what is wrong last."""
    return " ".join(str(error).split())[-300:].split(" : ")[-1] or type(error).__name__
