"""Every number of anchoring matters: twice or half of it links some car of a small scene in another way."""

import math
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from anchoring.adapter import AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.hypotheses.trials import Trials
from anchoring.linking.evidence import NewCars, weigh
from anchoring.linking.ways import Looks
from anchoring.observations import BoolArray, FloatArray, LinkChange, LongArray
from anchoring.settings import AnchoringSettings
from dyknow.sample import Sample
from tests.anchoring.support import Seen, observations, straight_road
from tests.turned import unnoticed, without_scene
from vision.objects import VisionObjects

FRAME_US, FRAMES, SCENES, TOLD_SCENES = 80_000, 56, 14, 4

Frame = dict[str, Seen]
Told = tuple[int, ...]


def driver(rng: np.random.Generator, **fixed: float) -> Callable[[int], Seen]:
    """Let a car drive east at constant speed; its state of a frame can be changed with `replace`."""
    row = {"x_m": 0.0, "y_m": -1.75, "speed_mps": rng.uniform(6, 20), "length_m": rng.uniform(3.8, 5), "width_m": 1.8}
    row |= fixed
    x_m = row.pop("x_m")
    return lambda frame: Seen(x_m=x_m + row["speed_mps"] * frame * FRAME_US * 1e-6, heading_rad=0.0, **row)


def troubled(car: Seen, kind: str, size: float) -> Seen:
    """Change what is seen of a car, by an amount drawn at random."""
    if kind == "off":
        return replace(car, y_m=car.y_m - 1.4 * size)
    if kind == "jump":
        return replace(car, x_m=car.x_m + 4.5 * size)
    if kind == "turn":
        return replace(car, heading_rad=1.8 * size)
    if kind == "rush":
        return replace(car, speed_mps=car.speed_mps + 10 * size)
    if kind == "grow":
        return replace(car, length_m=car.length_m * (1 + 1.2 * size), width_m=car.width_m * (0.8 + 0.2 * size))
    return replace(car, length_m=car.length_m * 5 * size**2, width_m=car.width_m * 2.2 * size**2)


def alone(rng: np.random.Generator) -> list[Frame]:
    """Show one car, of which something impossible is seen for a while."""
    size, start, rest = float(rng.lognormal(0, 0.7)), int(rng.integers(1, 25)), int(rng.integers(1, 36))
    kind = str(rng.choice(["off", "jump", "turn", "rush", "grow", "odd"]))
    car = driver(rng, speed_mps=float(rng.choice([rng.uniform(0.5, 6), rng.uniform(6, 20)])))
    seen = [car(frame) for frame in range(FRAMES)]
    return [{"v": troubled(one, kind, size) if start <= k < start + rest else one} for k, one in enumerate(seen)]


def sized(rng: np.random.Generator) -> list[Frame]:
    """Show a vehicle of any size, whose size is seen with much noise."""
    size_m = {
        "length_m": float(rng.choice([0.7, 1.6, 6, 14, 18, 22, 30])),
        "width_m": float(rng.choice([0.3, 0.9, 2.5, 4])),
    }
    car = driver(rng, **size_m)
    noise = rng.normal(1, 0.12, FRAMES)
    return [{"v": replace(car(k), length_m=car(k).length_m * noise[k])} for k in range(FRAMES)]


def found(rng: np.random.Generator) -> list[Frame]:
    """Lose a car for a while; something that may be it is seen again."""
    pause, early = int(rng.integers(1, 36)), int(rng.integers(0, 6)) * int(rng.integers(0, 2))
    slow = bool(rng.integers(0, 2))
    car = driver(rng, speed_mps=rng.uniform(0.5, 2.9)) if slow else driver(rng)
    off = rng.normal(0, 1, 5) * float(rng.uniform(0.2, 1.5)) * (rng.random(5) < 0.45)
    frames: list[Frame] = []
    for k in range(FRAMES):
        frame: Frame = {"v": car(k)} if k < 12 else {}
        if k >= 12 + pause - early:
            now = car(k)
            frame["w"] = replace(
                now,
                x_m=now.x_m + 5 * off[0],
                y_m=now.y_m + 2.6 * off[1],
                heading_rad=0.7 * off[2],
                speed_mps=abs(now.speed_mps + 5 * off[3]),
                length_m=max(1.5, now.length_m + 2.2 * off[4]),
            )
        frames.append(frame)
    return frames


