"""Which vision objects of several sensors are one thing? Those that are seen in one place, at one speed, for a while.

One of them, the first, leads: a world object is linked to it, as if there were one sensor. The others are joined to it.
They are no things of their own, and when the first is lost one of them leads.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from anchoring.hypotheses.hypotheses import Chain
from anchoring.linking.bodies import NOW, VX, VY, Bodies, X, Y, looks_of, state_of
from anchoring.linking.evidence import coincide
from anchoring.linking.linker import Evidence, choose
from anchoring.observations import LinkChange, Observations
from anchoring.settings import AnchoringSettings

_WORST_NATS = -15.0  # no frame counts for less: one wild row parts nothing


class _Weighed(NamedTuple):
    """Say how likely it is that two are one: since when it is weighed, until when, and the mean lately."""

    first_us: int
    last_us: int
    nats: float


class Sensors:
    """Keep which vision objects are joined to which chain.

    Parameters
    ----------
    settings : spreads; how long two are looked at (``settled_us``); how clear it must be (``decided_nats``).
    """

    def __init__(self, settings: AnchoringSettings) -> None:
        self._settings = settings
        self._joined: dict[str, Chain] = {}  # by the vision object, oldest first
        self._weighed: dict[tuple[str, str], _Weighed] = {}  # of who leads, or may lead, and of the other

    def lead(self, seen: Observations, bodies: Bodies, columns: dict[str, int]) -> Iterator[LinkChange]:
        """Part what is gone, and let what is joined lead where the first is lost.

        Parameters
        ----------
        seen, bodies : of this frame, and before it.
        columns : of every vision object that is followed; those that lead from now on take the places of the lost.
        """
        rows, column_of = _rows(seen), {chain: column for column, chain in enumerate(bodies.chains)}
        for name, chain in list(self._joined.items()):
            column = column_of.get(chain)
            if name not in rows or column is None:
                yield self._part(seen.t_us, name, "the vision object is gone" if column is not None else "it has ended")
            elif chain.vision_id not in rows:
                elapsed_s = (seen.t_us - bodies.states_us[NOW, column]) * 1e-6
                expected_m = bodies.states[NOW, X : Y + 1, column] + bodies.states[NOW, VX : VY + 1, column] * elapsed_s
                is_there = np.hypot(*(seen.centre_m[rows[name]] - expected_m)) <= self._settings.jump_m
                yield self._part(seen.t_us, name, "it leads" if is_there else "it is not where the other was")
                if is_there:
                    if chain.vision_id:
                        del columns[chain.vision_id]
                        yield chain.lose(seen.t_us, "the vision object is gone")
                    columns[name] = column
                    bodies.linked_us[column] = seen.t_us
                    chain.weighing = None
                    yield chain.adopt(seen.t_us, name, "it was joined, and is still seen")

    def join(
        self, seen: Observations, bodies: Bodies, columns: dict[str, int]
    ) -> tuple[list[tuple[str, Chain]], list[LinkChange], set[str]]:
        """Weigh what is seen together; parameters as of `lead`.

        Returns
        -------
        Which vision objects belong to which chains from now on, which no longer do, and which are no things of their
        own or wait for the decision.
        """
        self._weigh(seen, columns)
        parted = [
            self._part(seen.t_us, name, "it is seen elsewhere")
            for name, chain in list(self._joined.items())
            if not self._is_one(chain.vision_id, name)
        ]
        rows, settings = _rows(seen), self._settings
        taken = {(chain, seen.sensors[rows[name]]) for name, chain in self._joined.items()}
        pairs = [pair for pair in self._weighed if pair[1] not in self._joined and self._is_one(*pair)]
        chain_of = {head: bodies.chains[columns[head]] for head, _ in pairs if head in columns}
        free = [pair for pair in pairs if (chain_of.get(pair[0]), seen.sensors[rows[pair[1]]]) not in taken]
        names, heads = (np.unique([pair[side] for pair in free], return_inverse=True)[1] for side in (1, 0))
        best, _ = choose(Evidence(names, heads, np.array([self._weighed[pair].nats for pair in free])))
        chosen = [free[place] for place in best.tolist()]
        is_old = {pair: seen.t_us - self._weighed[pair].first_us >= settings.settled_us for pair in free}
        old = [(name, chain_of[head]) for head, name in chosen if is_old[head, name] and head in chain_of]
        found = [(name, chain) for name, chain in old if chain.world.upper]
        waiting = {name for head, name in free if not is_old[head, name] or (head, name) in chosen}
        own = {name for name in waiting if name in columns and bodies.is_established[columns[name]]}
        self._joined.update(found)
        return found, parted, (waiting - own) | self._joined.keys()

    def _part(self, t_us: int, name: str, reason: str) -> LinkChange:
        chain = self._joined.pop(name)
        return chain.change(t_us, "parted", chain.world, reason)._replace(lower=name)

    def _is_one(self, head: str, name: str) -> bool:
        found = self._weighed.get((head, name))
        return found is not None and found.nats >= self._settings.decided_nats

    def _weigh(self, seen: Observations, columns: dict[str, int]) -> None:
        """Take what this frame says of all pairs that are near each other; the second of each is the younger one."""
        rows = np.array([*_rows(seen).values()], np.int64)
        near = rows[KDTree(seen.centre_m[rows]).query_pairs(self._settings.edge_m / 2, output_type="ndarray")]
        rank = [(name in self._joined, columns.get(name, np.inf), row) for row, name in enumerate(seen.ids)]
        pairs = [sorted(pair, key=rank.__getitem__) for pair in near.tolist()]
        pairs = [pair for pair in pairs if seen.sensors[pair[0]] != seen.sensors[pair[1]]]
        before, self._weighed = self._weighed, {}
        if not pairs:
            return
        first, second = np.array(pairs).T
        size_m, nowhere = np.stack([seen.length_m, seen.width_m]), np.full(len(rank), -1, np.int32)
        times_us, has_front = np.full(len(rank), seen.t_us), np.ones(len(rank), np.bool_)
        looks = looks_of(times_us, state_of(seen), nowhere, size_m, is_whole=~seen.clipped, has_front=has_front)
        nats = np.maximum(coincide(looks.take(second), looks.take(first), self._settings), _WORST_NATS)
        for head, name, now_nats in zip(first.tolist(), second.tolist(), nats.tolist(), strict=True):
            key = seen.ids[head], seen.ids[name]
            old = before.get(key, _Weighed(seen.t_us, seen.t_us, now_nats))
            past_us = min(old.last_us - old.first_us, self._settings.settled_us)
            step_us = seen.t_us - old.last_us
            share = step_us / max(past_us + 2 * step_us, 1)
            self._weighed[key] = _Weighed(old.first_us, seen.t_us, old.nats + (now_nats - old.nats) * share)


def _rows(seen: Observations) -> dict[str, int]:
    return {name: row for row, name in enumerate(seen.ids) if seen.observed[row]}
