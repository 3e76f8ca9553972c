"""What do two cameras see together? Detections of both, matched on the ground and fused by covariance.

A colour camera sees shape but takes a shadow for a part of the car, and little at night; a thermal camera sees
vehicles by day and night and no shadows, but coarsely. What both see is one measurement, weighted by how well each
knows the place. What only one sees is kept with less weight, the less the more reliably the other one has seen
vehicles so far: by day a dark patch without warmth is probably a shadow, at night the colour camera's silence means
nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vision.detection.detector import Detections
from vision.detection.settings import DetectionSettings
from vision.objects import BoolArray, FloatArray, IntArray
from vision.road.boxes import Boxes, distance_to_boxes
from vision.tracking import kalman
from vision.tracking.association import assign


@dataclass(frozen=True, slots=True)
class Channel:
    """One camera's part in a fusion.

    Attributes
    ----------
    detections : of one frame.
    holds : tells which ground positions, (n, 2), it sees as road.
    rate : how many of the vehicles in its view it detects, 0 to 1; only a fusion needs it, and learns it.
    bias_m : how far its boxes lie beside vehicles, the same way for many frames: it counts when a place is weighed
        against that of the other camera, and not as noise, which the tracker would smooth over time.
    is_open : False while it sees nothing at all: no frame, no background yet, another view.
    is_between : whether it has not looked, since its next look is due later.
    """

    detections: Detections
    holds: Callable[[FloatArray], BoolArray]
    rate: float = 0.0
    is_open: bool = True
    bias_m: float = 0.0
    is_between: bool = False


class DetectionRate:
    """How reliably a camera sees the vehicles that are tracked."""

    def __init__(self, settings: DetectionSettings) -> None:
        self._settings = settings
        self._hits, self._chances = settings.rate_prior / 2, settings.rate_prior

    @property
    def value(self) -> float:
        """Part of the vehicles in view that are detected, 0 to `most_rate`."""
        return min(self._hits / self._chances, self._settings.most_rate)

    def learn(self, is_hit: BoolArray, is_seen: BoolArray) -> None:
        """Take in one frame.

        Parameters
        ----------
        is_hit : (k,) which of the confirmed tracks it has detected.
        is_seen : (k,) which of them are in its view.
        """
        keep = max(0.0, 1.0 - float(is_seen.sum()) / self._settings.rate_memory)
        self._hits = keep * self._hits + float((is_hit & is_seen).sum())
        self._chances = keep * self._chances + float(is_seen.sum())


class Fusion:
    """Joins the detections of two cameras over time, each trusted as far as it has seen the tracks so far."""

    def __init__(self, settings: DetectionSettings) -> None:
        self._settings = settings
        self._rates = DetectionRate(settings), DetectionRate(settings)

    def join(self, first: Channel, second: Channel, *, known: Boxes) -> Detections:
        """Take in one frame, as `fuse` does; `known` are the confirmed tracks, of which owners are rows."""
        for channel, rate in zip((first, second), self._rates, strict=True):
            if channel.is_open:
                is_hit = np.isin(np.arange(len(known)), channel.detections.owner)
                rate.learn(is_hit, channel.holds(known.centre_m))
        one, other = (rate.value for rate in self._rates)
        return fuse(replace(first, rate=one), replace(second, rate=other), self._settings)


def fuse(first: Channel, second: Channel, settings: DetectionSettings) -> Detections:
    """Join the detections of two cameras.

    Parameters
    ----------
    first, second : of the same moment; owners are rows of the same tracks.
    settings : gate, trust.

    Returns
    -------
    One row for each vehicle that either sees; the weight says how probable it is.
    """
    rows, columns = assign(_costs(first.detections, second.detections, settings))
    both = _merged(first.detections.select(rows), second.detections.select(columns), (first.bias_m, second.bias_m))
    alone = [
        _alone(one, other, np.delete(np.arange(len(one.detections)), taken), settings.lone_trust)
        for one, other, taken in ((first, second, rows), (second, first, columns))
    ]
    seen = [Detections.joined([both, one]) for one in alone]
    whole = [_whole(mine, other, settings.piece_reach_m) for mine, other in zip(alone, seen[::-1], strict=True)]
    return Detections.joined([both, *whole])


def _whole(lone: Detections, others: Detections, reach_m: float) -> Detections:
    """Drop pieces: what one camera sees in fragments, and the other one, or both, as a larger vehicle."""
    is_near = distance_to_boxes(lone.boxes.centre_m, others.boxes) < reach_m
    areas_m2 = [one.boxes.length_m * one.boxes.width_m for one in (lone, others)]
    is_larger = areas_m2[1] > areas_m2[0][:, None]
    return lone.select((lone.owner >= 0) | ~(is_near & is_larger).any(axis=1))


def _costs(one: Detections, other: Detections, settings: DetectionSettings) -> FloatArray:
    """Compute squared Mahalanobis distances (n, m); infinite for what cannot be one vehicle."""
    if len(one) == 0 or len(other) == 0:
        return np.zeros((len(one), len(other)))
    gate = settings.fusion_sigmas**2
    offset = other.boxes.centre_m[None] - one.boxes.centre_m[:, None]
    noise = one.noise[:, None] + other.noise[None] + settings.registration_m**2 * np.eye(2)
    squared = np.einsum("nmi,nmij,nmj->nm", offset, kalman.inverse(noise), offset)
    is_inside = distance_to_boxes(one.boxes.centre_m, other.boxes) < 0
    is_inside |= distance_to_boxes(other.boxes.centre_m, one.boxes).T < 0
    is_owned = (one.owner >= 0)[:, None] & (other.owner >= 0)[None]
    is_same = one.owner[:, None] == other.owner[None]
    is_possible = np.where(is_owned, is_same, (squared <= gate) | is_inside)
    # A common owner is better evidence than any distance.
    return np.where(is_possible, np.where(is_owned, 0.0, gate) + squared, np.inf)


def _merged(one: Detections, other: Detections, bias_m: tuple[float, float]) -> Detections:
    """Fuse pairs: places by covariance, sizes by the same weights; what the view cuts gives way to what is whole."""
    noises = [
        np.where((mine.cut != 0)[:, None, None] & (theirs.cut == 0)[:, None, None], 1e4, 1.0) * mine.noise
        for mine, theirs in ((one, other), (other, one))
    ]
    noise = kalman.inverse(kalman.inverse(noises[0]) + kalman.inverse(noises[1]))
    certain = [kalman.inverse(mine + bias**2 * np.eye(2)) for mine, bias in zip(noises, bias_m, strict=True)]
    pull = [
        np.einsum("nij,nj->ni", sure, side.boxes.centre_m) for sure, side in zip(certain, (one, other), strict=True)
    ]
    together = kalman.inverse(certain[0] + certain[1])
    share = np.trace(certain[0], axis1=1, axis2=2)
    share = share / (share + np.trace(certain[1], axis1=1, axis2=2))
    is_first = (one.owner >= 0) | ((other.owner < 0) & (one.elongation >= other.elongation))
    heading_rad = np.where(is_first, one.boxes.heading_rad, other.boxes.heading_rad)
    is_cut = (one.cut != 0) & (other.cut != 0)
    return Detections(
        boxes=Boxes(
            np.einsum("nij,nj->ni", together, pull[0] + pull[1]),
            heading_rad,
            share * one.boxes.length_m + (1 - share) * other.boxes.length_m,
            share * one.boxes.width_m + (1 - share) * other.boxes.width_m,
        ),
        noise=noise,
        elongation=np.where(is_first, one.elongation, other.elongation),
        owner=np.where(one.owner >= 0, one.owner, other.owner),
        divided=one.divided & other.divided,
        directed=np.where(is_first, one.directed, other.directed),
        cut=np.where(is_cut, np.where(is_first, one.cut, other.cut), 0).astype(np.int8),
        # Its box is no longer that of one picture, so the shadow in one picture says nothing about it.
        borders_m=np.full((len(one), 4), np.nan),
        weight=np.ones(len(one)),
    )


def _alone(one: Channel, other: Channel, rows: IntArray, trust: float) -> Detections:
    """Weigh what only one camera sees by the silence of the other, where that one looks too."""
    found = one.detections.select(rows)
    silence = np.ones(len(found))
    if other.is_open and len(found) > 0:
        silence = np.where(other.holds(found.boxes.centre_m), 1.0 - other.rate, 1.0)
    weight = trust * silence / (trust * silence + (1.0 - trust))
    # A track that is known needs no more proof.
    return replace(found, weight=np.where(found.owner >= 0, 1.0, weight))
