"""What computes a network? ONNX Runtime, on the processor: the same numbers wherever the package is installed."""

from pathlib import Path
from typing import Any

import numpy as np

from vision.errors import VisionError
from vision.objects import Tensor

SILENT = 4  # all that is logged comes as an exception too


class Network:
    """The network of an ONNX file, ready to compute.

    Parameters
    ----------
    path : of the file.
    output : name of the output to read; empty for a network that has one.

    Attributes
    ----------
    runtime : what computes, with its version.
    input_shape : sizes of the axes of its one input; 0 where the file leaves one open.

    Raises
    ------
    VisionError
        If the file cannot be read or computed, or has several inputs, or not the output.
    """

    def __init__(self, path: Path, output: str) -> None:
        import onnxruntime  # here, since it takes a while and few runs need it

        self.runtime = f"ONNX Runtime {onnxruntime.__version__}"
        options = onnxruntime.SessionOptions()
        options.log_severity_level = SILENT
        try:
            # Any: the package says nothing of its types.
            self._session: Any = onnxruntime.InferenceSession(
                path.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
        except OSError as error:
            raise VisionError(f"expected readable weights, got {error.strerror or error}") from error
        except Exception as error:  # those of the package have no public base class
            raise VisionError(f"expected an ONNX file that ONNX Runtime can compute, got {_reason(error)}") from error
        inputs = self._session.get_inputs()
        if len(inputs) != 1:
            raise VisionError(f"expected a network with one input, got {len(inputs)}")
        self._input = inputs[0].name
        self.input_shape = tuple(size if isinstance(size, int) and size > 0 else 0 for size in inputs[0].shape)
        outputs = [one.name for one in self._session.get_outputs()]
        if output not in outputs and (output or len(outputs) != 1):
            wanted = f"an output named {output!r}" if output else "output = the name of one of several outputs"
            raise VisionError(f"expected {wanted}, got {', '.join(outputs)}")
        self._output = output or outputs[0]

    def run(self, planes: Tensor) -> Tensor:
        """Compute the output of (1, channels, height, width) planes.

        Raises
        ------
        VisionError
            If the network takes other planes.
        """
        try:
            return np.asarray(self._session.run([self._output], {self._input: planes})[0], np.float32)
        except Exception as error:  # as above
            raise VisionError(f"expected a network that takes {planes.shape!r}, got {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """Cut a library's message to one line; codes and places in its own source come first, what is wrong last."""
    return " ".join(str(error).split())[-300:].split(" : ")[-1] or type(error).__name__
