"""Which vehicles are on a map, if it is known what they look like? Motion at every frame, a network now and then.

The network says what is a vehicle: it looks a few times a second. Motion says where exactly and when. At a look both
are matched: what both see is where motion has it, what the network alone sees stands or has the colour of the road, and
what motion alone sees is doubted, the more the more reliably the network has seen vehicles of that size so far. Between
looks a standing vehicle is still where it was seen twice, as long as nothing moves there. The first background leaves
out what the looks of the start-up had boxes around.

This is for eyes that look at the ground as a map. From low above the road motion says less of a place than boxes do:
there the network looks alone (`box_eye.py`).
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.detection.detector import Detections, Expected
from vision.detection.eye import Eye, RoadEye
from vision.detection.fusion import Channel, DetectionRate
from vision.networks.box_detector import GroundBoxes, ImageBoxes
from vision.networks.box_eye import BoxEye, FoundBoxes
from vision.objects import BoolArray, FloatArray, IntArray, VerdictArray
from vision.road.boxes import Boxes, distance_to_boxes
from vision.road.rectify import RoadImage
from vision.settings import VisionSettings
from vision.tracking.association import assign
from vision.video.frame import Frame

# Of two boxes around one vehicle, the middle of one lies in this inner part of the other, along and across.
INNER_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class PreparedFrame(Frame):
    """A frame of which it was decided whether the network looks at it.

    Attributes
    ----------
    seen : the frame as the eye for motion has prepared it.
    boxes : what the network found; None if it did not look.
    """

    seen: Frame
    boxes: ImageBoxes | GroundBoxes | None


@dataclass(frozen=True, slots=True)
class _Picture:
    """What is there of a frame: its road, and what the network found, or None between looks."""

    road: RoadImage | None
    found: FoundBoxes | None


class RatesBySize:
    """How reliably the network sees vehicles, by how large they are in the picture.

    Far away it misses more, so its silence says less. A size is an octave of metres per pixel.

    Parameters
    ----------
    settings : constants, for the memory of a rate.
    """

    def __init__(self, settings: VisionSettings) -> None:
        self._settings = settings.detection
        self._rates: dict[int, DetectionRate] = {}

    def of(self, metres_per_pixel: FloatArray) -> FloatArray:
        """Give the part of the vehicles at places of a scale, (n,), that the network sees."""
        return np.array([self._rate(octave).value for octave in _octaves(metres_per_pixel)])

    def learn(self, metres_per_pixel: FloatArray, is_hit: BoolArray) -> None:
        """Take in one look: which tracked vehicles, (n,), it has seen."""
        octaves = _octaves(metres_per_pixel)
        for octave in set(octaves):
            is_here = np.array(octaves) == octave
            self._rate(octave).learn(is_hit[is_here], np.ones(int(is_here.sum()), np.bool_))

    def _rate(self, octave: int) -> DetectionRate:
        return self._rates.setdefault(octave, DetectionRate(self._settings))


def _octaves(metres_per_pixel: FloatArray) -> list[int]:
    return [int(octave) for octave in np.floor(np.log2(np.maximum(metres_per_pixel, 1e-6)))]


class KnowingEye(Eye[Frame]):
    """An eye for motion, and a network that looks through it now and then.

    Parameters
    ----------
    road : sees what moves.
    boxes : puts the network's boxes on the same road.
    settings : constants.
    """

    def __init__(self, road: RoadEye, boxes: BoxEye[Frame], settings: VisionSettings) -> None:
        self._road = road
        self._boxes = boxes
        self._settings = settings
        self._limits = settings.networks
        self._rates = RatesBySize(settings)
        # Of the latest look: what the network saw, and what of it motion did not.
        self._seen = Boxes.none()
        self._unmoved = Detections.none()
        self._standing = Detections.none()

    @property
    def is_ready(self) -> bool:
        """Whether the road is known."""
        return self._road.is_ready

    def prepare(self, frame: Frame) -> PreparedFrame:
        """Sample the road of a frame, and look at it when it is time; frames come in order, from one thread."""
        boxes = self._boxes.detect_when_due(frame)
        planes = frame.luma, frame.chroma_u, frame.chroma_v
        return PreparedFrame(frame.index, frame.t_us, *planes, self._road.prepare(frame), boxes)

    def take(self, frame: Frame, pixel_from_ground: FloatArray | None) -> _Picture:
        """Take the road of a frame and what the network found in it."""
        prepared = frame if isinstance(frame, PreparedFrame) else self.prepare(frame)
        road = self._road.take(prepared.seen, pixel_from_ground)
        return _Picture(road, None if prepared.boxes is None else self._boxes.found(prepared.boxes, pixel_from_ground))

    def hold(self, picture: _Picture) -> None:
        """Take in a frame of the start-up; of those at which the network looked it is known where the road is bare."""
        if picture.road is None:
            return
        if picture.found is None:
            self._road.hold(picture.road)
            return
        footprints = self._boxes.look(picture.found, Expected.none()).detections.boxes
        self._road.hold(picture.road, self._road.appearances(footprints))

    def start(self) -> None:
        """End the start-up with what there is."""
        self._road.start()

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Tell which ground positions are road in view."""
        return self._road.holds(points_m)

    def look(self, picture: _Picture | None, expected: Expected) -> Channel:
        """Detect by motion, and join what the network found, where it looked."""
        channel = self._road.look(None if picture is None else picture.road, expected)
        if picture is None or not channel.is_open:
            return channel
        moved = channel.detections
        if picture.found is None:
            return replace(channel, detections=self._between(moved))
        known = self._boxes.look(picture.found, expected).detections
        return replace(channel, detections=self._joined(moved, known, expected))

    def judge(self, boxes: Boxes) -> VerdictArray:
        """Take what the network sees for vehicles; what it does not see, motion alone cannot prove."""
        verdicts = self._road.judge(boxes)
        return np.where(self._are_near(boxes, self._seen), np.int8(1), np.minimum(verdicts, 0)).astype(np.int8)

    def heal(self, ghosts: Boxes) -> None:
        """Learn the present picture where ghosts are."""
        self._road.heal(ghosts)

    def learn(self, claims: Boxes, is_real: BoolArray) -> None:
        """Learn the present picture, but not under objects."""
        self._road.learn(claims, is_real)

    def _between(self, moved: Detections) -> Detections:
        """Doubt what moves without a name, and add what stands where nothing moves."""
        known = self._standing.select(~self._are_near(self._standing.boxes, moved.boxes))
        trust, silence = self._settings.detection.lone_trust, 1.0 - self._reliability(moved)
        doubted = replace(moved, weight=_weights(moved, trust * silence / (trust * silence + 1.0 - trust)))
        return Detections.joined([doubted, replace(known, weight=np.zeros(len(known)))])

    def _joined(self, moved: Detections, known: Detections, expected: Expected) -> Detections:
        """Join both: of what both see motion tells the place, and what either sees alone is weighed."""
        pair, partner = self._pairs(moved.boxes, known.boxes)
        both, alone = moved.select(pair), known.select(_rest(len(known), partner))
        lone = moved.select(_rest(len(moved), pair))
        # Pieces of what the network sees as a whole are nobody's, unless a known vehicle owns them.
        lone = lone.select((lone.owner >= 0) | ~self._are_near(lone.boxes, known.boxes))
        self._learn_rates(known, both, expected)
        stood = self._pairs(alone.boxes, self._unmoved.boxes)[0]
        self._standing, self._unmoved, self._seen = alone.select(stood), alone, known.boxes
        evidence = self._limits.look_evidence
        # A network that misses as many as it sees denies nothing.
        denied = -evidence * np.maximum(2.0 * self._reliability(lone) - 1.0, 0.0)
        return Detections.joined(
            [
                replace(both, weight=np.full(len(both), evidence)),
                replace(alone, weight=np.full(len(alone), evidence)),
                replace(lone, weight=_weights(lone, denied)),
            ]
        )

    def _pairs(self, ones: Boxes, others: Boxes) -> tuple[IntArray, IntArray]:
        """Pair boxes that lie on each other as they are seen."""
        one, other = self._road.appearances(ones), self._road.appearances(others)
        gap = np.hypot(*(one.centre_m[:, None] - other.centre_m[None]).transpose(2, 0, 1))
        return assign(np.where(_overlap(one, other), gap, np.inf))

    def _are_near(self, ones: Boxes, others: Boxes) -> BoolArray:
        """Tell which boxes lie on one of the others as they are seen."""
        return np.asarray(_overlap(self._road.appearances(ones), self._road.appearances(others)).any(axis=1))

    def _reliability(self, found: Detections) -> FloatArray:
        return self._rates.of(self._boxes.metres_per_pixel(found.boxes.centre_m))

    def _learn_rates(self, known: Detections, both: Detections, expected: Expected) -> None:
        tracks = expected.known
        is_hit = self._are_near(tracks, known.boxes)
        is_hit[both.owner[both.owner >= 0]] = True
        is_in_view = self.holds(tracks.centre_m)
        scale = self._boxes.metres_per_pixel(tracks.centre_m[is_in_view])
        self._rates.learn(scale, is_hit[is_in_view])


def _weights(moved: Detections, stranger: FloatArray) -> FloatArray:
    """Let what has no name count for `stranger`, the rest as it does."""
    return np.where(moved.owner >= 0, moved.weights(), stranger)


def _rest(count: int, taken: IntArray) -> IntArray:
    return np.delete(np.arange(count), taken)


def _overlap(ones: Boxes, others: Boxes) -> BoolArray:
    """Tell for all pairs, (n, m), whether the middle of either lies well inside the other: neighbours only touch."""
    if len(ones) == 0 or len(others) == 0:
        return np.zeros((len(ones), len(others)), np.bool_)
    is_inside = distance_to_boxes(ones.centre_m, _inner(others)) < 0
    return np.asarray(is_inside | (distance_to_boxes(others.centre_m, _inner(ones)) < 0).T)


def _inner(boxes: Boxes) -> Boxes:
    return replace(boxes, length_m=INNER_SHARE * boxes.length_m, width_m=INNER_SHARE * boxes.width_m)