def leaving(rng: np.random.Generator) -> list[Frame]:
    """Let a car be clipped by the edge of the view, and go."""
    car, last = driver(rng, speed_mps=float(rng.choice([0.7, 1.5, 9.0]))), int(rng.integers(20, 30))
    return [{"v": replace(car(k), clipped=k > last - 3)} if k < last else {} for k in range(FRAMES)]


def guessed(rng: np.random.Generator) -> list[Frame]:
    """Let the tracker only guess where a car is; then it is seen further on."""
    car, pause, off_m = driver(rng), int(rng.integers(6, 22)), rng.uniform(3, 14)
    frames: list[Frame] = []
    for k in range(FRAMES):
        shift_m = off_m if k >= 15 + pause else 0.0
        frames.append({"v": replace(car(k), x_m=car(k).x_m + shift_m, observed=not 15 <= k < 15 + pause)})
    return frames


def exchanged(rng: np.random.Generator) -> list[Frame]:
    """Let two cars side by side exchange their tracks, or one take over that of a car that is lost."""
    start, wide_m, ahead_m = int(rng.integers(6, 30)), rng.uniform(1.2, 4.5), rng.uniform(-4, 4)
    a, speed_mps, is_lost = driver(rng, y_m=-1.0), rng.uniform(6, 20), bool(rng.integers(0, 2))
    late, faster_mps, longer_m = int(rng.integers(0, 18)), rng.uniform(0, 8), rng.uniform(-1, 1.4)
    a = driver(rng, y_m=-1.0, speed_mps=speed_mps)
    meet_m = (start + late) * FRAME_US * 1e-6 * faster_mps
    b = driver(rng, y_m=-1.0 - wide_m, x_m=ahead_m + meet_m, speed_mps=speed_mps - faster_mps, length_m=4.5 + longer_m)
    frames: list[Frame] = []
    for k in range(FRAMES):
        if k < start:
            frames.append({"v": a(k), "w": b(k)})
        elif is_lost:
            frames.append({"v": a(k)} if k < start + late else {"v": b(k)})
        else:
            frames.append({"v": a(k), "w": b(k)} if k < start + late else {"v": b(k), "w": a(k)})
    return frames


def two_found(rng: np.random.Generator) -> list[Frame]:
    """Lose two cars; one or both are seen again, perhaps between the two, perhaps in another order."""
    pause, apart_m, aside_m = int(rng.integers(2, 14)), rng.uniform(0.5, 6), rng.uniform(0, 5)
    a, b = driver(rng, speed_mps=8.0), driver(rng, speed_mps=8.0, x_m=apart_m, y_m=-1.75 - aside_m)
    share = rng.uniform(0.2, 0.8) if rng.random() < 0.6 else 1.2
    frames: list[Frame] = []
    for k in range(FRAMES):
        if k < 12:
            frames.append({"v": a(k), "w": b(k)})
        elif k < 12 + pause:
            frames.append({})
        else:
            between = replace(a(k), x_m=a(k).x_m + share * apart_m, y_m=a(k).y_m - share * aside_m)
            behind = replace(b(k), x_m=b(k).x_m - share * apart_m, y_m=b(k).y_m + share * aside_m)
            frames.append({"x": between} if share < 1 else {"x": between, "y": behind})
    return frames


