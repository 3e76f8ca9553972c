"""Every number of anchoring matters: twice or half of it links some car of a small scene in another way."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from anchoring.adapter import LinkTrials
from anchoring.anchorer import Anchorer
from anchoring.settings import AnchoringSettings
from tests.anchoring.support import Seen, observations, straight_road

FRAME_US, FRAMES, SCENES = 80_000, 56, 14

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


SCENE_KINDS = (alone, sized, found, leaving, guessed, exchanged, two_found)
FRAMES_OF = {kind.__name__: [kind(np.random.default_rng(seed)) for seed in range(SCENES)] for kind in SCENE_KINDS}


def told(settings: AnchoringSettings, kind: str) -> Told:
    """Sum up what anchoring says of all scenes of a kind: changes, cars, sizes and trials, in whole numbers."""
    sums = np.zeros(8, dtype=np.int64)
    for seed, frames in enumerate(FRAMES_OF[kind]):
        anchorer, trials = Anchorer(straight_road() if seed % 2 else None, settings), LinkTrials(settings.trial_us)
        for number, seen in enumerate(frames):
            cars, changes = anchorer.observe(observations(number * FRAME_US, seen))
            validated, refuted = trials.judge(cars.t_us, changes)
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
                (number * (len(validated) + 7 * len(refuted))),
            )
    return tuple(sums.tolist())


# What is told with the usual numbers.
TOLD = {
    "alone": (720, 653, 586, 904, 2160, 31548, 15012, 2224),
    "sized": (559, 559, 352, 162, 3579, 103023, 9503, 962),
    "found": (543, 380, 623, 845, 1629, 22864, 10554, 996),
    "leaving": (320, 282, 601, 1408, 960, 14165, 5440, 934),
    "guessed": (678, 522, 589, 1146, 2034, 30217, 11526, 2138),
    "exchanged": (1097, 947, 1043, 1853, 3291, 49793, 25467, 2271),
    "two_found": (855, 595, 1231, 2906, 2565, 37501, 23397, 2305),
}
# Which scenes notice which number.
NOTICED_IN = {
    "alone": (
        *("establish_us", "reestablish_us", "predict_us", "survive_us", "jump_m", "swap_us", "turn_rad", "oldest_us"),
        *("acceleration_mps2", "speed_slack_mps", "size_ratio", "snapshot_us", "settled_us", "size_samples"),
        *("eager_samples", "along_m", "trial_us"),
    ),
    "sized": (*("size_period_us", "class_sigmas", "least_length_m", "most_length_m", "least_width_m", "most_width_m"),),
    "found": ("across_mps", "across_limit_m", "fit_heading_rad"),
    "leaving": ("edge_loss_us", "leaving_mps"),
    "guessed": ("jump_growth_mps2",),
    "exchanged": ("off_road_us", "road_tolerance_m", "swap_m", "swap_cost", "slip_us", "across_m"),
    "two_found": ("contested_us", "margin_cost"),
}


def test_scenes_are_told_as_they_are_with_the_usual_numbers() -> None:
    assert {kind: told(AnchoringSettings(), kind) for kind in FRAMES_OF} == TOLD


@pytest.mark.slow
def test_twice_or_half_of_a_number_is_noticed() -> None:
    usual, unnoticed = AnchoringSettings(), []
    for kind, names in NOTICED_IN.items():
        for name in names:
            value = getattr(usual, name)
            others = (replace(usual, **{name: type(value)(value * factor)}) for factor in (2, 0.5))
            if all(told(other, kind) == TOLD[kind] for other in others):
                unnoticed.append(name)
    assert unnoticed == []
