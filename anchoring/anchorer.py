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
from anchoring.linking.bodies import END, HEADING, LOST, NOW, OLD, START, VX, VY, Bodies, X, Y
from anchoring.linking.classes import CLASS_NAMES
from anchoring.linking.evidence import NewCars, weigh
from anchoring.linking.fluents import Fluent, StateTable, measure
from anchoring.linking.frame import Frame, RoadMap
from anchoring.linking.hidden import earlier_cars, hidden_path
from anchoring.linking.linker import MOST_MARGIN, Evidence, choose, rivals
from anchoring.linking.ways import Looks
from anchoring.observations import NEW, BoolArray, Cars, FloatArray, LinkChange, LongArray, Observations
from anchoring.settings import AnchoringSettings
from gis.road_network import RoadNetwork, RoadPositions

# Where hidden cars were is told for frames at least so far apart: relations change more slowly.
_MOMENT_US = 200_000

_FITS = int(Fluent.FITS)

MOST_AWAY = 10_000  # names that may come back; each is about a kilobyte


@dataclass(frozen=True, slots=True)
class Away:
    """Keep what a vision object was linked to when it went, and when and where it was seen last."""

    chain: Chain
    seen_us: int
    x_m: float
    y_m: float


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
        self._roads = RoadMap(network, self.settings)
        linkages, _, norms = linkage or default_linkage(self.settings)
        self._linkages = tuple([one for one in linkages if network is not None or one.level != "on_road"])
        levels = [linkage.level for linkage in self._linkages]
        if len(levels) < 2 or levels[0] != "world" or levels[-1] != "car":
            raise AnchoringError(f"anchorer: expected linkages from 'world' to 'car', got levels {levels!r}")
        self._bodies = Bodies(self.settings, norms)
        # Sizes of five usual cars, (2, 5): what is known before any is seen here.
        self._usual_m = norms.usual_m[:, :1] + norms.usual_m[:, 1:] * np.array([-1.0, -1.0, 0.0, 1.0, 1.0])
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
        self._returned: list[int] = []  # columns of those that are seen again in this frame
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
        self._last_t_us = t_us
        changes = self._match(observations)
        columns = np.array([self._columns[vision_id] for vision_id in observations.ids], dtype=np.int64)
        if observations.classes:
            self._bodies.tell_classes(columns, observations.classes)
        frame = self._roads.frame(self._bodies, observations, columns)
        changes += self._progress(frame)
        self._accept(frame)
        merged, relinked = self._relink(frame)
        ended, endings = self._end(frame)
        cars = self._cars(frame)
        self.filled = self._fill(frame, cars)
        self._drop(merged + ended)
        return cars, tuple(self.trials.judge(t_us, (*changes, *relinked, *endings), self._weighed))

    def locate(self, centre_m: FloatArray) -> RoadPositions:
        """Find where points, (k, 2), are on the roads, as of cars."""
        return self._roads.locate(centre_m)

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
                    x_m, y_m = bodies.states[NOW, X : Y + 1, column].tolist()
                    self._away[vision_id] = Away(bodies.chains[column], int(bodies.states_us[NOW, column]), x_m, y_m)
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
        state = np.full((8, len(new)), np.nan)
        state[X : Y + 1] = observations.centre_m[new].T
        state[VX : VY + 1] = observations.velocity_mps[new].T
        state[HEADING] = observations.heading_rad[new]
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
        codes = measure(bodies, frame, self._roads, self.settings)
        for column in (bodies.waits | (codes != bodies.codes)).nonzero()[0].tolist():
            chain, code = bodies.chains[column], int(codes[column])
            made = list(chain.progress(frame.t_us, self._states.of(code), self._name))
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
        self._roads.predict_again(bodies, frame, column)

    def _accept(self, frame: Frame) -> None:
        """Take over what was seen."""
        bodies, seen = self._bodies, frame.is_seen.nonzero()[0]
        self._outline.widen(frame.state[X : Y + 1, frame.is_seen & bodies.is_established])
        clipped = frame.clipped[seen]
        self._returned = bodies.accept(
            frame.t_us, seen, state=frame.state[:, seen], road=frame.places[0, seen], clipped=clipped
        ).tolist()
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
        self._weighed.clear()
        if not is_new.any() or not self._is_time_to_weigh(frame.t_us, is_new):
            return merged, changes
        bodies.is_contested[:] = False
        pairs = self._pairs(frame, is_new)
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
                changes += self._withdraw(frame, column)
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
            chain, way_m = away.chain, math.dist((away.x_m, away.y_m), frame.state[X : Y + 1, column])
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
        state = self._states.of(int(self._bodies.codes[column]) | _FITS)
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
        self._roads.predict_again(bodies, frame, column)
        return change

    def _withdraw(self, frame: Frame, column: int) -> list[LinkChange]:
        """Refute that a vision object that began lately is a car of its own."""
        chain, vision_id = self._bodies.chains[column], self._bodies.chains[column].vision_id
        refuted = chain.lose(frame.t_us, "it is a car that was lost", kind="refuted")
        chain.vision_id = vision_id
        self._bodies.car_number[column] = 0
        return [refuted, *chain.end(frame.t_us, "it never was a car of its own")]

    def _pairs(self, frame: Frame, is_new: BoolArray) -> dict[int, int]:
        """Find which vision objects that began lately are lost world objects: columns of the one and the other."""
        bodies, settings = self._bodies, self.settings
        is_open = frame.is_seen & (frame.t_us - bodies.states_us[START] <= settings.open_us)
        starts = (is_open | is_new).nonzero()[0]
        returned = (is_open & bodies.is_returned).nonzero()[0]
        lost = (bodies.is_established & ~frame.is_seen).nonzero()[0]
        if not len(lost) + len(returned):
            return {}
        ends = np.concatenate([lost, returned])
        before = np.repeat((NOW, END), (len(lost), len(returned)))
        begun, gone = bodies.looks(starts, START), bodies.looks(ends, before)
        new = self._new_cars(begun, bodies.was_clipped[START, starts])
        evidence = weigh(begun, gone, new, self._roads.routes(begun, gone), settings)
        bodies.is_contested[starts[evidence.starts[evidence.ratios > 0.0]]] = True
        bodies.is_contested &= is_new
        chosen, margins = choose(evidence)
        self._note_weighings(starts, ends, evidence, chosen, margins)
        clear = chosen[margins >= settings.margin_nats]
        pairs = zip(starts[evidence.starts[clear]].tolist(), ends[evidence.ends[clear]].tolist(), strict=True)
        return {column: target for column, target in pairs if column != target}

    def _note_weighings(
        self, starts: LongArray, ends: LongArray, evidence: Evidence, chosen: LongArray, margins: FloatArray
    ) -> None:
        """Keep how much likelier than all else it is what each vision object is taken for."""
        bodies = self._bodies
        losses, by_start, by_end = (one.tolist() for one in rivals(evidence, chosen))
        pair_starts, pair_ends, ratios = (one.tolist() for one in (evidence.starts, evidence.ends, evidence.ratios))
        best = {
            pair_starts[pair]: (pair, margin) for pair, margin in zip(chosen.tolist(), margins.tolist(), strict=True)
        }
        names = [bodies.chains[start].vision_id for start in starts.tolist()]
        worlds = [bodies.chains[end].world.upper for end in ends.tolist()]
        possible = set(pair_starts)
        for start, column in enumerate(starts.tolist()):
            chain = bodies.chains[column]
            if start not in possible:
                if bodies.is_returned[column]:  # as its speed is surer now, it could not have come here
                    self._weighed[chain.world.upper] = Weighing(chain.world.upper, None, -MOST_MARGIN, NEW)
                continue
            rival = by_start[start]
            loss_nats, runner_up = losses[rival], worlds[pair_ends[rival]]
            if start in best:
                pair, margin_nats = best[start]
                end, ratio = pair_ends[pair], ratios[pair]
                other = by_end[end]
                others = (ratio, NEW), (loss_nats, runner_up), (losses[other], names[pair_starts[other]])
                chain.weighing = Weighing(worlds[end], ratio, margin_nats, min(others)[1])
            else:
                chain.weighing = Weighing(NEW, None, min(loss_nats, MOST_MARGIN), runner_up)
            if bodies.is_established[column]:
                said = chain.world.upper if bodies.is_returned[column] else NEW
                self._weighed[chain.world.upper] = chain.weighing.of(said)

    def _new_cars(self, begun: Looks, clipped: BoolArray) -> NewCars:
        """Tell what is expected of cars that are new where something began, and of the size that is usual here."""
        bodies, settings = self._bodies, self.settings
        back_m = settings.edge_m * np.stack([np.cos(begun.heading_rad), np.sin(begun.heading_rad)])
        inside = self._outline.holds(begun.centre_m.T - back_m, slack_m=settings.outline_slack_m)
        births_per_m = np.where(clipped | ~inside, settings.edge_births_per_m, settings.births_per_m)
        known_m = np.stack([bodies.length_m, bodies.width_m])[:, bodies.is_established & bodies.is_measured()]
        sizes_m = np.concatenate([self._usual_m, known_m], axis=1)
        return NewCars(births_per_m, sizes_m.mean(axis=1), sizes_m.std(axis=1))

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
        self._returned += found.values()
        frame.is_seen[targets] = True
        frame.state[:, targets], frame.places[:, targets] = frame.state[:, columns], frame.places[:, columns]

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
        # Who would have left the view by now may be linked again, but nobody waits for it.
        is_expected = self._outline.holds(frame.state[X : Y + 1], slack_m=self.settings.edge_m)
        hidden = (is_car & ~is_known & is_expected).nonzero()[0].tolist()
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
            hidden={bodies.chains[column].car_id: int(bodies.unseen_us[column]) for column in hidden},
        )

    def _fill(self, frame: Frame, cars: Cars) -> tuple[Cars, ...]:
        """Find where the cars that are seen again in this frame were at the moments while they were not."""
        moments, t_us = self._moments_us, cars.t_us
        while moments and moments[0] < t_us - self.settings.survive_us:
            moments.popleft()
        bodies, returned = self._bodies, np.array(self._returned, dtype=np.int64)
        returned = returned[(bodies.car_number[returned] > 0) & frame.is_seen[returned]]
        times_us = np.array(moments, dtype=np.int64)
        body, moment = (times_us > bodies.states_us[LOST, returned][:, None]).nonzero()
        if not moments or t_us - moments[-1] >= _MOMENT_US:
            moments.append(t_us)
        if not len(body):
            return ()
        # From when each was seen last to when its vision object was seen first, and from then to now.
        lost_us, began_us, now_us = bodies.states_us[[[LOST], [START], [NOW]], returned]
        has_both = (lost_us < began_us) & (began_us < now_us)
        columns = returned.repeat(2)
        end = bodies.looks(columns, np.tile((LOST, START), len(returned)))
        start = bodies.looks(
            columns, np.stack((np.where(has_both, START, NOW), np.full(len(returned), NOW)), 1).ravel()
        )
        times_us = times_us[moment]
        span = 2 * body + (has_both[body] & (times_us >= began_us[body]))
        path = hidden_path(end, start, span, times_us, self._roads)
        row_of = {car: row for row, car in enumerate(cars.ids)}
        rows = np.array([row_of[bodies.chains[column].car_id] for column in returned])
        return tuple(earlier_cars(cars, rows[body], times_us, path, self._roads))
