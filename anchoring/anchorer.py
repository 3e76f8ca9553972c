"""Which car is which, frame after frame, though trackers lose them and mix them up?

Each frame: match vision objects to the bodies that are followed, predict those that are not seen, evaluate the fluents,
let the conditions of all links progress, take over what was seen, and look for lost cars among the unlinked vision
objects. Work on arrays, except for the few bodies whose conditions wait for something.
"""

import math
from collections import Counter, deque
from dataclasses import dataclass

import numpy as np

from anchoring.errors import AnchoringError
from anchoring.hypotheses.conditions import Verdict
from anchoring.hypotheses.hypotheses import Chain, Linkage, Weighing
from anchoring.hypotheses.language import LinkageText, default_linkage
from anchoring.hypotheses.trials import Trials
from anchoring.linking.births import Outline
from anchoring.linking.bodies import END, HEADING, NOW, OLD, START, VX, VY, Bodies, X, Y, state_of
from anchoring.linking.classes import CLASS_NAMES
from anchoring.linking.fluents import Fluent, StateTable, measure
from anchoring.linking.frame import Frame, RoadMap
from anchoring.linking.hidden import fill
from anchoring.linking.returns import find_returns
from anchoring.linking.sensors import Sensors
from anchoring.observations import BoolArray, Cars, LinkChange, Observations
from anchoring.settings import AnchoringSettings
from gis.roads.road_network import RoadNetwork

# Where hidden cars were is told for frames at least so far apart: relations change more slowly.
_MOMENT_US = 200_000

_FITS = int(Fluent.FITS)

MOST_AWAY = 10_000  # names that may come back; each is about a kilobyte


@dataclass(frozen=True, slots=True)
class Away:
    """Keep what a vision object was linked to when it went, and when and where it was seen last."""

    chain: Chain
    seen_us: int
    centre_m: list[float]


