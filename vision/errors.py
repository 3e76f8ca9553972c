"""What can go wrong in `vision`, as one exception family."""

from functools import partial


class VisionError(Exception):
    """Base of every error that `vision` raises: where, what was expected, what came."""


class VideoError(VisionError):
    """A file that cannot be used as a video at all; nothing was read from it."""


class VideoBroken(VisionError):  # noqa: N818  (the fixed public name: a state of the file, not a misuse)
    """A video that was good up to some frame and cannot be read past it.

    Raised by the frame iterator after every good frame has been handed out, so what was computed from them stands.

    Attributes
    ----------
    path : the file.
    t_us : time stamp of the last good frame, 0 if there was none.
    frame_index : number of good frames, which is the index of the first missing one.
    reason : what the decoder met there.
    """

    def __init__(self, *, path: str, t_us: int, frame_index: int, reason: str) -> None:
        super().__init__(
            f"video {path!r} at frame {frame_index} (after {t_us} us): expected a readable frame, got {reason}"
        )
        self.path = path
        self.t_us = t_us
        self.frame_index = frame_index
        self.reason = reason

    def __reduce__(self) -> tuple[object, ...]:
        """Go to another process by what it was made of."""
        return partial(
            VideoBroken, path=self.path, t_us=self.t_us, frame_index=self.frame_index, reason=self.reason
        ), ()
