"""What was told of traffic in which cars are not seen, or taken for others, and what of it stands in the end."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dyknow.streams.hypotheses import Hypotheses
from qsr.adapter import FrameRelations
from qsr.changes.crossings import RelationChange, Value
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.relations import RANK
from tests.qsr.support import footprints, random_traffic

# Of a hidden time nobody knows who else was in between, or whether two cars nearly met.
NAMES = sorted(RANK.keys() - {"following", "short_headway", "conflict"})

Told = tuple[str, tuple[str, ...], int, Value, Value]


@dataclass
class Story:
    """Keep what was told, with the labels of all that it rests on, and drop what rests on something refuted."""

    told: list[tuple[RelationChange, frozenset[str]]] = field(default_factory=list)

    def take(
        self, changes: Sequence[RelationChange], refuted: Collection[str], doubtful: Mapping[str, str] | None = None
    ) -> None:
        """Take a frame; ``doubtful`` has the labels of what is told of some cars, "NAME lost" is that of an absence."""
        self.told = [(change, labels) for change, labels in self.told if labels.isdisjoint(refuted)]
        for change in changes:
            about = {one: (label,) for one, label in (doubtful or {}).items()}
            known = Hypotheses(about, absences={one: f"{one} lost" for one in change.absent})
            self.told.append((change, frozenset(FrameRelations((), known).hypotheses_of(change))))

    def standing(self) -> set[Told]:
        return facts([change for change, _ in self.told])


def facts(changes: Sequence[RelationChange]) -> set[Told]:
    return {(one.name, one.args, one.t_us, one.old, one.new) for one in changes if one.name in NAMES}


def road_observer() -> RelationObserver:
    return RelationObserver(("r0", "r1"), ("j0",), lanes=[(f"l{k}", 1 if k % 2 else -1) for k in range(4)])


def seen_traffic(rng: np.random.Generator) -> tuple[list[Footprints], set[Told]]:
    """Drive cars that are seen all the time; give the frames, and what is told of them."""
    frames = [
        frame.having(observed=np.ones(len(frame.ids), np.bool_))
        for frame in random_traffic(rng, frames=60, count=12, noise_m=0.1)
    ]
    told = road_observer()
    return frames, facts([change for frame in frames for change in told.observe(frame)])


def without(broken: set[frozenset[str]], told: set[Told]) -> set[Told]:
    """Leave out pairs of which one left while the other was hidden: nobody can tell what happened last."""
    return {one for one in told if frozenset(one[1]) not in broken}


def two_cars(number: int, x_m: tuple[float, float], names: str = "ab") -> Footprints:
    """Drive a and b east on one road, 4 m long each and 3 m apart sideways."""
    xy_m = [[x_m[0], 3.0], [x_m[1], 0.0]]
    rows = ["ab".index(name) for name in names]
    return footprints(number * 100_000, names, [xy_m[row] for row in rows], straight_road=True)
