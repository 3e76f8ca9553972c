"""How do the engines hang together? The only place where they are wired into one stream graph.

::

    frames ── vision ──> vision_objects ─┐
                                         ├── anchoring ──> cars ── qsr ──> relations ── chronicles ──> occurrences
    trajectories ────────────────────────┘

Each arrow is a DyKnow stream, each name on it a process. A sample carries a whole frame, so the middleware costs a few
function calls a frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from anchoring.adapter import AnchoringUnit
from anchoring.anchorer import Anchorer
from chronicles.adapter import RecognitionUnit
from chronicles.chronicle_set import ChronicleSet
from chronicles.recogniser import Recogniser
from dyknow.node import Node
from dyknow.policy import Order, Policy
from dyknow.stream import StreamGenerator
from gis.road_network import RoadNetwork
from gis.turns import turns
from qsr.adapter import RelationUnit
from qsr.observer import RelationObserver
from qsr.relations import RANK
from qsr.settings import RelationSettings
from vision.adapter import VisionUnit
from vision.fixed_camera import FixedCameraVision

FRAMES, OBJECTS, CARS, RELATIONS, OCCURRENCES = "frames", "vision_objects", "cars", "relations", "occurrences"

# Every stage sees each time once, in order: a repeated or late frame is dropped and counted at the first hop.
IN_ORDER = Policy(order=Order.STRICT)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """Hold a wired node and the stream that its host feeds."""

    node: Node
    source: StreamGenerator


def video_pipeline(
    vision: FixedCameraVision,
    network: RoadNetwork | None,
    chronicle_set: ChronicleSet,
    *,
    clock: Callable[[], int],
) -> Pipeline:
    """Wire the whole chain from video frames to occurrences; the source takes `vision.frames.Frame` values."""
    node = Node(clock)
    source = node.add_source(FRAMES)
    node.add_refinement(OBJECTS, VisionUnit(vision), of=FRAMES, policy=IN_ORDER)
    _wire_reasoning(node, network, chronicle_set)
    return Pipeline(node, source)


def trajectory_pipeline(
    network: RoadNetwork | None, chronicle_set: ChronicleSet, *, clock: Callable[[], int]
) -> Pipeline:
    """Wire the chain after vision; the source takes `service.trajectories.TrajectoryObjects` values."""
    node = Node(clock)
    source = node.add_source(OBJECTS)
    _wire_reasoning(node, network, chronicle_set)
    return Pipeline(node, source)


def watched_relations(chronicle_set: ChronicleSet) -> tuple[str, ...]:
    """List the relations that some chronicle looks at, in alphabetical order; no other is computed."""
    return tuple(sorted(RANK.keys() & frozenset().union(*(plan.consumes for plan in chronicle_set.plans))))


def _wire_reasoning(node: Node, network: RoadNetwork | None, chronicle_set: ChronicleSet) -> None:
    settings = RelationSettings()
    observer = _observer(network, settings, watched_relations(chronicle_set))
    # Relations are dated back to the moment they changed, so the recogniser waits that long for late changes.
    recogniser = Recogniser(chronicle_set, lateness_us=settings.backdate_us)
    node.add_refinement(CARS, AnchoringUnit(Anchorer(network)), of=OBJECTS, policy=IN_ORDER)
    node.add_refinement(RELATIONS, RelationUnit(observer), of=CARS, policy=IN_ORDER)
    node.add_refinement(
        OCCURRENCES, RecognitionUnit(recogniser, horizon_us=settings.backdate_us), of=RELATIONS, policy=IN_ORDER
    )


def _observer(network: RoadNetwork | None, settings: RelationSettings, only: Sequence[str]) -> RelationObserver:
    if network is None:
        return RelationObserver((), (), settings, only=only)
    return RelationObserver(
        [road.id for road in network.roads],
        [junction.id for junction in network.junctions],
        settings,
        only=only,
        lanes=[(lane.id, lane.direction) for lane in network.lanes],
        turns=turns(network) if "turn" in only else (),
    )
