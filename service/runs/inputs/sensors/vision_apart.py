"""How does vision look in a process of its own? Its sensor goes there, and what it sees comes back through one pipe.

Everything comes in the order in which it would have come here, so a run has the same rows. The pipe holds little, so
the process cannot run far ahead of who reads it.
"""

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Final

from service.runs.machine import SIGNALS
from vision.errors import VideoBroken
from vision.networks.stored_detections import StoredInstant
from vision.objects import VisionObjects
from vision.settings import VisionSettings

if TYPE_CHECKING:
    from multiprocessing.context import SpawnProcess

    from service.runs.inputs.sensors.video_sensor import VideoSensor

DONE: Final = "all objects of an instant were sent"
TOGETHER_S = 0.1
"""What is seen within this time comes in one piece: each costs a switch of processes."""


@dataclass(frozen=True, slots=True)
class _LeftOut:
    """Frames that are not looked at, as `VideoSource.take_left_out` gives them."""

    frames: list[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class _End:
    """The last frame was read; `broken` says what came instead of a further one."""

    broken: VideoBroken | None


@dataclass(frozen=True, slots=True)
class _Closed:
    """Nothing comes any more; what is known of the whole video then."""

    notes: Sequence[str]
    skipped_frames: int
    damaged_frames: int
    first_damage_us: int | None


_Item = StoredInstant | VisionObjects | _LeftOut | str | _End | _Closed | Exception


class VisionApart:
    """The vision of a sensor, in another process: the same results for the same frames.

    Parameters
    ----------
    sensor : goes to the process; its video tells afterwards what of it was damaged.
    settings : of the vision.
    """

    def __init__(self, sensor: "VideoSensor", settings: VisionSettings) -> None:
        self.settings = settings
        self._sensor = sensor
        self._items: deque[_Item] = deque()
        self._last = StoredInstant(-1, 0)
        self._notes: Sequence[str] = ()
        self._is_at_end = False
        self._process: SpawnProcess | None = None
        self._pipe: Connection | None = None

    def frames(self) -> Iterator[StoredInstant]:
        """Begin the process, and tell when each frame was taken.

        Raises
        ------
        VideoBroken
            Where the video cannot be read on, or the process has ended.
        """
        # Another start method would copy the threads' locks; the newest Python has no other one anyway.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=look, args=(self._sensor, theirs), name="vision", daemon=True)
        self._process.start()
        theirs.close()
        try:
            while not isinstance(item := self._next(), _End):
                if isinstance(item, _LeftOut):
                    self._sensor.video.left_out += item.frames
                elif isinstance(item, StoredInstant):
                    self._last = item
                    yield item
        except GeneratorExit:
            self._leave()
            raise
        self._is_at_end = True
        if item.broken is not None:
            raise item.broken

    def observe(self, instant: StoredInstant) -> Iterator[VisionObjects]:
        """Give the results that are ready with the instant that `frames` told last."""
        while isinstance(item := self._next(), VisionObjects):
            yield item

    def finish(self) -> Iterator[VisionObjects]:
        """Give the results still held at the end of the video; none where the frames were not read to their end."""
        if not self._is_at_end:  # what comes now is of frames that nobody asked for
            self._leave()
        while self._pipe is not None:
            item = self._next()
            if isinstance(item, VisionObjects):
                yield item
            elif isinstance(item, _Closed):
                self._notes, video = item.notes, self._sensor.video
                video.skipped_frames, video.damaged_frames = item.skipped_frames, item.damaged_frames
                video.first_damage_us = item.first_damage_us
                self._leave()

    def notes(self) -> Sequence[str]:
        """Say what people should know; nothing where the end was not seen."""
        return self._notes

    def _next(self) -> _Item:
        assert self._pipe is not None, "nothing is read before the first frame"
        while not self._items:
            try:
                self._items.extend(self._pipe.recv())
            except (EOFError, OSError):  # the latter where a message is cut short
                raise self._lost() from None
        item = self._items.popleft()
        if isinstance(item, Exception):
            self._leave()
            raise item
        return item

    def _lost(self) -> VideoBroken:
        """Say that the process is gone, and how."""
        assert self._process is not None
        self._process.join()
        code = self._process.exitcode or 0
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        self._leave()
        return VideoBroken(
            path=self._sensor.video.path,
            t_us=self._last.t_us,
            frame_index=self._last.index + 1,
            reason=f"the end of the process that looks at it ({how})",
        )

    def _leave(self) -> None:
        """End the process, whatever it does."""
        if self._pipe is not None and self._process is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
        self._pipe = None


@dataclass(slots=True)
class _Sender:
    pipe: Connection
    items: list[_Item] = field(default_factory=list)
    sent_s: float = field(default_factory=time.monotonic)

    def put(self, item: _Item) -> None:
        """Send an item, with those before it, when it is time to."""
        self.items.append(item)
        if time.monotonic() - self.sent_s >= TOGETHER_S:
            self.flush()

    def flush(self) -> None:
        """Send all items."""
        self.pipe.send(self.items)
        self.items, self.sent_s = [], time.monotonic()


def look(sensor: "VideoSensor", pipe: Connection) -> None:
    """Look at a whole video and send what is seen: what the other process runs."""
    for one in SIGNALS:  # they come to all processes of a terminal; who began this one decides what they mean
        signal.signal(one, signal.SIG_IGN)
    sender = _Sender(pipe)
    try:
        try:
            _look(sensor, sender)
        except BrokenPipeError:
            raise
        except Exception as error:  # (raised again in the process that waits for it)
            sender.put(error)
        sender.flush()
    except BrokenPipeError:
        return  # nobody wants to know any more


def _look(sensor: "VideoSensor", sender: _Sender) -> None:
    vision, video, broken = sensor.vision(), sensor.video, None
    try:
        for frame in sensor.frames(vision):
            if left_out := video.take_left_out(frame.t_us):
                sender.put(_LeftOut(left_out))
            sender.put(StoredInstant(frame.index, frame.t_us))
            for objects in vision.observe(frame):
                sender.put(objects)
            sender.put(DONE)
    except VideoBroken as error:
        broken = error
    sender.put(_LeftOut(video.take_left_out()))
    sender.put(_End(broken))
    for objects in vision.finish():
        sender.put(objects)
    sender.put(_Closed(tuple(vision.notes()), video.skipped_frames, video.damaged_frames, video.first_damage_us))
