"""Which detector looks at the input? Its name on the command line or in the site file, and what it needs besides.

``motion`` is the built-in one on the video that was given; ``motion:thermal`` looks at the site's thermal video
instead, ``motion:both`` fuses the two. ``onnx:PATH`` is a trained network, ``onnx:NAME`` one that was installed by
`dyknow detector add`, ``file:PATH`` a file of detections.
"""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from service.errors import InputError
from service.texts.toml_tables import Number, Text, read_toml
from vision import networks
from vision.networks.box_detector import BoxDetector, Instant
from vision.networks.detection_files import ReadingRules, read_detections
from vision.networks.onnx.detector import OnnxDetector
from vision.networks.onnx.network_input import Part, picture_scale
from vision.networks.onnx.settings import ClassWords, OnnxSettings
from vision.networks.stored_detections import StoredDetections
from vision.settings import VisionSettings
from vision.video.frames import Frame

Channels = Literal["colour", "thermal", "both"]
GRAMMAR = "auto, motion, motion:thermal, motion:both, onnx:NAME, onnx:PATH or file:PATH"
NAME = re.compile(r"[A-Za-z0-9_-]+")  # of an installed detector; paths have a dot or a slash
Side = Annotated[int, Meta(ge=2, lt=100_000)]
SIZE = "width and height in whole pixels, at least 2"
FarPart = Callable[[float], Part | None]
_CHANNELS: Mapping[str, Channels] = {"": "colour", "thermal": "thermal", "both": "both"}


@dataclass(frozen=True, slots=True)
class DetectionDetails:
    """What a site file says about detectors besides which one is meant; see docs/detectors.md.

    Attributes
    ----------
    use : the detector, in the words of the command line.
    classes, score_threshold : for a file of detections, as `ReadingRules`.
    file_rate_hz, size_px : frames a second and size of the picture, for a file of detections that stands alone.
    """

    use: Text = "auto"
    classes: ClassWords = field(default_factory=dict)
    score_threshold: Number = 0.25
    file_rate_hz: Annotated[float, Meta(ge=0.1, le=1000, description="frames a second from 0.1 to 1000")] | None = None
    size_px: Annotated[tuple[Side, Side], Meta(description=SIZE)] | None = None


USUAL_DETAILS = DetectionDetails()


@dataclass(frozen=True, slots=True)
class MotionChoice:
    """The built-in detector, on the channels to look at."""

    channels: Channels = "colour"


@dataclass(frozen=True, slots=True)
class OnnxChoice:
    """A trained network: its weights, and what their recipe says."""

    weights: Path
    settings: OnnxSettings

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it depends on."""
        return self.weights, recipe_path(self.weights)

    def open(
        self, size_px: tuple[int, int], part_px: Part | None = None, far_part: FarPart = lambda _: None
    ) -> OnnxDetector:
        """Load the network for frames of a size, of which it looks at a part or all.

        Parameters
        ----------
        size_px : (width, height).
        part_px : the part; None for all.
        far_part : gives the part in which a usual car is narrower than so many pixels, if there is one.

        Raises
        ------
        VisionError
            If it cannot be used.
        """
        settings, far_px = self.settings, None
        if settings.closer > 1 and settings.input_size_px is not None:
            scale = picture_scale(size_px, settings.input_size_px, settings)
            far_px = far_part(settings.closer_below_px / scale)
        return OnnxDetector(self.weights, settings, size_px, part_px, far_px)


@dataclass(frozen=True, slots=True)
class AutoChoice:
    """Motion; from low above the road the network that comes along for such views, which knows what stands there."""

    @property
    def low(self) -> OnnxChoice:
        """The network."""
        return read_recipe(SHIPPED_DETECTORS / "low.onnx")


@dataclass(frozen=True, slots=True)
class FileChoice:
    """A file of detections, and how it is read."""

    path: Path
    rules: ReadingRules

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it depends on."""
        return (self.path,)

    def open(self, settings: VisionSettings) -> StoredDetections:
        """Read the file.

        Parameters
        ----------
        settings : of the site.

        Raises
        ------
        VisionError
            If it cannot be used.
        """
        return read_detections(self.path, self.rules, settings.networks)


KnownChoice = MotionChoice | OnnxChoice | FileChoice
DetectorChoice = AutoChoice | KnownChoice

