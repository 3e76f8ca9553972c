"""What is an input to a run? Something that can be opened, described in the log, and fed to a pipeline.

Each kind of input is one class here and one row of the table in `service.runs.inputs.opening`.
"""

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from gis.cameras.camera import GroundCamera
from gis.roads.road_network import RoadNetwork
from service.errors import InputError
from service.records.runs import CameraRecord, InputKind
from service.runs.graph.pipeline import Feed
from service.runs.inputs.detectors import DetectorChoice, choose_detector
from service.runs.inputs.sites.site import NO_SITE, Site
from vision.video.frames import VideoSource
from vision.video.recording import is_recording, parts_so_far

STANDARD_INPUT = (Path("-"), Path("/dev/stdin"))
DIGEST_BYTES = 8


@dataclass(frozen=True)
class Asked:
    """Say what the user asks to be processed, and with what.

    Attributes
    ----------
    columns : our column names to those of a CSV file.
    detector : in the words of `service.runs.inputs.detectors`; None for that of the site file. A file of
        detections that is the input itself stands alone.
    rate_hz : frames of a video to look at in a second, infinite for all; None for what the site file says.
    """

    path: Path
    site: Site = NO_SITE
    columns: Mapping[str, str] | None = None
    detector: str | None = None
    rate_hz: float | None = None

    @cached_property
    def choice(self) -> DetectorChoice:
        """Choose the detector; raises what `choose_detector` does."""
        folder = self.site.path.parent
        return choose_detector(self.detector, self.site.detector, folder=folder, columns=self.columns)


@dataclass(frozen=True, slots=True, kw_only=True)
class Input(ABC):
    """Hold an input that was opened and found usable.

    Attributes
    ----------
    kind : one word for the log.
    network : the roads in view.
    warnings : what the user should know about how the input is read.
    detector, detector_files : what looks at the frames, in words, and the files that it depends on.
    video : what is read, where it is one.
    frame_count : how many are looked at, as far as it is known before they are read.
    camera : how the ground maps to the image, for the log.
    """

    kind: ClassVar[InputKind]
    path: Path
    network: RoadNetwork | None
    warnings: tuple[str, ...] = ()
    detector: str = ""
    detector_files: tuple[Path, ...] = ()
    video: VideoSource | None = None
    frame_count: int | None = None
    camera: CameraRecord | None = None

    @classmethod
    @abstractmethod
    def fits(cls, asked: Asked) -> bool:
        """Tell whether it is this kind of input that the user asks for."""

    @classmethod
    @abstractmethod
    def open(cls, asked: Asked) -> "Input":
        """Open it, so that nothing is written before it is known to work.

        Raises
        ------
        InputError
            If it cannot be read or does not go with the rest of what was asked.
        VisionError
            If the detector or the video cannot be used.
        """

    @abstractmethod
    def feed(self, *, apart: bool = False) -> Feed:
        """Give what a pipeline is fed with; may be taken once.

        Parameters
        ----------
        apart : look at the frames in a process of its own, where there are any.

        Raises
        ------
        InputError
            If the camera and the roads of the site are of no use.
        """

    @property
    def contents(self) -> tuple[int, str]:
        """Return the number of bytes and their digest; of a recording, which may grow, those of its first line."""
        if is_recording(self.path):
            first = parts_so_far(self.path)[0].as_line().encode()
            return len(first), hashlib.blake2b(first, digest_size=DIGEST_BYTES).hexdigest()
        return self.path.stat().st_size, content_digest(self.path)


def camera_record(camera: GroundCamera, size_px: tuple[int, int]) -> CameraRecord:
    """Write down how the ground maps to an image of this width and height."""
    numbers = tuple(camera.pixel_from_ground.ravel().tolist())
    return CameraRecord(numbers, *size_px, camera.lens.radial if camera.lens else 0.0)


def content_digest(*paths: Path) -> str:
    """Digest the contents of files, 16 hexadecimal digits; the same bytes give the same digest anywhere.

    Raises
    ------
    InputError
        If one is a pipe, which has been read already.
    """
    digest = hashlib.blake2b(digest_size=DIGEST_BYTES)
    for path in paths:
        if is_read_once(path):
            raise InputError(f"{path}: expected a file that can be read twice, got a pipe")
        with path.open("rb") as file:
            hashlib.file_digest(file, lambda: digest)  # goes on with the one digest of all files
    return digest.hexdigest()


def is_read_once(path: Path) -> bool:
    """Tell whether a path stands for standard input or a pipe, which gives its bytes but once."""
    return path in STANDARD_INPUT or path.is_fifo()
