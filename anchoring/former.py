"""Where was a car before it had its name? In the rows of its vision object until then.

A vision object is watched for a while before it counts as a car, or is taken for a lost one. What was seen of it
meanwhile is known to be of that car once it is linked, and is told then: as cars of earlier times. Nothing that was
told before changes; what follows from such a row is dated back to it.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from anchoring.linking.fluents import jump_limit_m
from anchoring.observations import Cars, FloatArray, LinkChange, Observations
from anchoring.settings import AnchoringSettings
from gis.roads.road_network import RoadPositions


class FormerRows:
    """Remember what was seen lately, and tell it of a car when it gets a vision object that had none.

    Parameters
    ----------
    settings : how far names are dated back, and what is a jump: rows from before one are of another thing.
    locate : finds where points, (k, 2), are on the roads.
    """

    def __init__(self, settings: AnchoringSettings, locate: Callable[[FloatArray], RoadPositions]) -> None:
        self._settings = settings
        self._locate = locate
        self._frames: deque[Observations] = deque()
        self._told_us: dict[str, int] = {}  # of cars: when each was given out last
        self._unnamed_us: dict[str, int | None] = {}  # of vision objects: since when; None for one that has a car

    def forget(self) -> None:
        """Forget what was seen: the camera did not know where it looked."""
        self._frames.clear()

    def take(self, seen: Observations, cars: Cars, changes: Iterable[LinkChange]) -> tuple[Cars, ...]:
        """Take a frame; return the cars of earlier ones that got their names in it, oldest first.

        Parameters
        ----------
        seen, cars, changes : of the frame: what went into anchoring and what came out.
        """
        t_us, back_us = seen.t_us, seen.t_us - self._settings.name_back_us
        while self._frames and self._frames[0].t_us < back_us:
            self._frames.popleft()
        refuted = {change.lower for change in changes if change.kind == "refuted" and change.level == "world"}
        before = self._unnamed_us
        self._unnamed_us = {one: t_us if one in refuted else before.get(one, t_us) for one in seen.ids}
        # From when on a vision object that has a name now had none and its car no row.
        since_us = {
            k: max(unnamed_us, self._told_us.get(cars.ids[k], -1) + 1)
            for k in cars.linked.nonzero()[0].tolist()
            if (unnamed_us := self._unnamed_us[cars.vision_ids[k]]) is not None
        }
        former = tuple(self._former(cars, since_us)) if since_us else ()
        self._unnamed_us |= dict.fromkeys([cars.vision_ids[k] for k in since_us])
        self._told_us = {car: at_us for car, at_us in self._told_us.items() if at_us >= back_us}
        self._told_us |= dict.fromkeys(cars.ids, t_us)
        self._frames.append(seen)
        return former

    def _former(self, cars: Cars, since_us: dict[int, int]) -> Iterator[Cars]:
        row_of = [{name: row for row, name in enumerate(then.ids) if then.observed[row]} for then in self._frames]
        rows: list[dict[int, int]] = [{} for _ in self._frames]
        for k, first_us in since_us.items():
            after_us, after_m, sigma_m = cars.t_us, cars.centre_m[k], cars.sigma_m[k]
            for place in reversed(range(len(rows))):
                then, row = self._frames[place], row_of[place].get(cars.vision_ids[k])
                if row is None:
                    continue
                gap_s = (after_us - then.t_us) * 1e-6
                apart_m = math.dist(then.centre_m[row] + then.velocity_mps[row] * gap_s, after_m)
                if then.t_us < first_us or apart_m > jump_limit_m(sigma_m, gap_s, self._settings):
                    break
                rows[place][k] = row
                after_us, after_m, sigma_m = then.t_us, then.centre_m[row], then.sigma_m[row]
        for then, named in zip(self._frames, rows, strict=True):
            if named:
                seen = list(named.values())
                yield cars.earlier(
                    list(named),
                    then.t_us,
                    then.centre_m[seen],
                    then.velocity_mps[seen],
                    then.heading_rad[seen],
                    locate=self._locate,
                    linked=True,
                )
