"""How do the engines hang together? Which streams there are is declared in KPL; here its names are bound to engines.

::

    frames ── vision ──> vision_objects ─┐
                                         ├── anchoring ──> cars ── qsr ──> relations ── chronicles ──> occurrences
    trajectories ────────────────────────┘                   │           ├──> states ──> verdicts ──┘
                                                             └───────────┘

`traffic.kpl` declares this for video, `trajectories.kpl` for the objects of somebody else's tracker; a user may give
another text. A sample carries a whole frame, so the middleware costs a few function calls a frame.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from typing import Any  # a sample carries whatever its stream was declared to carry

from anchoring.adapter import AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.hypotheses.language import LinkageText
from anchoring.settings import AnchoringSettings
from chronicles.chronicle_set import ChronicleSet
from chronicles.execution.limits import USUAL as USUAL_LIMITS
from chronicles.execution.limits import Limits
from chronicles.recogniser import Recogniser
from dyknow.kpl.loader import DeclaredStream, Deployment, load_kpl
from dyknow.node import Node
from dyknow.registry import Registry
from dyknow.sample import Sample
from gis.roads.road_network import RoadNetwork
from qsr.adapter import RelationUnit
from qsr.relations import RANK
from qsr.settings import RelationSettings
from service.errors import InputError
from service.records.runs import SourceText
from service.runs.graph.relations import relation_observer
from service.runs.graph.stream_processes import (
    MonitoredRecognitionUnit,
    MonitoringUnit,
    StandingEvents,
    SynchronisationUnit,
)
from service.texts.monitor_files import NO_MONITORS, LoadedMonitors
from vision.adapter import Vision, VisionUnit

VIDEO, TRAJECTORIES = "video", "trajectories"
OBJECTS, CARS, RELATIONS, STATE = "VisionObjects", "Cars", "Relations", "State"
VERDICT, OCCURRENCE = "Verdict", "Occurrence"


@dataclass(frozen=True, slots=True)
class Feed:
    """What an input gives to a pipeline.

    Attributes
    ----------
    source : name of the registered source that takes the samples.
    values : oldest first, each with its time as `t_us`; may be taken once.
    vision : what looks at the values; None where these are objects already.
    notes : says what people should know, once the values were taken.
    """

    source: str
    values: Iterable[Any] = ()  # Any: what the source takes
    vision: Vision[Any] | None = None
    notes: Callable[[], Iterable[str]] = tuple

    @property
    def samples(self) -> Iterator[Sample[Any]]:
        """The values as samples that are available at their own time."""
        return (Sample(one.t_us, one.t_us, one) for one in self.values)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """Hold what a KPL text has created in a node, ready to be fed.

    Attributes
    ----------
    feed : what the host publishes, and to which source.
    output_of : the type that each source and unit gives, by name.
    recognition : what recognises chronicles, one for each process of the text that does.
    make_recogniser : makes such a recogniser of other chronicles.
    """

    kpl: SourceText
    deployment: Deployment
    feed: Feed
    output_of: dict[str, str]
    recognition: list[MonitoredRecognitionUnit]
    make_recogniser: Callable[[ChronicleSet], Recogniser]

    @property
    def is_shipped(self) -> bool:
        """Whether the streams are those that come with the package."""
        return self.kpl.text == shipped_kpl(self.feed.source).text

    @property
    def node(self) -> Node:
        """Return the node that runs the pipeline."""
        return self.deployment.node

    def publish_in_steps(self, sample: Sample[Any]) -> Iterator[None]:
        """Feed one frame to every stream that is made of the source; see `StreamGenerator.publish_in_steps`."""
        for stream in self.deployment.publishers(self.feed.source):
            yield from stream.publish_in_steps(sample)

    def type_of(self, label: str) -> str:
        """Name the type of a label as the host does; what is no host code has the type that the text says, or none."""
        made_of = self.deployment.made_of.get(label, "")
        return self.output_of.get(made_of) or self.deployment.types.get(label, "")

    def stream(self, name: str, value_type: str | None) -> DeclaredStream | None:
        """Give a declared stream that carries values of a type, or any; None if the text declares none of the name.

        Raises
        ------
        InputError
            If it carries something else.
        """
        stream = self.deployment.streams.get(name)
        if stream is None:
            return None
        found = self.type_of(stream.label)
        if value_type not in (None, found):
            raise InputError(f"{self.kpl.name}: stream {name!r}: expected values of type {value_type}, got {found}")
        return stream


@dataclass(frozen=True, slots=True)
class EngineSettings:
    """Hold the settings of the engines behind vision.

    Attributes
    ----------
    linkage : what anchoring links to what; None: as usual.
    limits : what each chronicle may cost.
    early_events : events that rest on open hypotheses are told as tentative; else only when they are decided.
    watches_all : every relation is computed, for chronicles that may come while the run goes on.
    """

    anchoring: AnchoringSettings = field(default_factory=AnchoringSettings)
    relations: RelationSettings = field(default_factory=RelationSettings)
    linkage: LinkageText | None = None
    limits: Limits = USUAL_LIMITS
    early_events: bool = True
    watches_all: bool = False


USUAL = EngineSettings()


def shipped_kpl(source: str) -> SourceText:
    """Give the declaration that comes with the package for a kind of source."""
    name = "traffic.kpl" if source == VIDEO else "trajectories.kpl"
    return SourceText(name, files("service.runs.graph").joinpath(name).read_text(encoding="utf-8"))


def declared_pipeline(
    feed: Feed,
    network: RoadNetwork | None,
    chronicle_set: ChronicleSet,
    monitors: LoadedMonitors = NO_MONITORS,
    *,
    kpl: SourceText | None = None,
    settings: EngineSettings = USUAL,
    clock: Callable[[], int],
) -> Pipeline:
    """Create the pipeline that a text declares for what is fed: the text of the user, or the shipped one.

    Parameters
    ----------
    feed : only the source and its vision matter; nothing is published yet.

    Raises
    ------
    InputError
        If nothing in the text takes what is fed, or something would be told of frames that there are none.
    KplError
        If the text is wrong.
    """
    text = kpl or shipped_kpl(feed.source)
    # Relations are dated back to the moment they changed; what reads them waits that long for late changes.
    wait_us = settings.relations.backdate_us
    make_recogniser = partial(
        Recogniser,
        lateness_us=wait_us,
        early=settings.early_events,
        patience_us=wait_us // 2,  # so long early events wait for verdicts
        limits=settings.limits,
    )
    recognition: list[MonitoredRecognitionUnit] = []

    def recognising() -> MonitoredRecognitionUnit:
        """Make what recognises, and remember it."""
        unit = MonitoredRecognitionUnit(make_recogniser(chronicle_set), chronicle_set.names, horizon_us=wait_us)
        recognition.append(unit)
        return unit

    registry = _host_code(feed, network, chronicle_set, monitors, settings)
    registry.unit("chronicles", inputs=(RELATIONS, VERDICT), output=OCCURRENCE)(recognising)
    deployment = load_kpl(text.text, registry, Node(clock, registry), name=text.name)
    if monitors.events and text.text != shipped_kpl(feed.source).text:
        events = ", ".join(sorted(monitors.events))
        raise InputError(f"{text.name}: expected the shipped streams for monitors that look at {events}, got others")
    if not deployment.publishers(feed.source):
        raise InputError(f"{text.name}: expected a process made of the source {feed.source!r}, got none")
    _refuse_gaps(text, deployment)
    output_of = {name: one.output for one_kind in (registry.sources, registry.units) for name, one in one_kind.items()}
    return Pipeline(text, deployment, feed, output_of, recognition, make_recogniser)


def watched_relations(
    chronicle_set: ChronicleSet, monitors: LoadedMonitors = NO_MONITORS, *, watches_all: bool = False
) -> tuple[str, ...]:
    """List the relations that some chronicle or monitor looks at, or all, by name; no other is computed."""
    if watches_all:
        return tuple(sorted(RANK))
    consumed = monitors.relations.union(*(plan.consumes for plan in chronicle_set.plans))
    return tuple(sorted(RANK.keys() & consumed))


def _refuse_gaps(text: SourceText, deployment: Deployment) -> None:
    """Refuse sampling that puts `no_value` between frames: the engines take frames, not their absence."""
    for process in deployment.node.report():
        for label, policy in zip(process.inputs, process.policies, strict=True):
            if "sample every" in policy and "use most recent" not in policy:
                raise InputError(
                    f"{text.name}: {process.label!r} reading {label!r}: "
                    f"expected 'use most recent' with 'sample every', got {policy!r}"
                )


def _host_code(
    feed: Feed,
    network: RoadNetwork | None,
    chronicle_set: ChronicleSet,
    monitors: LoadedMonitors,
    settings: EngineSettings,
) -> Registry:
    """Offer the source, what looks at it, and everything that follows up to the verdicts."""
    watched = watched_relations(chronicle_set, monitors, watches_all=settings.watches_all)
    wait_us = settings.relations.backdate_us
    registry = Registry()
    if feed.vision is None:
        registry.source(feed.source, output=OBJECTS)
    else:
        registry.source(feed.source, output="Frame")
        registry.unit("vision", inputs=("Frame",), output=OBJECTS)(partial(VisionUnit, feed.vision))
    # Names that come with a file are somebody's word for what is the same; our own tracker's are never used again.
    registry.unit("anchoring", inputs=(OBJECTS,), output=CARS)(
        lambda: AnchoringUnit(
            Anchorer(network, settings.anchoring, linkage=settings.linkage, trusts_ids=feed.vision is None)
        )
    )
    registry.unit("qsr", inputs=(CARS,), output=RELATIONS)(
        lambda: RelationUnit(relation_observer(network, settings.relations, watched))
    )
    features = monitors.features if monitors.definitions else None
    standing = StandingEvents(chronicle_set, monitors.events, lag_us=wait_us, limits=settings.limits)
    registry.unit("synchronisation", inputs=(CARS, RELATIONS), output=STATE)(
        lambda: SynchronisationUnit(features, network, standing, lag_us=wait_us)
    )
    registry.unit("monitoring", inputs=(STATE,), output=VERDICT)(
        lambda: MonitoringUnit(monitors, standing, lag_us=wait_us)
    )
    return registry
