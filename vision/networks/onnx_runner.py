"""Who computes a network? OpenCV, which is always there, or ONNX Runtime, which is faster where it is installed."""

import importlib.util
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np

from vision.errors import VisionError
from vision.networks.onnx_header import OnnxHeader
from vision.networks.onnx_settings import Runtime
from vision.objects import Tensor


class NetworkRunner(Protocol):
    """A network ready to compute."""

    @property
    def name(self) -> str:
        """What computes, with its version."""
        ...

    def run(self, planes: Tensor) -> Tensor:
        """Compute the output of (1, channels, height, width) planes."""
        ...


class OpenCvRunner:
    """A network in OpenCV's `dnn`.

    Parameters
    ----------
    data : the ONNX file.
    output : name of the output; empty for a network that has one.

    Raises
    ------
    VisionError
        If OpenCV cannot read the network, or it has not the output.
    """

    def __init__(self, data: bytes, output: str) -> None:
        try:
            self._network = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))
            outputs = tuple(self._network.getUnconnectedOutLayersNames())
        except cv2.error as error:
            raise VisionError(f"expected operators that OpenCV knows, got {_reason(error)}") from error
        self._output = chosen_output(outputs, output)

    @property
    def name(self) -> str:
        """OpenCV, with its version."""
        return f"OpenCV {cv2.__version__}"

    def run(self, planes: Tensor) -> Tensor:
        """Compute the output of (1, channels, height, width) planes."""
        try:
            self._network.setInput(planes)
            return np.asarray(self._network.forward(self._output), np.float32)
        except cv2.error as error:
            raise VisionError(f"expected a network that takes {planes.shape!r}, got {_reason(error)}") from error


class OnnxRuntimeRunner:
    """A network in ONNX Runtime, on the processor.

    Parameters
    ----------
    data, output : as for `OpenCvRunner`.

    Raises
    ------
    VisionError
        If ONNX Runtime cannot read the network, or it has not the output.
    """

    def __init__(self, data: bytes, output: str) -> None:
        import onnxruntime

        self._version = onnxruntime.__version__
        try:
            # Any: the package is optional, so its types are not always there.
            self._session: Any = onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"])
        except Exception as error:  # its exceptions have no public base class
            raise VisionError(f"expected operators that ONNX Runtime knows, got {_reason(error)}") from error
        self._input = self._session.get_inputs()[0].name
        self._output = chosen_output(tuple(one.name for one in self._session.get_outputs()), output)

    @property
    def name(self) -> str:
        """ONNX Runtime, with its version."""
        return f"ONNX Runtime {self._version}"

    def run(self, planes: Tensor) -> Tensor:
        """Compute the output of (1, channels, height, width) planes."""
        try:
            return np.asarray(self._session.run([self._output], {self._input: planes})[0], np.float32)
        except Exception as error:  # as above
            raise VisionError(f"expected a network that takes {planes.shape!r}, got {_reason(error)}") from error


def load_network(path: Path, data: bytes, header: OnnxHeader, *, runtime: Runtime, output: str) -> NetworkRunner:
    """Load a network into the wished runtime.

    Raises
    ------
    VisionError
        If the runtime is not installed or cannot run the network; the message names the file and its operator set.
    """
    is_installed = importlib.util.find_spec("onnxruntime") is not None
    if runtime == "onnxruntime" and not is_installed:
        raise VisionError(f"{path}: expected ONNX Runtime (pip install 'dyknow[onnx]'), got an installation without it")
    is_ort = runtime == "onnxruntime" or (runtime == "auto" and is_installed)
    try:
        return OnnxRuntimeRunner(data, output) if is_ort else OpenCvRunner(data, output)
    except VisionError as error:
        raise VisionError(f"{path}: operator set {header.opset}: {error}") from error


def chosen_output(outputs: tuple[str, ...], wanted: str) -> str:
    """Choose the output to read.

    Raises
    ------
    VisionError
        If the network has not the wished one, or several and none is wished.

    Examples
    --------
    >>> chosen_output(("boxes",), "")
    'boxes'
    """
    if wanted in outputs:
        return wanted
    if not wanted and len(outputs) == 1:
        return outputs[0]
    expected = f"an output named {wanted!r}" if wanted else "output = the name of one of several outputs"
    raise VisionError(f"expected {expected}, got {', '.join(outputs) or 'none'}")


def _reason(error: Exception) -> str:
    """Cut a library's message to one line."""
    return " ".join(str(error).split())[:300] or type(error).__name__
