"""Every number of tracking matters: twice or half of it changes what is told of a scene made for its reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from tests.turned import unnoticed, without_scene
from tests.vision.support import FloatArray
from tests.vision.tracking.test_tracker import STEP_US, Row, detect, everywhere, names
from vision.camera import Camera
from vision.detection.detector import Expected, Velocities
from vision.detection.eye import Eye
from vision.detection.fusion import Channel
from vision.networks.box_detector import Instant
from vision.networks.stored_detections import StoredInstant
from vision.objects import BoolArray, VisionObjects
from vision.settings import VisionSettings
from vision.tracking.settings import TrackingSettings
from vision.tracking.tracker import Tracker


def car(east_m: float, north_m: float = 0.0, *, length_m: float = 4.5) -> Row:
    return (east_m, north_m, 0.0, length_m, 1.8)


class Watch:
    """A tracker, and clean sightings for it; `spread_m` is the standard deviation that they claim."""

    def __init__(self, settings: TrackingSettings, *, step_us: int = STEP_US, spread_m: float = 0.1) -> None:
        self.tracker = Tracker(replace(VisionSettings(), tracking=settings), everywhere)
        self._step_us = step_us
        self._t_us = 0
        self._noise = spread_m**2 * np.eye(2)

    def see(self, *rows: Row, **columns: npt.ArrayLike) -> VisionObjects:
        """Show the next frame; columns of the detections are given for each, or one for all."""
        seen = detect(rows, known=self.tracker.predict(self._t_us).known)
        self._t_us += self._step_us
        given = {name: np.broadcast_to(value, len(rows)) for name, value in columns.items()}
        noise = np.broadcast_to(self._noise, (len(rows), 2, 2))
        return self.tracker.update(replace(seen, noise=noise, **given))

    def see_all(self, frames: Iterable[Sequence[Row]]) -> list[VisionObjects]:
        return [self.see(*rows) for rows in frames]


def first_shown(results: Sequence[VisionObjects]) -> int | None:
    return next((k for k, result in enumerate(results) if len(result.ids) > 0), None)


def tenth(value: float) -> float:
    return round(float(value), 1)


def car_that_brakes_and_swerves(settings: TrackingSettings) -> object:
    """Follow cars that brake and change lanes: how fast are they said to be?"""
    watch, told = Watch(settings, spread_m=0.3), []
    for k in range(50):
        t_s = max(0.0, 0.04 * k - 1.0)
        told.append(watch.see(car(0.6 * k - 3 * t_s**2), car(0.6 * k, 30 + 1.5 * t_s**2)))
    return [(tenth(r.velocity_mps[0, 0]), tenth(r.velocity_mps[1, 1])) for r in told[30::10]]


def truck_of_which_the_rear_is_smeared(settings: TrackingSettings) -> object:
    """Follow a truck whose front end is hidden, and whose rear end stays behind in the picture."""
    watch, speeds_mps = Watch(settings), []
    for k in range(60):
        rear_m = 0.6 * k
        front_m = min(rear_m + 10.0, 34.0)
        left_m = rear_m - 1.5 if front_m < rear_m + 10 else rear_m
        parts = [car((left_m + front_m) / 2, length_m=front_m - left_m)] if front_m > rear_m + 1 else []
        speeds_mps += [watch.see(*parts).velocity_mps[:, 0]]
    return tenth(np.concatenate(speeds_mps[30:]).min())


def jumping_lights(settings: TrackingSettings) -> object:
    """See things at 43 m/s and 70 m/s: is there any name for them?"""
    return [len(names(Watch(settings).see_all([car(0.04 * k * v)] for k in range(8)))) for v in (43.0, 70.0)]


def cars_too_fast_for_the_limit(settings: TrackingSettings) -> object:
    """See cars that are hidden for half a second, and were too fast meanwhile: how often is that told?"""
    slow, told = replace(settings, max_speed_mps=20.0, acceleration_along_mps2=30.0), []
    for v in (14.0, 17.0):
        watch = Watch(slow, step_us=80_000, spread_m=0.2)
        watch.see_all([car(0.08 * k * v)] for k in range(12))
        watch.see_all([] for _ in range(5))
        watch.see(car(0.08 * 11 * v + 13))
        told.append(watch.tracker.cut_count)
    return told


def car_that_turns(settings: TrackingSettings) -> object:
    """See a car turn at 12.5 frames a second: where is it said to be?"""
    watch, told = Watch(settings, step_us=80_000, spread_m=0.3), []
    for k in range(30):
        angle_rad = min(max(0.08 * (k - 12), 0.0), 1.57)
        told = watch.see(
            (10 * np.sin(angle_rad) + min(0.8 * (k - 12), 0.0), 10 - 10 * np.cos(angle_rad), angle_rad, 4.5, 1.8)
        )
    return [tenth(one) for one in told.centre_m[0]]


def creeping_cars(settings: TrackingSettings) -> object:
    """See cars creep away from where their boxes point: where do they head, and which are expected to go on?"""
    watch = Watch(settings, spread_m=0.05)
    ways = [v * np.array([np.cos(0.6), np.sin(0.6)]) for v in (1.0, 2.0, 3.5)]
    for k in range(40):
        watch.see(*(car(0.04 * k * way[0], 20 * i + 0.04 * k * way[1]) for i, way in enumerate(ways)))
    expected = watch.tracker.predict(40 * STEP_US)
    return [tenth(one) for one in expected.known.heading_rad], expected.is_driving.tolist()


def cars_that_back(settings: TrackingSettings) -> object:
    """See cars drive to the west whose boxes point to the east: after how many frames is it known?"""
    watch, headings = Watch(settings, spread_m=0.3), []
    for k in range(30):
        watch.see(car(-0.12 * k), car(-0.2 * k, 20))
        headings.append(np.abs(watch.tracker.claims()[0].heading_rad) > 1)
    return np.argmax(headings, axis=0).tolist()


def car_drawn_aside(settings: TrackingSettings) -> object:
    """See a car creep, and its box gather cells of a neighbour beside it: has it turned?"""
    watch = Watch(settings, spread_m=0.3)
    for k in range(40):
        watch.see(car(0.08 * k, 0.15 * max(0, k - 25)), divided=k > 25)
    return [tenth(one) for one in watch.tracker.claims()[0].heading_rad]


def sightings_beside_the_course(settings: TrackingSettings) -> object:
    """See cars for a second, and then something beside the course of each: are they the cars?"""
    watch = Watch(settings, spread_m=0.3)
    for k in range(25):
        watch.see(*(car(0.6 * k, 20 * i) for i in range(2)))
    return watch.see(car(0.6 * 25, 1.1), car(0.6 * 25, 22.0)).observed.tolist()


def bus_at_the_view_edge(settings: TrackingSettings) -> object:
    """See a bus come into view, completed by the length of a car at first: how fast does it seem to be?"""
    watch = Watch(settings)
    told = [watch.see(car(0.3 * k, length_m=0.6 * k + 3), cut=np.int8(-1)) for k in range(30)]
    return [[tenth(one) for one in r.velocity_mps[:, 0]] for r in told[::3]]


def cars_in_one_blob(settings: TrackingSettings) -> object:
    """See two cars whose shared blob is divided now here, now there: how far do they swerve?"""
    watch, told = Watch(settings), []
    for k in range(40):
        shift_m = 0.0 if k < 20 else 0.4 * (-1) ** (k // 3)
        told.append(watch.see(car(0.6 * k, 1.2 + shift_m), car(0.6 * k, -1.2 + shift_m), divided=k >= 20))
    return round(max(float(np.abs(r.centre_m[:, 1]).max()) for r in told[20:]), 2)


def oncoming_while_unseen(settings: TrackingSettings) -> object:
    """Lose motorcycles of all speeds from sight while something comes from where they were."""
    speeds_mps = (1.8, 2.2, 2.6, 3.5, 4.0, 5.0, 8.0)
    watch = Watch(settings, spread_m=0.3)
    for k in range(40):
        watch.see(*((0.04 * k * v, 20.0 * i, 0.0, 1.8, 0.8) for i, v in enumerate(speeds_mps)))
    for _ in range(5):
        watch.see()
    seen = [(0.04 * 39 * v - 1.4, 20.0 * i, 0.0, 1.8, 0.8) for i, v in enumerate(speeds_mps)]
    return watch.see(*seen).observed.tolist()


def sightings_that_come_back(settings: TrackingSettings) -> object:
    """Lose motorcycles from sight, and then see something a little behind where they were: how much is noise?"""
    watch = Watch(settings)
    for k in range(30):
        watch.see(*((0.132 * k, 20.0 * i, 0.0, 1.8, 0.8) for i in range(5)))
    for _ in range(10):
        watch.see()
    return watch.see(*((0.132 * 29 - 0.2 * (i + 1), 20.0 * i, 0.0, 1.8, 0.8) for i in range(5))).observed.tolist()


def cars_that_entered_as_one(settings: TrackingSettings) -> object:
    """See two cars come as one and part: does the box that stood for both jump to one of them?"""
    told = []
    for jump_m in (3.0, 5.0, 7.0, 9.0):
        watch = Watch(settings, step_us=200_000, spread_m=0.1)
        for k in range(4):  # no size is relied on before 0.4 s
            watch.see(car(1.0 * k, length_m=4.5 + 2 * jump_m))
        told.append(watch.see(car(1.0 * 4 - jump_m), car(1.0 * 4 + jump_m)).observed.tolist())
    return told


def hidden_ends(settings: TrackingSettings) -> object:
    """See cars of which the rear end is as dark as the road: where are they?"""
    watch, short_m = Watch(settings), (0.3, 0.45, 0.7, 1.4)
    for k in range(30):
        cut_m = [one if k >= 25 else 0.0 for one in short_m]
        told = watch.see(*(car(0.6 * k + one / 2, 20 * i, length_m=4.5 - one) for i, one in enumerate(cut_m)))
    return [tenth(one) for one in told.centre_m[:, 0] - 0.6 * 29]


def wild_sightings(settings: TrackingSettings) -> object:
    """See cars now left, now right of where they are, by more than is claimed: how much do they sway?"""
    watch, told = Watch(settings), []
    for k in range(50):
        told.append(watch.see(*(car(0.6 * k, 20 * i + 0.4 * (k > 15) * (-1) ** k) for i in range(10))))
    return len(names(told)), [round(float(np.abs(r.velocity_mps[:, 1]).mean()), 2) for r in told[29::4]]


def things_of_all_sizes(settings: TrackingSettings) -> object:
    """See things drive that may be no vehicles: how many get a name?"""
    sizes_m = [(1.2, 0.6), (2.5, 0.8), (20.0, 2.5), (45.0, 3.0), (12.0, 6.0), (12.5, 12.0)]
    frames = ([(0.6 * k, 30.0 * i, 0.0, *one) for i, one in enumerate(sizes_m)] for k in range(8))
    return len(names(Watch(settings).see_all(frames)))


def inexact_newcomer(settings: TrackingSettings) -> object:
    """See a car at 5 frames a second, to the metre: how fast is it said to be at first?"""
    watch = Watch(settings, step_us=200_000, spread_m=1.0)
    told = watch.see_all([car(4.0 * k)] for k in range(8))
    return [tenth(one) for r in told for one in r.velocity_mps[:, 0]]


def fast_newcomers(settings: TrackingSettings) -> object:
    """See cars drive along and across their long axes, which may be clear or not: in which lanes is a name?"""
    watch, steps_m = Watch(settings), [(1.76, 0.0), (0.0, 0.6), (0.0, 1.2), (0.0, 1.2), (0.0, 1.2)]
    for k in range(8):
        rows = [car(k * east_m, 80 * i + k * north_m) for i, (east_m, north_m) in enumerate(steps_m)]
        told = watch.see(*rows, elongation=(2.5, 4.0, 4.0, 1.2, 2.5))
    return np.floor(told.centre_m[:, 1] / 80).tolist()


def cars_followed_wrongly(settings: TrackingSettings) -> object:
    """See cars whose speeds are said to be off by more and more: whose are believed?"""
    watch = Watch(settings)
    for k in range(20):
        told = watch.see(*(car(0.6 * k, 20 * i) for i in range(12)))
    mean_mps = np.column_stack([15.0 + np.arange(12), np.zeros(12)])
    velocities = Velocities(mean_mps, np.broadcast_to(0.5 * np.eye(2), (12, 2, 2)))
    rows = [car(12.0, 20 * i) for i in range(12)]
    watch.tracker.predict(20 * STEP_US)
    told = watch.tracker.update(replace(detect(rows), velocities=velocities))
    return [tenth(one) for one in told.velocity_mps[:, 0]]


def newcomers(settings: TrackingSettings) -> object:
    """See cars at 25, 10 and 5 frames a second, surely or not: when are they shown?"""
    shown = []
    for step_us, weight in ((40_000, 1.0), (100_000, 1.0), (200_000, 1.0), (100_000, 0.6)):
        watch = Watch(settings, step_us=step_us)
        shown.append(first_shown([watch.see(car(15e-6 * k * step_us), weight=weight) for k in range(10)]))
    return shown


def standing_things(settings: TrackingSettings) -> object:
    """See things that move a little, once: how many are shown?"""
    shifts_m = (0.7, 1.5, 2.5)
    watch = Watch(settings)
    told = watch.see_all([car(min(0.1 * k, one), 20 * i) for i, one in enumerate(shifts_m)] for k in range(40))
    return len(told[-1].ids)


class GivenEye(Eye[Instant]):
    """An eye that sees a car at one place from the tenth instant on, and judges that it is one."""

    def take(self, instant: Instant, pixel_from_ground: FloatArray | None) -> int:
        return instant.index

    def holds(self, points_m: FloatArray) -> BoolArray:
        return everywhere(points_m)

    def look(self, picture: int | None, expected: Expected) -> Channel:
        is_there = picture is not None and picture >= 10
        return Channel(detect([car(0.0)] if is_there else [], known=expected.known), self.holds, 1.0)


def standing_car(settings: TrackingSettings) -> object:
    """See a car that never moves, some time after the start: when is it shown?"""
    camera = Camera([GivenEye()], None, replace(VisionSettings(), tracking=settings))
    told = [objects for k in range(60) for objects in camera.observe(StoredInstant(k, k * STEP_US))]
    return first_shown(told)


def flickering(settings: TrackingSettings) -> object:
    """See cars for two frames, and again a little later: when is the first name told?"""
    shown = []
    for gap in (4, 9):
        is_seen = [True] * 2 + [False] * gap + [True] * 6
        frames = ([car(0.6 * k)] if one else [] for k, one in enumerate(is_seen))
        shown.append(first_shown(Watch(settings).see_all(frames)))
    return shown


def hidden_cars(settings: TrackingSettings) -> object:
    """Lose cars from sight: for how long are they shown, and whose names are known again?"""
    told = []
    for speed_mps, seen, hidden in ((15, 50, 20), (15, 50, 40), (12, 25, 20), (6, 25, 20)):
        watch = Watch(settings, step_us=100_000)
        is_seen = [True] * seen + [False] * hidden + [True] * 5
        results = watch.see_all([car(0.1 * k * speed_mps)] if one else [] for k, one in enumerate(is_seen))
        told.append((len(names(results)), sum(len(r.ids) > 0 for r in results)))
    return told


def hidden_soon(settings: TrackingSettings) -> object:
    """Lose cars from sight that were seen seven or fifteen times before, each 0.2 s: whose names are known again?"""
    told = []
    for count in (7, 15):
        watch = Watch(settings, step_us=200_000)
        frames = ([] if count <= k < count + 6 else [car(3.0 * k)] for k in range(count + 10))
        told.append(len(names(watch.see_all(frames))))
    return told


def stopping_things(settings: TrackingSettings) -> object:
    """See cars creep a little and stop: how many are said to stand for two and for three seconds?"""
    watch = Watch(settings)
    for k in range(76):
        watch.see(*(car(min(0.02 * k, one), 20 * i) for i, one in enumerate((0.3, 0.6, 1.2))))
    return [len(watch.tracker.standing(us)[0]) for us in (2_000_000, 3_000_000)]


def things_that_creep_aside(settings: TrackingSettings) -> object:
    """See cars brake, and something creep away from each, more or less sideways: which are known for cars still?"""
    watch = Watch(settings, spread_m=0.3)
    ways = [v * np.array([np.cos(a), np.sin(a)]) for v, a in ((0.8, 1.05), (2.0, 1.4), (1.0, 0.52), (4.0, 1.5))]
    for k in range(75):
        braking_s, creep_s = min(0.04 * k, 1.5), 0.04 * max(k - 50, 0)
        east_m = 9 * braking_s - 3 * braking_s**2
        watch.see(*(car(east_m + creep_s * way[0], 20 * i + creep_s * way[1]) for i, way in enumerate(ways)))
    return watch.tracker.claims()[1].tolist()


def car_seen_aside(settings: TrackingSettings) -> object:
    """See a car drive, and then now left, now right of where it is: is it known for a car still?"""
    watch = Watch(settings, spread_m=0.6)
    for k in range(85):
        watch.see(car(0.18 * k, 1.6 * (-1) ** (k // 5) if k >= 75 else 0.0))
    return watch.tracker.claims()[1].tolist()


def measured_lengths(settings: TrackingSettings) -> object:
    """See cars whose lengths change, one by a little and for good, one by much now and then: how long are they?"""
    watch = Watch(settings)
    for k in range(70):
        lengths_m = 5.5 if k > 30 else 4.5, 4.5 + 1.4 * (k % 4 == 3)
        told = watch.see(*(car(0.6 * k, 20 * i, length_m=one) for i, one in enumerate(lengths_m)))
    return [tenth(one) for one in told.length_m]


def lengths_that_were_wrong(settings: TrackingSettings) -> object:
    """See cars that had entered as one, and what shows of them in a torn blob: when are they known to be shorter?"""
    watch, told = Watch(settings), []
    for k in range(70):
        lengths_m = (9.5, 9.5, 9.5) if k < 30 else (7.5, 8.4, 4.5 if k % 7 else 6.6)
        told.append(watch.see(*(car(0.6 * k, 20 * i, length_m=one) for i, one in enumerate(lengths_m))).length_m)
    return np.argmax(np.array(told[30:]) < [7.7, 8.5, 6.9], axis=0).tolist()


def fragments(settings: TrackingSettings) -> object:
    """See cars with fragments of them, more or less inside: how many names are there, frame by frame?"""
    watch, counts = Watch(settings), []
    for k in range(30):
        rows = [car(0.6 * k, 20 * i) for i in range(3)]
        rows += [(0.6 * k + 0.8, 20 * i + aside_m, 0.0, 2.0, 1.0) for i, aside_m in enumerate((0.2, 0.45, 0.72))]
        counts.append(len(watch.see(*rows).ids))
    return counts


def turns(settings: TrackingSettings) -> object:
    """See two names of one vehicle in turns of some frames each; see a vehicle hidden beside another for a while."""
    counts = []
    for turn in (1, 7):
        watch = Watch(settings)
        for k in range(60):
            pair = [car(0.6 * k), car(0.6 * k + 0.5, 1.7)]
            counts.append(len(watch.see(*(pair if k < 25 else [pair[k // turn % 2]])).ids))
    watch = Watch(settings)
    for k in range(45):
        hidden = [car(0.6 * k + 0.5, 1.7)]
        counts.append(len(watch.see(car(0.6 * k), *([] if 25 <= k < 42 else hidden)).ids))
    return counts


# Speed, gap, how far aside, and how much faster the one behind is.
PAIRS = (
    *((6.0, 1.0, 0.0, 0.0), (6.0, 2.0, 0.0, 0.0), (20.0, 2.0, 0.0, 0.0), (20.0, 4.0, 0.0, 0.0), (20.0, 1.0, 1.0, 0.0)),
    *((20.0, 1.0, 2.0, 0.0), (20.0, 2.5, 0.0, 1.4), (20.0, 2.8, 0.0, 2.5), (3.0, 0.4, 0.0, 0.0)),
)


def pairs(settings: TrackingSettings) -> object:
    """See pairs drive in line: after how many frames is each one vehicle, if ever?"""
    watch, counts = Watch(settings, step_us=80_000), []
    for k in range(40):
        t_s, rows = 0.08 * k, []
        for i, (speed_mps, gap_m, aside_m, faster_mps) in enumerate(PAIRS):
            rows += [car(t_s * (speed_mps + faster_mps), 30 * i)]
            rows += [car(t_s * speed_mps + 3.75 + gap_m, 30 * i + aside_m, length_m=3.0)]
        lanes = np.rint(watch.see(*rows).centre_m[:, 1] / 30)
        counts.append([np.count_nonzero(lanes == i) for i in range(len(PAIRS))])
    return np.argmax(np.array(counts[10:]) < 2, axis=0).tolist()


# Which scene notices which number.
NOTICED_IN: dict[Callable[[TrackingSettings], object], Sequence[str]] = {
    car_that_brakes_and_swerves: ("acceleration_along_mps2", "acceleration_across_mps2"),
    truck_of_which_the_rear_is_smeared: ("grip_mps2",),
    jumping_lights: ("max_speed_mps",),
    cars_too_fast_for_the_limit: ("fast_share",),
    creeping_cars: ("heading_speed_mps",),
    cars_that_back: ("sure_sigmas", "sure_mps"),
    car_drawn_aside: ("turn_radius_m",),
    sightings_beside_the_course: ("gate_sigmas",),
    car_that_turns: ("claimed_us",),
    bus_at_the_view_edge: ("clipped_noise_m",),
    cars_in_one_blob: ("divided_noise",),
    oncoming_while_unseen: ("reverse_speed_mps",),
    sightings_that_come_back: ("slack_sigmas",),
    cars_that_entered_as_one: ("owner_gates",),
    hidden_ends: ("fit_tolerance_m",),
    wild_sightings: ("noise_rate", "most_noise"),
    things_of_all_sizes: ("min_length_m", "max_length_m", "max_width_m"),
    inexact_newcomer: ("new_along_mps",),
    fast_newcomers: ("new_across_mps", "clear_elongation"),
    cars_followed_wrongly: ("flow_sigmas",),
    newcomers: ("confirm_hits", "long_seen_us", "long_seen_share"),
    standing_things: ("confirm_shift_m",),
    standing_car: ("standing_us",),
    flickering: ("tentative_us",),
    hidden_cars: ("coast_us", "hidden_us", "driving_mps"),
    hidden_soon: ("sized_us", "most_step_us"),
    stopping_things: ("rest_radius_m",),
    things_that_creep_aside: ("sideways_mps", "sideways_share"),
    car_seen_aside: ("sideways_mps",),
    measured_lengths: ("size_memory_us", "size_step_m"),
    lengths_that_were_wrong: ("size_misfit_m", "size_misfit_us", "size_outlier"),
    fragments: ("double_depth_m", "double_us"),
    turns: ("twin_us", "twin_seen_us"),
    pairs: (
        *("coupled_us", "couple_gap_s", "couple_gap_m", "couple_across_m", "couple_change_mps", "couple_speed_mps"),
    ),
}


def test_every_number_has_a_scene() -> None:
    assert without_scene(TrackingSettings(), NOTICED_IN.values()) == []


@pytest.mark.slow
def test_twice_or_half_of_any_number_is_noticed() -> None:
    assert unnoticed(TrackingSettings(), NOTICED_IN, small=5) == []
