"""Which relation changes would a run have told that watched more? Computed from the cars that its log has.

The same observer looks at the same cars on the same roads as in the run: each car from the moment at which it got its
name, with its rows of before; of one that nobody saw for a while, what was true holds until it has rows again.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, islice
from operator import attrgetter
from pathlib import Path
from typing import Any  # columns are arrays of several types

import numpy as np
from msgspec.structs import replace

from anchoring.observations import nowhere
from anchoring.settings import AnchoringSettings
from gis.road_network import RoadNetwork
from qsr.measuring.footprints import Footprints, on_roads
from qsr.settings import RelationSettings
from service.errors import LogError
from service.questions.identity import IdentityLink, chain_of, links_below
from service.records import CarState, RelationRecord, RunRecord
from service.runs.inputs.input_kind import content_digest
from service.runs.inputs.site import Site, load_site
from service.runs.relations import relation_observer, relation_record
from service.store.log import EventLog

# Points on a road network are found many at once: a frame has too few of them to be worth a call.
_LOCATED_AT_ONCE = 4096

# The columns of footprints that `on_roads` gives, as they are laid out.
_PLACE_TYPES = {name: column.dtype for name, column in on_roads(nowhere(0)).items()}


@dataclass(frozen=True, slots=True)
class Ground:
    """Hold what the relations of a run depend on beside its cars; no network is open ground."""

    network: RoadNetwork | None
    anchoring: AnchoringSettings
    relations: RelationSettings


def ground_of(run: RunRecord, asked: str, site_file: Path | None = None) -> Ground:
    """Read the site of a run again; see `stored_events.unwatched_relations`.

    Parameters
    ----------
    asked : what it is for, in messages.
    """
    if not run.site and site_file is None:
        return Ground(None, AnchoringSettings(), RelationSettings())
    known = run.site_file
    path = site_file or (Path(known.path) if known else None)
    where = f"run {run.id!r}: expected the site file of {run.site!r} as it was, to compute {asked} from the cars"
    if path is None or not path.exists():
        came = "none in this older log" if path is None else f"no file {str(path)!r}"
        raise LogError(f"{where}, got {came}; say where it is with --site")
    site = load_site(path)
    if not _is_the_same(site, run):
        raise LogError(f"{where}, got another one in {str(path)!r}")
    return Ground(site.network, site.anchoring, site.relations)


def _is_the_same(site: Site, run: RunRecord) -> bool:
    """Compare the contents, or the names where an older log has no more."""
    if run.site_file is None:
        return site.name == run.site
    return content_digest(*site.files) == run.site_file.digest


def computed_relations(
    log: EventLog, run: RunRecord, names: Collection[str], ground: Ground
) -> Iterator[RelationRecord]:
    """Compute the changes of some relations among the cars of a run, in the order in which they would be decided.

    Parameters
    ----------
    names : of the relations.
    ground : that of the run.
    """
    observer = relation_observer(ground.network, ground.relations, names)
    named_us = {one.upper: one.t_us for one in log.links(run.id) if (one.level, one.kind) == ("car", "established")}
    last_us = {one.car: one.last_us for one in log.cars(run.id)}
    rows = _Rows(_taken_for_others(log, run))
    before: dict[str, list[_Placed]] = {}  # of cars that have no name yet, or that nobody sees
    latest: dict[str, _Placed] = {}  # of those that have rows now, or will have some again
    states = groupby(_placed(log.states(run.id), ground), key=_time_us)
    at_us, here = next(states, (None, iter(())))
    for _, t_us in log.frames(run.id):
        former: list[_Placed] = []
        latest = {car: one.held(t_us) for car, one in latest.items() if last_us[car] >= t_us}
        if at_us == t_us:
            for one in here:
                car = one.state.car
                is_named, is_seen = t_us >= named_us.get(car, 0), rows.is_seen(one.state)
                if is_named:
                    latest[car] = one
                if is_named and is_seen:
                    former += before.pop(car, ())
                else:
                    before.setdefault(car, []).append(one)
            at_us, here = next(states, (None, iter(())))
        earlier = [rows.of(then_us, then) for then_us, then in _by_time(former)]
        for change in observer.observe(rows.of(t_us, list(latest.values())), filled=earlier):
            yield relation_record(change)


def _taken_for_others(log: EventLog, run: RunRecord) -> dict[str, list[IdentityLink]]:
    """Give for each car the links by which another one was taken for it, as turned out afterwards."""
    below = links_below(log, run.id)
    wrong = {
        one.car: [link for link in chain_of(below, one.car) if link.verdict == "refuted"] for one in log.cars(run.id)
    }
    return {car: links for car, links in wrong.items() if links}


@dataclass(frozen=True, slots=True)
class _Placed:
    """Hold a row of a car with its place on the roads, a value for each of `_PLACE_TYPES`."""

    state: CarState
    place: tuple[float, ...]

    def held(self, t_us: int) -> "_Placed":
        """Give the row at a later time at which nobody sees the car: it stands where it was."""
        return _Placed(replace(self.state, t_us=t_us, linked=False), self.place)


_time_us = attrgetter("state.t_us")


def _placed(states: Iterator[CarState], ground: Ground) -> Iterator[_Placed]:
    """Find the place of every row."""
    tolerance_m = ground.anchoring.road_tolerance_m
    while some := list(islice(states, _LOCATED_AT_ONCE)):
        centre_m = np.array([(one.x_m, one.y_m) for one in some])
        network = ground.network
        places = nowhere(len(some)) if network is None else network.locate(centre_m, tolerance_m=tolerance_m)
        columns = [column.tolist() for column in on_roads(places).values()]
        yield from (_Placed(one, place) for one, place in zip(some, zip(*columns, strict=True), strict=True))


def _by_time(states: Iterable[_Placed]) -> Iterator[tuple[int, list[_Placed]]]:
    ordered = sorted(states, key=_time_us)
    return ((t_us, list(group)) for t_us, group in groupby(ordered, key=_time_us))


class _Rows:
    """Lays out rows of the log as the relations take cars.

    Parameters
    ----------
    taken_for_others : of each car, the links by which it was not the one that was seen.
    """

    def __init__(self, taken_for_others: Mapping[str, Sequence[IdentityLink]]) -> None:
        self._taken_for_others = taken_for_others

    def of(self, t_us: int, placed: Sequence[_Placed]) -> Footprints:
        """Lay out the cars of one time."""
        states = [one.state for one in placed]
        columns: dict[str, Any] = {
            name: np.array([getattr(one, name) for one in states], dtype=np.float64)
            for name in ("heading_rad", "speed_mps", "length_m", "width_m", "sigma_m", "confidence")
        }
        for k, (name, dtype) in enumerate(_PLACE_TYPES.items()):
            columns[name] = np.array([one.place[k] for one in placed], dtype=dtype)
        return Footprints(
            t_us=t_us,
            ids=tuple([one.car for one in states]),
            centre_m=np.array([(one.x_m, one.y_m) for one in states], dtype=np.float64).reshape(-1, 2),
            **columns,
            observed=np.array([self.is_seen(one) for one in states], dtype=np.bool_),
            has_moved=np.array([one.has_moved for one in states], dtype=np.bool_),
        )

    def is_seen(self, one: CarState) -> bool:
        """Tell whether the car itself was seen in this row."""
        links = self._taken_for_others.get(one.car, ())
        is_other = any(link.start_us <= one.t_us and (link.end_us is None or one.t_us < link.end_us) for link in links)
        return one.linked and not is_other