def inside(rng: np.random.Generator) -> list[Frame]:
    """Lose one or two cars between others that are seen all the time; what is found comes later than it, or earlier."""
    pause, gap_m, second = int(rng.integers(4, 24)), rng.uniform(5, 14), int(rng.integers(0, 6))
    speed_mps, off_m = rng.uniform(4, 14), rng.normal(0, 4, 2)
    a, b, front, rear = (driver(rng, speed_mps=speed_mps, x_m=x_m) for x_m in (gap_m, 0.0, 150.0, -80.0))
    frames: list[Frame] = []
    for k in range(FRAMES):
        frame: Frame = {"front": front(k), "rear": rear(k)}
        if k < 12:
            frame |= {"v": a(k), "w": b(k)}
        if k >= 12 + pause:
            frame["x"] = replace(b(k), x_m=b(k).x_m + off_m[0])
        if k >= 12 + pause + second:
            frame["y"] = replace(b(k), x_m=b(k).x_m - gap_m / 2 + off_m[1])
        frames.append(frame)
    return frames


SCENE_KINDS = (alone, sized, found, leaving, guessed, exchanged, two_found, inside)
FRAMES_OF = {kind.__name__: [kind(np.random.default_rng(seed)) for seed in range(SCENES)] for kind in SCENE_KINDS}


def told(settings: AnchoringSettings, frames: Sequence[Frame | None], *, has_road: bool) -> Told:
    """Sum up what anchoring says of a scene: changes, cars, sizes and trials, in whole numbers; None is no frame."""
    sums = np.zeros(8, dtype=np.int64)
    anchorer = Anchorer(straight_road() if has_road else None, settings)
    for number, seen in enumerate(frames):
        if seen is None:
            continue
        cars, changes = anchorer.observe(observations(number * FRAME_US, seen))
        trials = anchorer.trials
        kinds = sum(len(change.kind) for change in changes)
        classes = sum(map(len, cars.classes))
        length_dm = math.floor(10 * cars.length_m.sum() + 0.05)
        side_dm = math.floor(10 * np.abs(cars.centre_m[:, 1]).sum() + 0.05)
        sums += (
            len(cars.ids),
            int(cars.linked.sum()),
            kinds,
            number * len(changes),
            classes,
            length_dm,
            side_dm,
            (number * (len(trials.validated) + 7 * len(trials.refuted) + 13 * len(trials.undecided))),
        )
    return tuple(sums.tolist())


def told_of_drawn(settings: AnchoringSettings, kind: str, seed: int) -> Told:
    """Sum up one of the scenes that are drawn at random; every other one is in free space."""
    return told(settings, FRAMES_OF[kind][seed], has_road=seed % 2 == 1)


# What is told of the first scenes of each kind with the usual numbers.
TOLD = {
    "alone": (222, 185, 228, 298, 666, 9699, 6001, 1027),
    "sized": (202, 202, 110, 52, 1190, 40589, 3434, 302),
    "found": (142, 94, 198, 328, 426, 5784, 2477, 228),
    "leaving": (81, 73, 176, 394, 243, 3424, 1377, 243),
    "guessed": (204, 161, 170, 199, 612, 8721, 3468, 704),
    "exchanged": (325, 287, 326, 583, 975, 14969, 6310, 640),
    "two_found": (254, 182, 320, 448, 762, 11114, 6635, 570),
    "inside": (616, 520, 548, 612, 1848, 27507, 10738, 1132),
}
# A drawn scene that notices the number, by its kind and seed.
NOTICED_IN = {
    "establish_us": ("alone", 0),
    "contested_us": ("two_found", 0),
    "predict_us": ("alone", 0),
    "edge_loss_us": ("leaving", 0),
    "off_road_us": ("exchanged", 5),
    "road_tolerance_m": ("exchanged", 5),
    "jump_m": ("alone", 0),
    "jump_growth_mps2": ("guessed", 13),
    "swap_us": ("alone", 2),
    "swap_m": ("exchanged", 2),
    "slip_us": ("exchanged", 5),
    "turn_rad": ("alone", 2),
    "acceleration_mps2": ("alone", 7),
    "speed_slack_mps": ("alone", 7),
    "size_ratio": ("alone", 4),
    "snapshot_us": ("alone", 2),
    "oldest_us": ("alone", 2),
    "settled_us": ("alone", 2),
    "size_samples": ("alone", 4),
    "eager_samples": ("alone", 6),
    "size_period_us": ("sized", 0),
    "class_sigmas": ("sized", 0),
    "least_length_m": ("sized", 11),
    "most_length_m": ("sized", 2),
    "least_width_m": ("sized", 3),
    "most_width_m": ("sized", 0),
    "edge_births_per_m": ("found", 13),
    "births_per_m": ("inside", 3),
    "margin_nats": ("found", 2),
    "open_us": ("inside", 6),
    "leaving_mps": ("leaving", 1),
    "trial_us": ("alone", 0),
}