SHIPPED_DETECTORS = Path(networks.__file__).parent / "weights"


def choose_detector(
    wanted: str | None,
    details: DetectionDetails = USUAL_DETAILS,
    *,
    folder: Path,
    columns: Mapping[str, str] | None = None,
) -> DetectorChoice:
    """Choose the detector: that of the command line, else that of the site file, else by what the camera sees.

    Parameters
    ----------
    wanted : from the command line, with a path relative to the working directory; None if nothing was said.
    details : from the site file.
    folder : of the site file, to which its paths are relative.
    columns : our column names to those of a file of detections.

    Raises
    ------
    InputError
        If it is no detector that there is.
    VisionError
        If the description of a network cannot be used.
    """
    text = wanted if wanted is not None else details.use
    where = "--detector" if wanted is not None else "[detector] use"
    if text == "auto":
        return AutoChoice()
    kind, colon, what = text.partition(":")
    if kind == "motion" and what in _CHANNELS and bool(colon) == bool(what):
        return MotionChoice(_CHANNELS[what])
    if kind not in ("onnx", "file") or not what:
        raise InputError(f"{where}: expected {GRAMMAR}, got {text!r}")
    if kind == "onnx" and NAME.fullmatch(what):
        return read_recipe(_installed(what, where))
    path = Path(what) if wanted is not None else folder / what
    if not path.is_file():
        raise InputError(f"{where}: expected the path of a file, got {what!r}, and there is no {path}")
    if kind == "onnx":
        return read_recipe(path)
    return FileChoice(path, ReadingRules(columns or {}, details.classes, details.score_threshold))


def _installed(name: str, where: str) -> Path:
    known = named_detectors()
    if name in known:
        return known[name]
    fix = "dyknow detector add FILE installs one, and a file is asked for with its suffix"
    raise InputError(f"{where}: expected an installed detector ({', '.join(known)}), got {name!r}; {fix}")


def named_detectors() -> dict[str, Path]:
    """List the weights that have a name: those that come with vision, and before them what the user has installed."""
    folders = SHIPPED_DETECTORS, detectors_folder()
    return dict(sorted((path.stem, path) for folder in folders for path in sorted(folder.glob("*.onnx"))))


def detectors_folder() -> Path:
    """Tell where this user's detectors are: DYKNOW_DETECTORS, else in the home of data that the desktop has."""
    if said := os.environ.get("DYKNOW_DETECTORS"):
        return Path(said)
    home = Path(os.environ.get("XDG_DATA_HOME", ""))
    return (home if home.is_absolute() else Path.home() / ".local" / "share") / "dyknow" / "detectors"


def read_recipe(weights: Path) -> OnnxChoice:
    """Read what the TOML beside weights says of them.

    Raises
    ------
    SiteError
        If it is missing or wrong.
    """
    what = "the recipe of the weights (docs/detectors.md lists its fields)"
    return OnnxChoice(weights, read_toml(recipe_path(weights), OnnxSettings, what=what))


def recipe_path(weights: Path) -> Path:
    """Return the path of the TOML that lies beside weights."""
    return weights.with_suffix(".toml")


def describe(choice: KnownChoice, opened: BoxDetector[Frame] | BoxDetector[Instant] | None = None) -> str:
    """Say in words which detector ran, for the log.

    Examples
    --------
    >>> describe(MotionChoice())
    'motion'
    """
    if isinstance(choice, MotionChoice):
        return "motion" if choice.channels == "colour" else f"motion:{choice.channels}"
    if isinstance(choice, FileChoice):
        return f"file:{choice.path.name}"
    runtime = f" ({opened.runtime})" if isinstance(opened, OnnxDetector) else ""
    return f"onnx:{choice.weights.name}{runtime}"


def check_against(stored: StoredDetections, path: Path, frame_count: int | None) -> tuple[str, ...]:
    """Warn of detections that no frame of a video can take up.

    Raises
    ------
    InputError
        If none can.
    """
    if len(stored) == 0:
        return (f"{path.name}: no detection is left to read; no vehicle will be seen",)
    if not stored.is_by_frame or not frame_count:
        return ()
    late = stored.count_after(frame_count)
    if late == len(stored):
        raise InputError(f"{path}: expected detections in the {frame_count} frames of the video, got all of them later")
    return (f"{path.name}: {late} of {len(stored)} detections lie past the video's end",) if late else ()