class Anchorer:
    """Keep car symbols for the vision objects of one source.

    Parameters
    ----------
    network : the roads; None works in free space.
    settings : numbers.
    linkage : the levels with their conditions, and the norms of classes; None for those of ``default.linkage``. The
        first level must be "world", the last "car"; "on_road" is left out where there is no network.
    trusts_ids : whether the names of vision objects are somebody's word for what is the same: one that comes back is
        then the same car, however long it was away, unless the way was too far. Our own tracker never says so.

    Attributes
    ----------
    roads : where cars are on them.
    filled : of the last frame, where cars that are seen again were while they were not, oldest first.
    trials : of the links: what was judged in the last frame, and what is doubtful.
    refused : how often what the input says of a name was not believed, by cause: jumps of a vision object that is a
        car, and returns.

    Examples
    --------
    >>> def frame(t_us, name):
    ...     return Observations(t_us, (name,), np.array([[t_us * 1e-5, 0.0]]), np.array([[10.0, 0.0]]), np.zeros(1),
    ...                         np.full(1, 4.5), np.full(1, 1.8), np.ones(1, bool), np.zeros(1, bool))
    >>> anchorer = Anchorer(None)
    >>> for t_us in range(0, 2_000_000, 100_000):             # lost for a second, then seen under another name
    ...     seen = frame(t_us, "v1") if t_us < 800_000 else frame(t_us, "v2") if t_us >= 1_500_000 else None
    ...     nobody = Observations(t_us, (), *np.zeros((2, 0, 2)), *np.zeros((3, 0)), *np.zeros((2, 0), bool))
    ...     cars, changes = anchorer.observe(nobody if seen is None else seen)
    ...     for change in changes:
    ...         print(t_us, change.kind, change.lower, change.upper)
    400000 established v1 w1
    400000 established w1 car1
    800000 lost v1 w1
    1500000 reestablished v2 w1
    >>> cars.ids, cars.vision_ids, cars.linked.tolist()
    (('car1',), ('v2',), [True])
    """

    def __init__(
        self,
        network: RoadNetwork | None,
        settings: AnchoringSettings | None = None,
        *,
        linkage: LinkageText | None = None,
        trusts_ids: bool = False,
    ) -> None:
        self.settings = AnchoringSettings() if settings is None else settings
        self.roads = RoadMap(network, self.settings)
        linkages, classes, norms = linkage or default_linkage(self.settings)
        self._sensors = Sensors(self.settings) if any(one.is_per_sensor for one in classes) else None
        self._linkages = tuple([one for one in linkages if network is not None or one.level != "on_road"])
        levels = [linkage.level for linkage in self._linkages]
        if len(levels) < 2 or levels[0] != "world" or levels[-1] != "car":
            raise AnchoringError(f"anchorer: expected linkages from 'world' to 'car', got levels {levels!r}")
        self._bodies = Bodies(self.settings, norms)
        self._outline = Outline()
        self.trials = Trials(self.settings)
        self._weighed_us = 0
        self._weighed: dict[str, Weighing] = {}  # of world objects, in this frame
        self._states = StateTable()
        self._named = dict.fromkeys(levels, 0)
        self._last_t_us: int | None = None
        self._columns: dict[str, int] = {}  # of every vision object that is followed
        self._trusts_ids = trusts_ids
        self._moments_us: deque[int] = deque()
        self._returned = set[int]()  # columns of those that are seen again in this frame
        self._away: dict[str, Away] = {}  # by the vision object, oldest first; empty unless names are trusted
        self.filled: tuple[Cars, ...] = ()
        self.refused: Counter[str] = Counter()

    def observe(self, observations: Observations) -> tuple[Cars, tuple[LinkChange, ...]]:
        """Take the vision objects of one frame.

        Parameters
        ----------
        observations : of a frame later than the last one; may be empty.

        Returns
        -------
        The cars, in order of their numbers, and the links that changed, in the order in which they were decided.

        Raises
        ------
        AnchoringError
            If the frame is not later than the last one.
        """
        t_us = observations.t_us
        if self._last_t_us is not None and t_us <= self._last_t_us:
            raise AnchoringError(f"anchorer: expected a frame after {self._last_t_us} us, got one at {t_us!r} us")
        elapsed_us = 0 if self._last_t_us is None else t_us - self._last_t_us
        self._last_t_us = t_us
        observations, joined = self._join(observations)
        changes = joined + self._match(observations)
        columns = np.array([self._columns[vision_id] for vision_id in observations.ids], dtype=np.int64)
        if observations.classes:
            self._bodies.tell_classes(columns, observations.classes)
        frame = self.roads.frame(self._bodies, observations, columns)
        changes += self._progress(frame)
        # What jumps before it has a name is another thing as well: in the next frame it starts anew.
        has_jumped = frame.is_seen & ~self._bodies.is_established & (self._bodies.codes & Fluent.NO_JUMP == 0)
        frame.is_seen[has_jumped] = False
        self._accept(frame, elapsed_us)
        merged, relinked = self._relink(frame)
        ended, endings = self._end(frame)
        cars = self._cars(frame)
        self.filled = self._fill(frame, cars)
        self._drop(merged + ended + has_jumped.nonzero()[0].tolist())
        return cars, tuple(self.trials.judge(t_us, (*changes, *relinked, *endings), self._weighed))

    def _join(self, observations: Observations) -> tuple[Observations, list[LinkChange]]:
        """Take together what several sensors see of one thing; return what is left to be matched."""
        if self._sensors is None or (observations.ids and not observations.sensors):
            return observations, []
        bodies = self._bodies
        changes = list(self._sensors.lead(observations, bodies, self._columns))
        found, parted, others = self._sensors.join(observations, bodies, self._columns)
        changes += parted
        merged = list[int]()
        for name, chain in found:
            column = self._columns.pop(name, None)
            if column is not None:
                merged.append(column)
                if bodies.is_established[column]:
                    changes += self._withdraw(observations.t_us, column, "it is a car that another sensor sees")
            change = chain.change(observations.t_us, "joined", chain.world, "they are seen in one place")
            changes.append(change._replace(lower=name))
        self._drop(merged)
        return observations.take([row for row, name in enumerate(observations.ids) if name not in others]), changes

    def _match(self, observations: Observations) -> list[LinkChange]:
        """Give every vision object a body, and take away the vision objects that are gone."""
        present = set(observations.ids)
        if self._columns.keys() == present:
            return []
        bodies, changes, dropped = self._bodies, list[LinkChange](), list[int]()
        for vision_id, column in list(self._columns.items()):
            if vision_id in present:
                continue
            del self._columns[vision_id]
            if bodies.is_established[column]:
                changes.append(bodies.chains[column].lose(observations.t_us, "the vision object is gone"))
                if self._trusts_ids:
                    seen_us, centre_m = int(bodies.states_us[NOW, column]), bodies.states[NOW, X : Y + 1, column]
                    self._away[vision_id] = Away(bodies.chains[column], seen_us, centre_m.tolist())
            else:
                dropped.append(column)
        while len(self._away) > MOST_AWAY:
            del self._away[next(iter(self._away))]
        self._drop(dropped)
        self._add([k for k, vision_id in enumerate(observations.ids) if vision_id not in self._columns], observations)
        return changes

    def _add(self, new: list[int], observations: Observations) -> None:
        """Start to follow vision objects, given by their places in the observations."""
        first = len(self._bodies)
        for column, k in enumerate(new, start=first):
            self._columns[observations.ids[k]] = column
        state = state_of(observations)[:, new]
        size_m = np.stack([observations.length_m[new], observations.width_m[new]])
        chains = [Chain(observations.ids[k], self._linkages) for k in new]
        self._bodies.append(observations.t_us, chains, state, size_m)

    def _drop(self, columns: list[int]) -> None:
        if columns:
            self._bodies.drop(columns)
            chains = self._bodies.chains
            self._columns = {chain.vision_id: column for column, chain in enumerate(chains) if chain.vision_id}

    def _progress(self, frame: Frame) -> list[LinkChange]:
        """Let the conditions see this frame; those that would learn nothing new are passed over."""
        bodies, changes = self._bodies, list[LinkChange]()
        codes = measure(bodies, frame, self.roads, self.settings)
        for column in (bodies.waits | (codes != bodies.codes)).nonzero()[0].tolist():
            chain, code = bodies.chains[column], int(codes[column])
            made = list(chain.progress(frame.t_us, self._states[code], self._name))
            if made:
                changes += made
                self._note(column)
            bodies.waits[column] = bool(made) or not chain.is_idle
            if any(change.kind == "refuted" and change.level == "world" for change in made):
                self._detach(frame, column, has_jumped=not code & Fluent.NO_JUMP)
        bodies.codes = codes
        return changes

    def _name(self, linkage: Linkage) -> str:
        self._named[linkage.level] += 1
        return f"{linkage.prefix}{self._named[linkage.level]}"

    def _note(self, column: int) -> None:
        """Keep in the arrays what the links of a body amount to."""
        bodies = self._bodies
        chain = bodies.chains[column]
        if chain.car_id and not chain.car_number:
            chain.car_number = self._named["car"]
        bodies.is_established[column] = bool(chain.world.upper)
        bodies.car_number[column] = chain.car_number if chain.has_car else 0

    def _detach(self, frame: Frame, column: int, *, has_jumped: bool) -> None:
        """Take a refuted vision object away; in the next frame it starts anew, as something unknown."""
        bodies = self._bodies
        chain = bodies.chains[column]
        del self._columns[chain.vision_id]
        chain.vision_id = ""
        if has_jumped:
            self.refused["jumps refused"] += 1
        else:
            bodies.go_back(column, snapshot=OLD)
        self.roads.predict_again(bodies, frame, column)

    def _accept(self, frame: Frame, elapsed_us: int) -> None:
        """Take over what was seen."""
        bodies, seen = self._bodies, frame.is_seen.nonzero()[0]
        self._outline.widen(frame.state[X : Y + 1, frame.is_seen & bodies.is_established])
        clipped = frame.clipped[seen]
        self._returned = set(
            bodies.accept(frame.t_us, seen, state=frame.state[:, seen], road=frame.places[0, seen], clipped=clipped)
        )
        bodies.note_motion(seen, frame.sigma_m[seen])
        bodies.note_seen(frame.is_seen, elapsed_us)
        bodies.take_snapshots(frame.t_us)
        whole = seen[~clipped]
        bodies.measure_sizes(frame.t_us, whole, frame.length_m[whole], frame.width_m[whole])

    def _relink(self, frame: Frame) -> tuple[list[int], list[LinkChange]]:
        """Look for lost world objects among what began lately; return the columns that were merged."""
        bodies = self._bodies
        merged, changes = self._return_named(frame) if self._away else (list[int](), list[LinkChange]())
        found = dict[int, int]()
        is_new = ~bodies.is_established & frame.is_seen
        is_new[merged] = False
        self._weighed = {}
        if not is_new.any() or not self._is_time_to_weigh(frame.t_us, is_new):
            return merged, changes
        pairs, self._weighed = find_returns(
            bodies, frame, is_new, outline=self._outline, roads=self.roads, settings=self.settings
        )
        for column in is_new.nonzero()[0].tolist():
            if column not in pairs:
                bodies.chains[column].proposal = None
        for column in [one for one in pairs if bodies.is_returned[one]]:
            del pairs[column]  # in the next frame its vision object starts anew, and finds the other one
            changes.append(self._take_back(frame, column, "it is another car that was lost"))
        for column, target in pairs.items():
            if not bodies.is_established[column] and not self._agrees(frame, column, target):
                continue
            if bodies.is_returned[target] and frame.is_seen[target]:
                changes.append(self._take_back(frame, target, "another one explains it better"))
            if bodies.is_established[column]:
                changes += self._withdraw(frame.t_us, column, "it is a car that was lost")
            elapsed_us = frame.t_us - int(bodies.states_us[NOW, target])
            changes += self._adopt(frame, column, target, f"likelier by far than all else after {elapsed_us} us")
            found[column] = target
        self._move_over(frame, found)
        return [*merged, *found], changes

    def _return_named(self, frame: Frame) -> tuple[list[int], list[LinkChange]]:
        """Give names that have come back what they were linked to; return the columns that were merged."""
        bodies, reason = self._bodies, "its name has come back"
        found, changes = dict[int, int](), list[LinkChange]()
        for column in (~bodies.is_established & frame.is_seen).nonzero()[0].tolist():
            vision_id = bodies.chains[column].vision_id
            away = self._away.pop(vision_id, None)
            if away is None:
                continue
            chain, way_m = away.chain, math.dist(away.centre_m, frame.state[X : Y + 1, column])
            if way_m > self.settings.return_mps * (frame.t_us - away.seen_us) * 1e-6:
                self.refused["returns refused"] += 1
            elif chain not in bodies.chains:
                bodies.chains[column] = chain
                changes += chain.revive(frame.t_us, vision_id, reason)
                self._note(column)
            else:
                if chain.vision_id:  # another one was taken for it
                    del self._columns[chain.vision_id]
                    changes.append(chain.lose(frame.t_us, f"{vision_id} has come back", kind="refuted"))
                target = bodies.chains.index(chain)
                changes += self._adopt(frame, column, target, reason)
                found[column] = target
        self._move_over(frame, found)
        bodies.is_returned[[*found.values()]] = False  # a name is not weighed against evidence
        return [*found], changes

    def _is_time_to_weigh(self, t_us: int, is_new: BoolArray) -> bool:
        """Tell whether something begins in this frame, or its speed has become surer since it was weighed."""
        begins = (self._bodies.states_us[START, is_new] == t_us).any()
        is_time = bool(begins) or t_us - self._weighed_us >= self.settings.settled_us // 2
        self._weighed_us = t_us if is_time else self._weighed_us
        return is_time

    def _agrees(self, frame: Frame, column: int, target: int) -> bool:
        """Let the condition of a return see that a new vision object fits a lost world object."""
        chain, world = self._bodies.chains[column], self._bodies.chains[target].world
        if chain.proposal is None or chain.proposal[0] != world.upper:
            chain.proposal = world.upper, world.linkage.reestablish()
        state = self._states[int(self._bodies.codes[column]) | _FITS]
        return chain.proposal[1].progress(frame.t_us, state) is Verdict.TRUE

    def _take_back(self, frame: Frame, column: int, reason: str) -> LinkChange:
        """Refute the link of a lost car to a vision object that began lately: the car is as lost as before."""
        bodies = self._bodies
        chain = bodies.chains[column]
        del self._columns[chain.vision_id]
        change = chain.lose(frame.t_us, reason, kind="refuted")
        bodies.go_back(column, snapshot=END)
        bodies.unseen_us[column] = bodies.states_us[END, column] + 1
        bodies.is_returned[column] = False
        self.roads.predict_again(bodies, frame, column)
        return change

    def _withdraw(self, t_us: int, column: int, reason: str) -> list[LinkChange]:
        """Refute that a vision object that began lately is a car of its own."""
        chain, vision_id = self._bodies.chains[column], self._bodies.chains[column].vision_id
        refuted = chain.lose(t_us, reason, kind="refuted")
        chain.vision_id = vision_id
        self._bodies.car_number[column] = 0
        return [refuted, *chain.end(t_us, "it never was a car of its own")]

    def _adopt(self, frame: Frame, column: int, target: int, reason: str) -> list[LinkChange]:
        """Link the vision object of one body to the world object of another."""
        bodies, changes = self._bodies, list[LinkChange]()
        chain, new = bodies.chains[target], bodies.chains[column]
        if chain.vision_id:
            del self._columns[chain.vision_id]
            changes.append(chain.lose(frame.t_us, f"{new.vision_id} is seen where {chain.vision_id} is only guessed"))
        hidden_us = None if bodies.unseen_us[target] < 0 else int(bodies.unseen_us[target])
        chain.weighing = new.weighing
        return [*changes, chain.adopt(frame.t_us, new.vision_id, reason, hidden_us)]

    def _move_over(self, frame: Frame, found: dict[int, int]) -> None:
        """Give lost bodies what was seen of others, by the columns of these."""
        if not found:
            return
        columns, targets = np.array([*found], np.int64), np.array([*found.values()], np.int64)
        self._bodies.move_over(columns, targets, frame.t_us)
        self._returned.update(found.values())
        frame.is_seen[targets] = True
        frame.state[:, targets] = self._bodies.states[NOW][:, targets]
        frame.places[:, targets] = frame.places[:, columns]

    def _end(self, frame: Frame) -> tuple[list[int], list[LinkChange]]:
        """End world objects that are lost for good; return their columns."""
        bodies, settings, changes = self._bodies, self.settings, list[LinkChange]()
        unseen_us = frame.t_us - bodies.seen_us
        leaving = bodies.was_clipped[NOW] & bodies.was_whole & (unseen_us > settings.edge_loss_us)
        leaving &= np.hypot(bodies.states[NOW, VX], bodies.states[NOW, VY]) > settings.leaving_mps
        ended = (bodies.is_established & ((unseen_us > settings.survive_us) | leaving)).nonzero()[0].tolist()
        for column in ended:
            reason = "left the view" if leaving[column] else f"unseen for more than {settings.survive_us} us"
            changes += bodies.chains[column].end(frame.t_us, reason)
            bodies.car_number[column] = 0
        return ended, changes

    def _cars(self, frame: Frame) -> Cars:
        bodies = self._bodies
        is_car, is_known = bodies.car_number > 0, frame.t_us - bodies.seen_us <= self.settings.predict_us
        is_known &= (bodies.unseen_us < 0) | (frame.t_us - bodies.unseen_us <= self.settings.predict_us)
        hidden = (is_car & ~is_known).nonzero()[0]
        # Who would have left the view by now may be linked again, but nobody waits for it.
        hidden = hidden[self._outline.holds(frame.state[X : Y + 1, hidden], slack_m=self.settings.edge_m)]
        columns = (is_car & is_known).nonzero()[0]
        columns = columns[np.argsort(bodies.car_number[columns])]
        chains = [bodies.chains[column] for column in columns]
        state = frame.state[:, columns]
        return Cars(
            t_us=frame.t_us,
            ids=tuple([chain.car_id for chain in chains]),
            centre_m=state[X : Y + 1].T,
            speed_mps=np.hypot(state[VX], state[VY]),
            velocity_mps=state[VX : VY + 1].T,
            heading_rad=state[HEADING],
            length_m=bodies.length_m[columns],
            width_m=bodies.width_m[columns],
            classes=tuple([CLASS_NAMES[index] for index in bodies.classes[columns]]),
            linked=frame.is_seen[columns],
            vision_ids=tuple([chain.vision_id for chain in chains]),
            positions=frame.positions(columns),
            sigma_m=bodies.sigma_m[columns],
            has_moved=bodies.has_moved[columns],
            confidence=bodies.confidence(columns),
            hidden={bodies.chains[column].car_id: int(bodies.unseen_us[column]) for column in hidden.tolist()},
        )

    def _fill(self, frame: Frame, cars: Cars) -> tuple[Cars, ...]:
        """Find where the cars that are seen again in this frame were at the moments while they were not."""
        moments, t_us = self._moments_us, cars.t_us
        while moments and moments[0] < t_us - self.settings.survive_us:
            moments.popleft()
        returned = [one for one in sorted(self._returned) if self._bodies.car_number[one] > 0 and frame.is_seen[one]]
        moments_us = np.array(moments if returned else (), dtype=np.int64)
        if not moments or t_us - moments[-1] >= _MOMENT_US:
            moments.append(t_us)
        columns = np.array(returned, dtype=np.int64)
        return tuple(fill(cars, self._bodies, columns, moments_us, roads=self.roads, settings=self.settings))
