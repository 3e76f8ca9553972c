"""Where is every body in this frame, seen or predicted, and where is that on the roads?

A car that nobody sees drives on along its road at constant speed; off the roads, straight on.
"""

from dataclasses import dataclass

import numpy as np

from anchoring.linking.bodies import ACROSS, ALONG, HEADING, NOW, TANGENT, VX, VY, Bodies, X, Y, looks_of
from anchoring.linking.routes import LaneRoutes
from anchoring.linking.ways import Looks, front_as
from anchoring.observations import DECIMALS, BoolArray, FloatArray, IntArray, LongArray, Observations, nowhere
from anchoring.settings import AnchoringSettings
from gis.polyline import ReferenceLines
from gis.roads.road_network import RoadNetwork, RoadPositions


@dataclass(slots=True)
class Frame:
    """Hold all bodies at one time; column k is that of `Bodies`.

    Attributes
    ----------
    t_us : time.
    is_seen : (n,) True where a vision object was observed; the rest is predicted.
    expected_m : (2, n) where each body was expected from its last state.
    state : (8, n) rows as in `Bodies.states`.
    clipped, length_m, width_m : (n,) as observed; of unseen bodies, what is known of them.
    sigma_m : (n,) as observed; nan of unseen bodies.
    has_front : (n,) False where the front may be the other end.
    places : (3, n) int32 road, lane and junction, -1 for none.
    """

    t_us: int
    is_seen: BoolArray
    expected_m: FloatArray
    state: FloatArray
    clipped: BoolArray
    length_m: FloatArray
    width_m: FloatArray
    sigma_m: FloatArray
    has_front: BoolArray
    places: IntArray

    def looks(self, columns: LongArray) -> Looks:
        """Lay out what some bodies look like now, for comparison with others."""
        return looks_of(
            np.full(len(columns), self.t_us),
            self.state[:, columns],
            self.places[0, columns],
            np.stack([self.length_m[columns], self.width_m[columns]]),
            is_whole=~self.clipped[columns],
            has_front=self.has_front[columns],
        )

    def positions(self, columns: LongArray) -> RoadPositions:
        """Lay out the road positions of some bodies."""
        return RoadPositions(
            road=self.places[0, columns],
            along_m=self.state[ALONG, columns],
            across_m=self.state[ACROSS, columns],
            lane=self.places[1, columns],
            junction=self.places[2, columns],
            tangent_rad=self.state[TANGENT, columns],
        )


