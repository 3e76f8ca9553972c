"""Would other monitors have been violated in what was stored? Monitors over the cars and relations of a log."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from operator import attrgetter
from pathlib import Path
from typing import TypeVar

from msgspec.structs import astuple

from anchoring.hypotheses.trials import DoubtfulLinks
from anchoring.observations import Level, LinkChange
from anchoring.settings import AnchoringSettings
from chronicles.chronicle_set import ChronicleSet, load_texts
from chronicles.recogniser import recognise
from dyknow.mtl.monitors import MonitorEvent, MonitorReport
from dyknow.sample import Sample
from qsr.changes.crossings import RelationChange, Value
from service.errors import InputError
from service.questions.observations.stored_events import relations_of, stored_events, unwatched_relations
from service.records.events import ChronicleRef, MonitorVerdict
from service.records.runs import RunRecord
from service.records.seen import CarState, HypothesisRecord, LinkRecord, RelationRecord
from service.runs.graph.monitored_states import TrafficState, TrafficStates
from service.runs.graph.relations import stored_settings
from service.runs.graph.stream_processes import MonitoringUnit, StandingEvents
from service.store.log import EventLog, open_log
from service.texts.chronicle_files import read_text, with_relations
from service.texts.monitor_files import load_monitor_texts

_Row = TypeVar("_Row", LinkRecord, RelationRecord, HypothesisRecord)
_NEVER_US = -(2**62)
_States = list[tuple[int, TrafficState]]

_VALUES: Mapping[str, Value] = {"true": True, "false": False, "unknown": None}


@dataclass(frozen=True, slots=True)
class Monitored:
    """Hold what monitors told of a run, in the order in which it was certain, and what became of each monitor."""

    run: str
    events: tuple[MonitorEvent, ...]
    report: tuple[MonitorReport, ...]


def verdicts(found: Monitored) -> list[MonitorVerdict]:
    """Give what was told as records."""
    return [
        MonitorVerdict(ChronicleRef(one.monitor, one.version), one.outcome, dict(one.roles), one.since_us, one.t_us)
        for one in found.events
    ]


def monitor_log(
    url: str, monitor_files: Sequence[Path], *, run: str | None = None, site_file: Path | None = None
) -> Monitored:
    """Run monitors in files over a run of a log; parameters and errors as those of `monitor_run`."""
    texts = [(str(path), read_text(path)) for path in monitor_files]
    with open_log(url) as log:
        return monitor_run(log, log.run(run), texts, site_file)


def monitor_run(
    log: EventLog, run: RunRecord, texts: Sequence[tuple[str, str]], site_file: Path | None = None
) -> Monitored:
    """Run monitors over a run of a log; they tell what they would have told while it was processed.

    Parameters
    ----------
    texts : of the monitors, each after what messages call it.
    site_file : of the run, for relations that it did not watch; None for where the site file was.

    Raises
    ------
    LogError, InputError, DyKnowError
        If the log or the monitors cannot be used, or the run did not watch a relation that the monitors look at.
    """
    asked = load_monitor_texts(texts, None).events
    chronicles = _chronicles(run, asked)
    monitors = load_monitor_texts(texts, chronicles.given)
    monitors.check_names(chronicles)
    _check_complete(run)
    monitors.check_roads(f"run {run.id!r}", has_roads=bool(run.site))
    feeding = chronicles.feeding(monitors.events)
    looked_at = monitors.relations | relations_of(feeding)
    computed = tuple(unwatched_relations(log, run, looked_at, site_file).changes)
    lag_us = stored_settings(run).backdate_us
    standing = StandingEvents(feeding, monitors.events, lag_us=lag_us)
    if monitors.events:
        stored = stored_events(log, run.id, computed=computed)
        standing.finish(recognise(feeding, stored.events, until_us=stored.until_us))
    states = TrafficStates(monitors.features, lag_us=lag_us)
    unit = MonitoringUnit(monitors, standing, lag_us=lag_us)
    events = [one.value for one in _told(states, unit, _replay(log, run.id, states, computed))]
    return Monitored(run.id, tuple(events), unit.report())


def _chronicles(run: RunRecord, names: Collection[str]) -> ChronicleSet:
    """Compile the chronicles of a run, and those of the library that it did not have; none if no name asks for them."""
    texts = [(one.name, one.text) for one in run.texts] if names else []
    return load_texts([*dict(with_relations(texts, monitored=names)).items()])


def _check_complete(run: RunRecord) -> None:
    """Refuse a run whose log may lack what monitors saw: cars that are sampled seem to come and go."""
    if run.kpl:
        raise InputError(
            f"run {run.id!r}: expected one of the shipped pipeline, got one whose streams a text of its own declares; "
            "run the monitors while processing, with --monitors"
        )


def _told(
    states: TrafficStates, unit: MonitoringUnit, frames: Iterable[tuple[int, _States]]
) -> Iterator[Sample[MonitorEvent]]:
    """Give what monitors tell frame by frame, and at the end, which comes as it does in a run.

    There the time of the last frame is told before the end. After a gap this makes deadlines pass that lie before the
    last frame, so what is told of them has the time at which it was certain in the run.
    """
    now_us = 0
    for now_us, here in frames:
        yield from _update(unit, now_us, here)
    yield from _update(unit, now_us, states.advance(now_us))
    yield from unit.advance(now_us)
    yield from _update(unit, now_us, states.finish())
    yield from unit.finish()


def _update(unit: MonitoringUnit, now_us: int, states: _States) -> Iterator[Sample[MonitorEvent]]:
    for t_us, state in states:
        yield from unit.update(Sample(now_us, t_us, state))


def _replay(
    log: EventLog, run_id: str, states: TrafficStates, computed: Iterable[RelationRecord]
) -> Iterator[tuple[int, _States]]:
    """Feed the rows of a run frame by frame, in the order in which the pipeline had them; give what leaves."""
    doubtful, predict_us = DoubtfulLinks(), AnchoringSettings().predict_us
    links = _by_frame(log.links(run_id), "t_us")
    changes = _by_frame(chain(log.relations(run_id), computed), "decided_us")
    verdicts = _by_frame(log.hypotheses(run_id), "t_us")
    linked: dict[tuple[Level, str], str] = {}
    seen_us: dict[str, int] = {}
    frames = groupby(log.states(run_id), key=attrgetter("t_us"))
    cars_us, cars = next(frames, (None, iter(())))
    for _, t_us in log.frames(run_id):
        here_links = links.get(t_us, [])
        _link(linked, here_links)
        for change in here_links:
            doubtful.take(LinkChange(*astuple(change)))
        decided = ((_relation_change(one), one.hypotheses) for one in changes.get(t_us, ()))
        refuted, validated = (
            [one.label for one in verdicts.get(t_us, ()) if one.verdict == verdict]
            for verdict in ("refuted", "validated")
        )
        for label in validated:
            doubtful.believe(label)
        past = states.take_relations(t_us, decided, refuted, validated)
        here: list[CarState] = []
        if cars_us == t_us:
            # What was dated back, or filled in, was not known in the run when the monitors looked at its time.
            for one in cars:
                if one.linked and one.vision_id == _vision_id(linked, one.car):
                    seen_us[one.car] = t_us
                if t_us - seen_us.get(one.car, _NEVER_US) <= (0 if one.linked else predict_us):
                    here.append(one)
            cars_us, cars = next(frames, (None, iter(())))
        yield t_us, past + states.take_cars(t_us, here, doubtful.by_car())


def _link(linked: dict[tuple[Level, str], str], changes: Iterable[LinkRecord]) -> None:
    """Keep what is linked below each upper object at the moment."""
    for change in changes:
        if change.kind in ("established", "reestablished"):
            linked[change.level, change.upper] = change.lower
        elif change.kind in ("lost", "refuted", "ended"):
            linked.pop((change.level, change.upper), None)


def _vision_id(linked: Mapping[tuple[Level, str], str], car: str) -> str:
    """Follow the links of a car down to its vision object; "" if one is broken. Without roads there are two."""
    below = linked.get(("car", car), "")
    return linked.get(("world", linked.get(("on_road", below), below)), "")


def _by_frame(rows: Iterable[_Row], time: str) -> dict[int, list[_Row]]:
    """Sort rows by the frame that decided them, those of one frame in their order."""
    found: dict[int, list[_Row]] = {}
    for row in rows:
        found.setdefault(getattr(row, time), []).append(row)
    return found


def _relation_change(record: RelationRecord) -> RelationChange:
    old, new = (_VALUES.get(text, text) for text in (record.old, record.new))
    return RelationChange(record.name, record.args, record.t_us, record.decided_us, old, new)