def east(frame: int, **changed: float) -> Seen:
    """Show a car that keeps to its lane at 10 m/s (or what else is said), `x_m` further on."""
    row = {"x_m": 0.0, "y_m": -1.75, "speed_mps": 10.0, **changed}
    return Seen(**row | {"x_m": row["x_m"] + row["speed_mps"] * frame * FRAME_US * 1e-6})  # type: ignore[arg-type]


def hidden(after: Callable[[int], Seen], *, until: int = 24, before: Callable[[int], Seen] = east) -> list[Frame]:
    """Hide a car from frame 12 until a later one; then something like it is seen."""
    return [{"v": before(k)} if k < 12 else {} if k < until else {"w": after(k)} for k in range(until + 20)]


def changes_lane(frame: int) -> Seen:
    """Show a car that begins to drive 2 m/s to the left."""
    aside_s = max(frame - 5, 0) * FRAME_US * 1e-6
    return east(frame, y_m=-1.75 + 2 * aside_s, heading_rad=math.atan2(2, 10) * (aside_s > 0))


def stands(_: int) -> Seen:
    """Show a car that stands in its lane."""
    return Seen(0.0, -1.75, 0.0)


def turns_back(frame: int) -> Seen:
    """Show something that turns round on the spot at 4 m/s, as no vehicle can."""
    x_m = 4.0 * FRAME_US * 1e-6 * min(frame, 40 - frame)
    return Seen(x_m, y_m=-1.75, speed_mps=4.0, heading_rad=0.0 if frame < 20 else math.pi)


# A scene for the reason that a number is there for: the car of each is linked, or not, by that number alone.
CLAIMED: dict[str, Sequence[Frame | None]] = {
    "odd_size_us": [{"v": east(k, length_m=30.0 if 12 <= k < 32 else 18.0)} for k in range(FRAMES)],
    "turn_mps": [{"v": turns_back(k)} for k in range(40)],
    "survive_us": [
        one if k < 24 or k % 8 == 0 or k >= 262 else None
        for k, one in enumerate(hidden(stands, until=262, before=stands))
    ],
    "outline_slack_m": found(np.random.default_rng(96)),
    "lateral_s": hidden(lambda k: east(k, y_m=1.9), before=changes_lane),
}


def given_after_a_lost_view(settings: AnchoringSettings) -> Told:
    """Count the cars of each frame of a view that is lost for two frames."""
    unit, counts = AnchoringUnit(Anchorer(None, settings)), list[int]()
    for number in range(40):
        t_us, is_lost = number * FRAME_US, number in (12, 13)
        seen = observations(t_us, {} if is_lost else {"v": east(number)})
        arrays = (seen.centre_m, seen.velocity_mps, seen.heading_rad, seen.length_m, seen.width_m)
        now = VisionObjects(t_us, seen.ids, *arrays, seen.observed, seen.clipped)
        (sample,) = unit.update(Sample(t_us, t_us, VisionObjects.lost(t_us) if is_lost else now))
        counts.append(len(sample.value.cars.ids))
    return tuple(counts)


def given_back(settings: AnchoringSettings) -> Told:
    """List the rows that a car gets from before it came to the road, where it had been driving beside it for 4 s."""
    unit, times_us = AnchoringUnit(Anchorer(straight_road(), replace(settings, jump_m=20.0))), list[int]()
    for number in range(70):
        seen = observations(number * FRAME_US, {"v": east(number, y_m=-1.75 if number >= 60 else -9.0)})
        arrays = (seen.centre_m, seen.velocity_mps, seen.heading_rad, seen.length_m, seen.width_m)
        now = VisionObjects(seen.t_us, seen.ids, *arrays, seen.observed, seen.clipped)
        (sample,) = unit.update(Sample(seen.t_us, seen.t_us, now))
        times_us += [then.t_us for then in sample.value.former]
    return tuple(times_us)


