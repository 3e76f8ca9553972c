"""Which relation changes would a run have told that watched more? Computed from the cars that its log has.

The same observer looks at the same cars on the same roads as in the run.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from anchoring.settings import AnchoringSettings
from gis.road_network import RoadNetwork
from qsr.settings import RelationSettings
from service.errors import InputError
from service.questions.stored_cars import seen_frames
from service.records import RelationRecord, RunRecord
from service.runs.inputs.input_kind import content_digest
from service.runs.inputs.site import Site, load_site
from service.runs.relations import relation_observer, relation_record
from service.store.log import EventLog


@dataclass(frozen=True, slots=True)
class Ground:
    """Hold what the relations of a run depend on beside its cars; no network is open ground."""

    network: RoadNetwork | None
    anchoring: AnchoringSettings
    relations: RelationSettings

    @property
    def late_us(self) -> int:
        """How long after it happened a change is decided at most: a car may be lost, or have had no name yet."""
        return self.anchoring.survive_us + self.anchoring.name_back_us + self.relations.backdate_us


def ground_of(run: RunRecord, asked: str, site_file: Path | None = None) -> Ground:
    """Read the site of a run again; see `stored_events.unwatched_relations`.

    Parameters
    ----------
    asked : what it is for, in messages.

    Raises
    ------
    InputError
        If it is not known any more, is another one, or cannot be used.
    """
    if not run.site and site_file is None:
        return Ground(None, AnchoringSettings(), RelationSettings())
    known = run.site_file
    path = site_file or (Path(known.path) if known else None)
    where = f"run {run.id!r}: expected the site file of {run.site!r} as it was, {asked}"
    if path is None or not path.exists():
        came = "none in this older log" if path is None else f"no file {str(path)!r}"
        raise InputError(f"{where}, got {came}; say where it is with --site")
    site = load_site(path)
    if not _is_the_same(site, run):
        raise InputError(f"{where}, got another one in {str(path)!r}")
    return Ground(site.network, site.anchoring, site.relations)


def _is_the_same(site: Site, run: RunRecord) -> bool:
    """Compare the contents, or the names where an older log has no more."""
    if run.site_file is None:
        return site.name == run.site
    return content_digest(*site.files) == run.site_file.digest


def computed_relations(
    log: EventLog,
    run: RunRecord,
    names: Collection[str],
    ground: Ground,
    window_us: tuple[int | None, int | None] = (None, None),
) -> Iterator[RelationRecord]:
    """Compute the changes of some relations among the cars of a run, in the order in which they would be decided.

    Parameters
    ----------
    names : of the relations.
    ground : that of the run.
    window_us : of the frames that are looked at, [from, to); of who was there before, what is true then is told.
    """
    observer = relation_observer(ground.network, ground.relations, names)
    tolerance_m = ground.anchoring.road_tolerance_m
    for frames in seen_frames(log, run, ground.network, tolerance_m=tolerance_m, window_us=window_us):
        for changes in observer.observe_all(frames):
            yield from map(relation_record, changes)
