"""By which setting was a relation false? What it rests on is measured again, from the cars that a log holds.

Only what is certain is told. Where cars are across their roads, and the routes between them, are not stored: cars on
one road are measured along it if they are in one lane, cars on two roads by the distance of their bodies alone.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chronicles.explanation.explanations import Failure, HoldReading, MissingEvent, WhyNot
from qsr.measuring.footprints import BoolArray, FloatArray, Footprints, object_table
from qsr.measuring.road_relations import switch_values
from qsr.relations import Switch
from qsr.settings import RelationSettings
from service.records.runs import RunRecord
from service.records.seen import CarState
from service.records.times import format_media
from service.runs.graph.relations import SETTINGS, stored_settings
from service.store.log import EventLog

_RELATION = re.compile(r"(\w+)\[([^]]*)\]")
_SLIGHT = 1e-9

_Span = tuple[int | None, int | None]  # half-open; None is without an end


@dataclass(frozen=True, slots=True)
class _Measure:
    """What a setting bounds, in n frames: from above if `is_most`, else from below."""

    setting: str
    words: str
    unit: str
    values: FloatArray
    is_most: bool = True

    def ratios(self, settings: RelationSettings) -> FloatArray:
        """Say by which factor each value is beyond its bound; above 1 it is."""
        limit, values = getattr(settings, self.setting), np.maximum(self.values, _SLIGHT)
        return np.asarray(values / limit if self.is_most else limit / values)

    def told(self, row: int, settings: RelationSettings) -> str:
        """Say what was measured, and what was asked."""
        side, limit = "above" if self.is_most else "below", getattr(settings, self.setting)
        return f"{self.words} was {self.values[row]:.2f} {self.unit}, {side} {SETTINGS}{self.setting} ({limit:g})"


_Measured = tuple[BoolArray, Sequence[_Measure]]
"""In which of n frames nothing else was against a relation, and its measures."""


def with_settings(log: EventLog, run: RunRecord, found: WhyNot) -> WhyNot:
    """Add to the failures of near misses by which setting a relation was false.

    Parameters
    ----------
    log : of the run, open.
    found : near misses of it.

    Returns
    -------
    The same, with `Failure.because` where a setting is to be named.
    """
    settings, window = stored_settings(run), (found.start_us, found.end_us)
    misses = [
        replace(
            miss,
            failures=tuple(replace(one, because=_because(log, run.id, settings, one, window)) for one in miss.failures),
        )
        for miss in found.near_misses
    ]
    return replace(found, near_misses=tuple(misses))


def _because(log: EventLog, run_id: str, settings: RelationSettings, failure: Failure, window: _Span) -> str:
    text, spans = _asked(failure, window)
    read = _RELATION.match(text)
    if read is None:
        return ""
    name, cars = read[1], read[2].split(", ")
    told = [_nearest(_frames(log, run_id, cars, span), name, settings) for span in spans]
    return min(filter(None, told), default=(0.0, ""))[1]


def _asked(failure: Failure, window: _Span) -> tuple[str, list[_Span]]:
    """Find which relation should have been true, and in which intervals it was not."""
    match failure.subject:
        case HoldReading(wanted="true", start_us=int(start_us), end_us=int(end_us)) as hold:
            spans = [(one.start_us or start_us, one.end_us or end_us) for one in hold.contrary if one.value == "false"]
            return hold.subject, [(max(start_us, first_us), min(end_us, last_us)) for first_us, last_us in spans]
        case MissingEvent() as event if event.pattern.endswith(", true)"):
            # Where nothing that was found says when it should have come, all that was asked about is looked at.
            span = window if event.latest_us is None else (event.earliest_us, event.latest_us + 1)
            return event.pattern, [span]
    return "", []


def _frames(log: EventLog, run_id: str, cars: Sequence[str], span: _Span) -> list[tuple[CarState, ...]]:
    """Read the states of the frames in which all of the cars were seen."""
    from_us, to_us = span
    lives = [
        {one.t_us: one for one in log.states(run_id, cars=(car,), from_us=from_us, to_us=to_us) if one.linked}
        for car in cars
    ]
    return [tuple(life[t_us] for life in lives) for t_us in sorted(set(lives[0]).intersection(*lives[1:]))]


def _nearest(frames: Sequence[tuple[CarState, ...]], name: str, settings: RelationSettings) -> tuple[float, str] | None:
    """Say of the frame in which a relation came nearest to being true which settings were against it."""
    is_else_met, measures = _measured(frames, name, settings)
    if not measures:
        return None
    ratios = np.array([one.ratios(settings) for one in measures])
    worst = np.where(is_else_met & (ratios.max(axis=0) > 1), ratios.max(axis=0), np.inf)
    row = int(worst.argmin())
    if not np.isfinite(worst[row]):
        return None
    said = " and ".join(
        one.told(row, settings) for one, ratio in zip(measures, ratios[:, row], strict=True) if ratio > 1
    )
    return float(worst[row]), f"at {format_media(frames[row][0].t_us)} {said}"


def _measured(frames: Sequence[tuple[CarState, ...]], name: str, settings: RelationSettings) -> _Measured:
    always = np.ones(len(frames), np.bool_)
    if not frames:
        return always, []
    if name == "moving":
        speed_mps = np.array([one.speed_mps for (one,) in frames])
        return always, [_Measure("moving_mps", "the speed", "m/s", speed_mps, is_most=False)]
    return _pair(frames, name, settings) if len(frames[0]) == 2 else (always, [])


def _pair(frames: Sequence[tuple[CarState, ...]], name: str, settings: RelationSettings) -> _Measured:
    """Measure a relation of two cars, as `qsr` does."""
    count = len(frames)
    is_off_road = np.array([not (a.road and b.road) for a, b in frames])
    is_one_lane = np.array([bool(a.lane) and (a.road, a.lane) == (b.road, b.lane) for a, b in frames])
    footprints = _footprints([a for a, _ in frames] + [b for _, b in frames], np.tile(is_one_lane, 2))
    columns = np.arange(2 * count).reshape(2, count)
    values = switch_values(object_table(footprints, widest_m=settings.widest_m), columns, settings)
    rear_m, front_m = values[Switch.PAST_REAR], values[Switch.PAST_FRONT]
    is_beside, is_known = (rear_m >= 0) & (front_m <= 0), is_off_road | is_one_lane
    is_next = is_known & (rear_m < 0) & (values[Switch.IN_PATH] > 0) & (values[Switch.SAME_DIRECTION] > 0)
    speed_mps = footprints.speed_mps[:count]
    gap_s = -rear_m / np.maximum(speed_mps, _SLIGHT)
    cosine = np.clip(values[Switch.SAME_DIRECTION] + np.cos(settings.heading_limit_rad), -1.0, 1.0)
    turn = _Measure("heading_limit_rad", "the angle between the headings", "rad", np.arccos(cosine))
    aside = settings.beside_lateral_m - values[Switch.LATERAL_NEAR]
    match name:
        case "close":
            apart_m = settings.close_m - values[Switch.CLOSE]
            return np.ones(count, np.bool_), [_Measure("close_m", "the distance between the bodies", "m", apart_m)]
        case "beside":
            lateral = _Measure("beside_lateral_m", "the lateral distance", "m", aside)
            return is_off_road & is_beside, [lateral, turn]
        case "behind" | "ahead":
            return is_off_road & (rear_m < 0 if name == "behind" else front_m > 0), [turn]
        case "same_direction":
            return is_off_road, [turn]
        case "following" | "short_headway":
            limit, least = "following_s", "moving_mps"
            if name == "short_headway":
                limit, least = "short_headway_s", "short_headway_least_mps"
            gap = _Measure(limit, "the time gap", "s", gap_s)
            return is_next, [gap, _Measure(least, "the speed", "m/s", speed_mps, is_most=False)]
    return is_known, []


def _footprints(cars: Sequence[CarState], is_on_road: BoolArray) -> Footprints:
    """Lay out cars as the relations see them, those of one lane in the middle of one road."""

    def column(values: Iterator[float]) -> FloatArray:
        return np.fromiter(values, np.float64, len(cars))

    heading_rad, along_m = column(one.heading_rad for one in cars), column(one.along_m or 0.0 for one in cars)
    centre_m = np.array([(one.x_m, one.y_m) for one in cars])
    half = len(cars) // 2
    apart_m, apart_along_m = centre_m[:half] - centre_m[half:], along_m[:half] - along_m[half:]
    # Which way the road runs is seen by who is farther along it.
    ahead_m = apart_m[:, 0] * np.cos(heading_rad[:half]) + apart_m[:, 1] * np.sin(heading_rad[:half])
    turned_rad = np.where(ahead_m * apart_along_m < 0, np.pi, 0.0)
    is_oncoming = np.cos(heading_rad[:half] - heading_rad[half:]) < 0
    turned_rad = np.concatenate([turned_rad, turned_rad + np.pi * is_oncoming])
    nowhere = np.full(len(cars), -1, np.int32)
    return Footprints.of(
        t_us=0,
        ids=tuple(map(str, range(len(cars)))),
        centre_m=centre_m,
        heading_rad=heading_rad,
        speed_mps=column(one.speed_mps for one in cars),
        length_m=column(one.length_m for one in cars),
        width_m=column(one.width_m for one in cars),
        road=np.where(is_on_road, 0, -1).astype(np.int32),
        along_m=along_m,
        across_m=np.zeros(len(cars)),
        tangent_rad=heading_rad + turned_rad,
        junction=nowhere,
    )