def returned(settings: AnchoringSettings) -> Told:
    """Let a name that is trusted come back after 4 s, 200 m further on: 50 m/s, as a motorcycle may."""
    anchorer = Anchorer(straight_road(), settings, trusts_ids=True)
    frames = [{"v": east(k, x_m=160.0 if k >= 62 else 0.0)} if k < 12 or k >= 62 else {} for k in range(70)]
    for number, seen in enumerate(frames):
        cars, _ = anchorer.observe(observations(number * FRAME_US, seen))
    return (len(cars.ids), *anchorer.refused.values())


def moved(settings: AnchoringSettings) -> Told:
    """Count the frames until two cars that creep have moved: one whose place is well known, and one whose is not."""
    anchorer, standing = Anchorer(straight_road(), settings), [0, 0]
    for number in range(60):
        x_m = 3.0 * number * FRAME_US * 1e-6
        seen = observations(number * FRAME_US, {"v": Seen(x_m, -1.75, 3.0), "w": Seen(x_m + 40.0, -1.75, 3.0)})
        cars, _ = anchorer.observe(replace(seen, sigma_m=np.array([0.1, 1.0])))
        for row, has_moved in enumerate(cars.has_moved.tolist()):
            standing[row] += not has_moved
    return tuple(standing)


def jumped(settings: AnchoringSettings) -> Told:
    """Tell after how many frames a car is refuted that jumps ever farther, at a place known ever less well."""
    anchorer, told = Anchorer(straight_road(), settings), list[int]()
    for number in range(60):
        car = Seen(10.0 * number * FRAME_US * 1e-6 + (number % 5 == 4) * (number / 4), -1.75, 10.0)
        _, changes = anchorer.observe(
            replace(observations(number * FRAME_US, {"v": car}), sigma_m=np.array([number / 20]))
        )
        told += [number for change in changes if change.kind == "refuted"]
    return tuple(told)


def sure(settings: AnchoringSettings) -> Told:
    """Tell in thousandths how sure a car is that is missed in each third frame after some, at a badly known place."""
    anchorer, told = Anchorer(straight_road(), settings), list[int]()
    for number in range(40):
        car = Seen(10.0 * number * FRAME_US * 1e-6, -1.75, 10.0, observed=number < 15 or number % 3 > 0)
        cars, _ = anchorer.observe(replace(observations(number * FRAME_US, {"v": car}), sigma_m=np.array([1.0])))
        told += np.rint(1000 * cars.confidence).astype(int).tolist()
    return tuple(told)


def believed(settings: AnchoringSettings) -> Told:
    """List the margins, in tenths of a nat, of links by evidence that are validated."""
    trials = Trials(settings)
    for tenths in range(16, 80, 8):
        link = LinkChange(0, "reestablished", "world", "v", f"w{tenths}", "", margin_nats=tenths / 10)
        trials.judge(0, [link], {})
    trials.judge(settings.open_us, [], {})
    return tuple(int(label.removeprefix("v->w").partition("#")[0]) for label in trials.validated)


