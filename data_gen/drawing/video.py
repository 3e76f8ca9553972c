"""How do pictures become a video file? H.264 in MP4, encoded on a thread of its own.

Byte-same for the same pictures: the number of encoder threads is fixed and nothing of the machine goes into the file.
"""

import queue
import threading
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import numpy as np
from numpy.typing import NDArray

from data_gen.drawing.degrade import USUAL_CRF
from data_gen.errors import DataGenError

_QUEUE_LENGTH = 8
_ENCODER_THREADS = 2
_OPTIONS = {
    "preset": "veryfast",
    # A key frame each second comes from gop_size; scene cuts would add more.
    "x264-params": "scenecut=0:bframes=0:colorprim=smpte170m:transfer=smpte170m:colormatrix=smpte170m",
}
_CONTAINER_OPTIONS = {"movflags": "+faststart", "fflags": "+bitexact"}


class VideoWriter:
    """Writes I420 pictures as H.264; use it as a context manager. Where an error ends it, no file is left.

    Parameters
    ----------
    path : the file, ending in `.mp4`.
    size_px : width and height, both even.
    rate_hz : pictures per second, whole; a picture's time is a multiple of its period.
    crf : constant rate factor of the encoder, 0 to 51; larger is coarser.
    """

    def __init__(self, path: Path, size_px: tuple[int, int], rate_hz: int, *, crf: int = USUAL_CRF) -> None:
        width_px, height_px = size_px
        if width_px <= 0 or height_px <= 0 or width_px % 2 or height_px % 2:
            raise DataGenError(f"video {path}: expected even width and height, got {size_px!r}")
        self._path = path
        self._size_px = size_px
        self._rate_hz = rate_hz
        self._options = {**_OPTIONS, "crf": str(crf)}
        self._next = 0
        self._pictures: queue.Queue[tuple[NDArray[np.uint8], int] | None] = queue.Queue(_QUEUE_LENGTH)
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._encode_all, name="video encoder", daemon=True)

    def __enter__(self) -> "VideoWriter":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pictures.put(None)
        self._thread.join()
        if error is not None or self._failure is not None:
            # Half a video is worse than none: it would play.
            self._path.unlink(missing_ok=True)
        if error is None:
            self._raise_failure()

    def write(self, picture: NDArray[np.uint8], number: int | None = None) -> None:
        """Hand over the next picture; waits while the encoder is behind.

        Parameters
        ----------
        picture : (h * 3 / 2, w), I420; not to be changed afterwards.
        number : its time, in periods from the start, later than all before it; without one it follows the last one.

        Raises
        ------
        DataGenError
            If the encoder failed.
        """
        self._raise_failure()
        number = self._next if number is None else number
        assert number >= self._next
        self._pictures.put((picture, number))
        self._next = number + 1

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise DataGenError(f"video {self._path}: expected to write H.264, got {self._failure!r}") from self._failure

    def _encode_all(self) -> None:
        try:
            self._encode()
        except Exception as error:  # handed to the caller's thread
            self._failure = error
            while self._pictures.get() is not None:
                pass

    def _encode(self) -> None:
        with av.open(str(self._path), "w", options=_CONTAINER_OPTIONS) as container:
            stream = container.add_stream("libx264", rate=self._rate_hz, options=self._options)
            stream.width, stream.height = self._size_px
            stream.pix_fmt = "yuv420p"
            stream.codec_context.gop_size = self._rate_hz
            stream.codec_context.thread_count = _ENCODER_THREADS
            stream.codec_context.time_base = Fraction(1, self._rate_hz)
            while (item := self._pictures.get()) is not None:
                picture, number = item
                frame = av.VideoFrame.from_ndarray(picture, format="yuv420p")
                frame.pts = number
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
