"""Small hand-made traffic, driven through the roads, the relations and the chronicles of the library."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from chronicles import library
from chronicles.events import Event
from chronicles.recogniser import Recogniser
from gis.roads.lanes import Lane
from gis.roads.road_network import RoadNetwork
from gis.roads.turns import turns
from qsr.changes.crossings import Value
from qsr.measuring.footprints import Footprints
from qsr.observer import RelationObserver
from qsr.relations import RANK
from qsr.settings import RelationSettings

FloatArray = NDArray[np.float64]

# Seconds, x and y in metres: where a car is when; in between it drives smoothly.
Knots = Sequence[tuple[float, float, float]]

_PERIOD_US = 80_000
_LENGTH_M, _WIDTH_M = 4.5, 1.8


def straight_road(*, lanes_each_way: int = 1, length_m: float = 1000.0) -> RoadNetwork:
    """Build a road that runs east along the x axis, lanes 3.5 m wide; eastbound traffic keeps to negative y."""
    lanes = []
    for index in range(lanes_each_way):
        y_m = 1.75 + 3.5 * index
        east, west = np.array([[0.0, -y_m], [length_m, -y_m]]), np.array([[length_m, y_m], [0.0, y_m]])
        lanes.append(Lane(f"east{index}", "east", index, "road", +1, east, 3.5, 25.0))
        lanes.append(Lane(f"west{index}", "west", index, "road", -1, west, 3.5, 25.0))
    return RoadNetwork(lanes)


def at_speed(speed_mps: float, start_m: float, y_m: float, *, seconds: float) -> Knots:
    """Drive straight east (west if the speed is negative)."""
    return [(0.0, start_m, y_m), (seconds, start_m + speed_mps * seconds, y_m)]


def found(network: RoadNetwork, cars: Mapping[str, Knots], names: Sequence[str], *, seed: int | None) -> list[str]:
    """List what the named chronicles find, as "name role=value ...", in order of time.

    With a seed positions, headings and speeds are noisy, as from a good tracker; without they are exact.
    """
    settings = RelationSettings()
    chronicles = library.load_library(names)
    asked_for = RANK.keys() & frozenset().union(*(plan.consumes for plan in chronicles.plans))
    observer = RelationObserver(
        [road.id for road in network.roads],
        [junction.id for junction in network.junctions],
        settings,
        only=asked_for,
        lanes=[(lane.id, lane.direction) for lane in network.lanes],
        turns=turns(network),
    )
    recogniser = Recogniser(chronicles, lateness_us=settings.backdate_us)
    occurrences = []
    for frame in _frames(network, cars, seed):
        for change in observer.observe(frame):
            event = Event(change.name, change.args, change.t_us, _text(change.old), _text(change.new))
            occurrences += recogniser.observe(event)
        occurrences += recogniser.advance(frame.t_us)
    occurrences += recogniser.advance(frame.t_us + settings.backdate_us)
    return [
        " ".join([event.name, *(f"{role}={value}" for role, value in one.roles.items())])
        for one in occurrences
        for event in one.emitted
        if event.name in names
    ]


def _text(value: Value) -> str:
    return {True: "true", False: "false", None: "unknown"}[value] if not isinstance(value, str) else value


def _frames(network: RoadNetwork, cars: Mapping[str, Knots], seed: int | None) -> list[Footprints]:
    rng = np.random.default_rng(seed)
    sigma = 0.0 if seed is None else 1.0
    paths = {name: _Path(knots) for name, knots in cars.items()}
    last_us = max(path.end_us for path in paths.values())
    frames = []
    for t_us in range(0, last_us + 1, _PERIOD_US):
        present = [name for name, path in paths.items() if path.start_us <= t_us <= path.end_us]
        states = np.array([paths[name].state(t_us) for name in present]).reshape(len(present), 4)
        states += sigma * rng.normal(0.0, [0.1, 0.1, 0.01, 0.2], states.shape)
        frames.append(footprints_at(network, t_us, present, states))
    return frames


def footprints_at(network: RoadNetwork, t_us: int, ids: Sequence[str], states: FloatArray) -> Footprints:
    """Lay out cars of one size; states are (n, 4): x, y, heading and speed."""
    at = network.locate(states[:, :2])
    return Footprints.of(
        t_us=t_us,
        ids=tuple(ids),
        centre_m=states[:, :2],
        heading_rad=states[:, 2],
        speed_mps=np.maximum(states[:, 3], 0.0),
        length_m=np.full(len(ids), _LENGTH_M),
        width_m=np.full(len(ids), _WIDTH_M),
        road=at.road,
        along_m=at.along_m,
        across_m=at.across_m,
        tangent_rad=at.tangent_rad,
        junction=at.junction,
        lane=at.lane,
    )


class _Path:
    """A smooth drive through knots; a car that stands keeps its heading."""

    def __init__(self, knots: Knots) -> None:
        times_s, *xy_m = (np.array(column) for column in zip(*knots, strict=True))
        self.start_us, self.end_us = round(times_s[0] * 1e6), round(times_s[-1] * 1e6)
        self._position = PchipInterpolator(times_s, np.stack(xy_m, axis=1))
        self._velocity = self._position.derivative()
        self._heading_rad = 0.0

    def state(self, t_us: int) -> tuple[float, float, float, float]:
        """Give x, y, heading and speed; times rise from call to call."""
        (x_m, y_m), (vx, vy) = self._position(t_us * 1e-6), self._velocity(t_us * 1e-6)
        if np.hypot(vx, vy) > 0.3:
            self._heading_rad = float(np.arctan2(vy, vx))
        return x_m, y_m, self._heading_rad, float(np.hypot(vx, vy))