class RoadMap:
    """Locate and predict bodies on a road network, or in free space where there is none.

    Parameters
    ----------
    network : None if nothing is known about roads.
    settings : how far outside the lanes still is on the road, and how long a change of lane goes on.

    Attributes
    ----------
    has_roads : whether any are known.
    routes : ways along the lanes.
    """

    __slots__ = ("_lines", "_network", "_settings", "has_roads", "routes")

    def __init__(self, network: RoadNetwork | None, settings: AnchoringSettings) -> None:
        self._network = network
        self._lines = None if network is None else network.reference_lines
        self._settings = settings
        self.has_roads = network is not None
        self.routes = LaneRoutes(network)

    def frame(self, bodies: Bodies, observations: Observations, columns: LongArray) -> Frame:
        """Bring together what is seen and what is predicted.

        Parameters
        ----------
        bodies : before this frame.
        observations : of this frame.
        columns : (k,) column of the body of each vision object.
        """
        t_us = observations.t_us
        state, turn_rad = self._moved(bodies, t_us)
        frame = Frame(
            t_us=t_us,
            is_seen=np.zeros(len(bodies), dtype=np.bool_),
            expected_m=state[X : Y + 1].copy(),
            state=state,
            clipped=bodies.was_clipped[NOW].copy(),
            length_m=bodies.length_m.copy(),
            width_m=bodies.width_m.copy(),
            sigma_m=np.full(len(bodies), np.nan),
            has_front=np.ones(len(bodies), dtype=np.bool_),
            places=np.full((3, len(bodies)), -1, dtype=np.int32),
        )
        seen = observations.observed
        columns = columns[seen]
        frame.is_seen[columns] = True
        state[X : Y + 1, columns] = observations.centre_m[seen].T
        state[VX : VY + 1, columns] = observations.velocity_mps[seen].T
        frame.has_front[columns] = has_front = bodies.knows_front(columns, state[VX : VY + 1, columns])
        is_guess = bodies.has_moved[columns] & ~has_front
        state[HEADING, columns] = front_as(observations.heading_rad[seen], state[HEADING, columns], is_guess)
        frame.clipped[columns] = observations.clipped[seen]
        frame.length_m[columns] = observations.length_m[seen]
        frame.width_m[columns] = observations.width_m[seen]
        frame.sigma_m[columns] = observations.sigma_m[seen]
        _turn(state, np.where(frame.is_seen, 0.0, turn_rad))
        self._locate(frame, slice(None))
        return frame

    def predict_again(self, bodies: Bodies, frame: Frame, column: int) -> None:
        """Replace what was seen of a body by a prediction, since it was seen of another vehicle."""
        state, turn_rad = self._moved(bodies, frame.t_us)
        _turn(state, turn_rad)
        frame.is_seen[column] = False
        frame.state[:, column] = state[:, column]
        frame.length_m[column], frame.width_m[column] = bodies.length_m[column], bodies.width_m[column]
        self._locate(frame, np.array([column]))

    def points(self, road: IntArray, along_m: FloatArray, across_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find points of roads, (2, k), and their tangents there, (k,)."""
        assert self._lines is not None  # there is no road without
        return self._lines.points(road, along_m, across_m)

    def _moved(self, bodies: Bodies, t_us: int) -> tuple[FloatArray, FloatArray]:
        state = bodies.states[NOW].copy()
        elapsed_s = (t_us - bodies.states_us[NOW]) * 1e-6
        centre_m, turn_rad = predict(
            state, bodies.roads[NOW], elapsed_s, self._lines, lateral_s=self._settings.lateral_s
        )
        state[X : Y + 1] = centre_m
        return state, turn_rad

    def locate(self, centre_m: FloatArray) -> RoadPositions:
        """Find where points, (k, 2), are on the roads."""
        if self._network is None:
            return nowhere(len(centre_m))
        return self._network.locate(centre_m, tolerance_m=self._settings.road_tolerance_m)

    def _locate(self, frame: Frame, columns: LongArray | slice) -> None:
        at = self.locate(frame.state[X : Y + 1, columns].T.round(DECIMALS))  # as it is told
        for row, values in (ALONG, at.along_m), (ACROSS, at.across_m), (TANGENT, at.tangent_rad):
            frame.state[row, columns] = values
        for row, place in enumerate((at.road, at.lane, at.junction)):
            frame.places[row, columns] = place


def predict(
    state: FloatArray, road: IntArray, elapsed_s: FloatArray, lines: ReferenceLines | None, *, lateral_s: float
) -> tuple[FloatArray, FloatArray]:
    """Predict bodies from when they were last seen.

    Parameters
    ----------
    state : (8, n) rows x, y, vx, vy, heading, along, across, tangent, as in `anchoring.linking.bodies`.
    road : (n,) -1 for none.
    elapsed_s : (n,) seconds since then.
    lines : the roads' reference lines; None if there are no roads.
    lateral_s : a change of lane that has begun goes on for about this long.

    Returns
    -------
    (2, n) centres, and (n,) turns: by how much heading and velocity have turned with the road.
    """
    centre_m = state[:2] + state[2:4] * elapsed_s
    turn_rad = np.zeros(len(elapsed_s))
    rows = (road >= 0).nonzero()[0]
    if lines is None or not len(rows):
        return centre_m, turn_rad
    then = state.take(rows, axis=1)
    _, _, vx, vy, _, along_m, across_m, tangent_rad = then
    elapsed_s = elapsed_s.take(rows)
    cos, sin = np.cos(tangent_rad), np.sin(tangent_rad)
    ahead_m = (vx * cos + vy * sin) * elapsed_s
    aside_m = (vy * cos - vx * sin) * lateral_s * -np.expm1(-elapsed_s / lateral_s)
    # Only the difference of two points of the line is used, so a prediction starts exactly where the car was.
    road, count = road.take(rows), len(rows)
    points_m, line_rad = lines.points(
        np.concatenate((road, road)),
        np.concatenate((along_m, along_m + ahead_m)),
        np.concatenate((across_m, across_m + aside_m)),
    )
    centre_m[:, rows] = then[:2] + points_m[:, count:] - points_m[:, :count]
    turn_rad[rows] = line_rad[count:] - line_rad[:count]
    return centre_m, turn_rad


def _turn(state: FloatArray, turn_rad: FloatArray) -> None:
    """Turn headings and velocities with the road."""
    if not turn_rad.any():
        return
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    vx, vy = state[VX].copy(), state[VY].copy()
    state[VX], state[VY] = vx * cos - vy * sin, vx * sin + vy * cos
    state[HEADING] = np.angle(np.exp(1j * (state[HEADING] + turn_rad)))