def drawn_pairs() -> tuple[Looks, Looks]:
    """Draw starts and ends of tracks that lie in rows of a few cars, on two roads and between them."""
    rng = np.random.default_rng(0)

    def drawn(count: int, after_s: float) -> Looks:
        place_m = np.stack([rng.uniform(0, 60, count), rng.choice([0.0, 1.5, 4.0], count)])
        heading_rad = rng.choice([0.0, 0.4, math.pi / 2, 2.4, math.pi], count, p=[0.7, 0.1, 0.1, 0.05, 0.05])
        speed_mps = rng.choice([0.0, 2.0, 9.0, 15.0, 22.0], count)
        return Looks(
            t_us=((after_s + rng.uniform(0, 6, count)) * 1e6).astype(np.int64),
            centre_m=place_m.T,
            velocity_mps=(speed_mps * np.stack([np.cos(heading_rad), np.sin(heading_rad)])).T,
            heading_rad=heading_rad,
            has_front=np.ones(count, np.bool_),
            length_m=rng.choice([4.2, 4.5, 5.0, 9.0], count),
            width_m=rng.choice([1.7, 1.8, 2.1, 2.5], count),
            is_whole=rng.random(count) < 0.8,
            road=rng.choice([-1, 0, 0, 0, 1], count).astype(np.int32),
            along_m=place_m[0],
            across_m=place_m[1],
            tangent_rad=np.zeros(count),
        )

    return drawn(160, 2.0), drawn(40, 0.0)


def linked_by_evidence(settings: AnchoringSettings) -> Told:
    """List which of many starts and ends belong together by the odds, each pair for itself."""
    starts, ends = drawn_pairs()
    new = NewCars(np.full(len(starts.t_us), 0.0005), np.array([4.5, 1.8]), np.array([0.8, 0.3]))

    def routes(row: LongArray, column: LongArray) -> tuple[FloatArray, BoolArray]:
        """Let half of the ways lead along lanes, and half of these need a change."""
        apart_m = starts.centre_m[row] - ends.centre_m[column]
        return np.where(row % 2 == 0, np.hypot(*apart_m.T) + 2.0, np.nan), row % 4 == 0

    evidence = weigh(starts, ends, new, routes, settings)
    likely = evidence.ratios > 0.0
    return tuple((evidence.starts[likely] * 1000 + evidence.ends[likely]).tolist())


WEIGHED = {
    *("way_m", "pace_mps", "calm_mps", "lively_mps", "side_m", "side_mps", "side_share", "side_limit_m", "edge_m"),
    *("turn_slack_rad", "sideways_mps2", "back_rad", "stop_share", "junction_stop_share", "change_share"),
    *("haste_mps", "haste_share", "backwards_m", "overlap_us", "same_lane_m", "pass_nats"),
    *("same_length_m", "same_width_m", "odd_share", "other_share"),
}


@cache
def drawn(kind: str, seed: int) -> Callable[[AnchoringSettings], Told]:
    return lambda settings: told_of_drawn(settings, kind, seed)


def outcome(name: str) -> Callable[[AnchoringSettings], Told]:
    """Choose what is told to show what a number does."""
    special = {"settle_us": given_after_a_lost_view, "name_back_us": given_back, "return_mps": returned}
    special |= {"jump_sigmas": jumped, "decided_nats": believed, "moved_lengths": moved, "moved_sigmas": moved}
    special |= dict.fromkeys(("grown_us", "recent_us", "coarse_lengths"), sure)
    if name in special:
        return special[name]
    if name in WEIGHED:
        return linked_by_evidence
    if name in CLAIMED:
        return lambda settings: told(settings, CLAIMED[name], has_road=True)
    return drawn(*NOTICED_IN[name])


@pytest.mark.long
def test_scenes_are_told_as_they_are_with_the_usual_numbers() -> None:
    usual = AnchoringSettings()
    sums = {
        kind: tuple(np.sum([told_of_drawn(usual, kind, seed) for seed in range(TOLD_SCENES)], axis=0).tolist())
        for kind in FRAMES_OF
    }
    assert sums == TOLD


def scenes() -> dict[Callable[[AnchoringSettings], Told], list[str]]:
    """Give each number to the scene that notices it."""
    found: dict[Callable[[AnchoringSettings], Told], list[str]] = {}
    for one in fields(AnchoringSettings):
        found.setdefault(outcome(one.name), []).append(one.name)
    return found


def test_every_number_has_a_scene() -> None:
    assert without_scene(AnchoringSettings(), scenes().values()) == []


@pytest.mark.slow
def test_twice_or_half_of_every_number_is_noticed() -> None:
    assert unnoticed(AnchoringSettings(), scenes()) == []
