"""How far is it from here to there along the lanes, where can a vehicle come out, and who is the next one ahead?

The lanes of the network and, numbered on after them, the ways through junctions (`RoadNetwork.connections`) are the
nodes of a directed graph; its edges lead from each lane to those that follow it. Lanes of one edge are driven as one:
a vehicle may change between them at no cost, as it may in reality, so they are taken to be equally long.

The distances between all lanes are worked out once. Those between places are look-ups in arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Self

import networkx as nx
import numpy as np
import shapely
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree
from shapely.ops import substring

from gis.polyline import FloatArray, GeometryArray, IndexArray, IntArray
from gis.roads.lanes import border_gap
from gis.roads.road_network import RoadNetwork, RoadPositions

# Ways through junctions are looked up by points this far apart; the place on them is exact.
_SAMPLE_M = 2.0
# One radian between the headings counts as so many metres.
_HEADING_M = 5.0
# A vehicle is on a way through a junction that passes as near, heading counted in: about half a lane and 20 degrees.
_REACH_M = 2.2
# So many ways lie on top of each other where they part and meet; each has up to three samples in reach.
_WAYS, _NEAREST = 3, 9
_IS_BEFORE = np.tri(_NEAREST, k=-1, dtype=np.bool_)
# Up to here looking up every way on which two places may be is quicker than asking first for which pairs it is needed.
_FEW_PAIRS = 100
# The distances between all of so many lanes take 32 MB; those of a whole city would take gigabytes.
_MOST_LANES = 2000
# Who may turn off is taken to go straight on, by less than that. Roundabouts are left at 40 degrees or more.
_STRAIGHT_RAD = math.radians(30.0)
# Vertices of a change of lanes.
_CHANGE_STEPS = 12


@dataclass(frozen=True, slots=True, eq=False)
class LanePlaces:
    """Places on a lane graph, each with the lanes on which it may be: one on a road, several where ways overlap.

    Attributes
    ----------
    lane : (n, k) number in the graph, the likeliest first; -1 for none.
    along_m : (n, k) from the start of the lane, in driving direction.
    """

    lane: IntArray
    along_m: FloatArray

    @classmethod
    def of(cls, lane: ArrayLike, along_m: ArrayLike) -> LanePlaces:
        """Make places from one lane and one distance each, (n,)."""
        return cls(np.array(lane, dtype=np.int32)[:, None], np.array(along_m, dtype=np.float64)[:, None])

    def take(self, rows: ArrayLike) -> LanePlaces:
        """Keep some of the places, in the order of their rows."""
        return LanePlaces(self.lane[np.asarray(rows)], self.along_m[np.asarray(rows)])


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """A way from one place to another.

    Attributes
    ----------
    lanes : numbers in the graph; a change of lanes on the way shows two lanes of one edge side by side.
    line_m : (k, 2) from place to place.
    """

    lanes: tuple[int, ...]
    line_m: FloatArray

    def points(self, share: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Find points on the route.

        Parameters
        ----------
        share : (n,) of its length, 0 to 1.

        Returns
        -------
        (n, 2) points and (n,) headings there.
        """
        step_m = np.diff(self.line_m, axis=0)
        along_m = np.concatenate(([0.0], np.hypot(*step_m.T).cumsum()))
        at_m = np.asarray(share, dtype=np.float64) * along_m[-1]
        step_east_m, step_north_m = step_m[(along_m.searchsorted(at_m, side="right") - 1).clip(0, len(step_m) - 1)].T
        points_m = np.column_stack([np.interp(at_m, along_m, axis_m) for axis_m in self.line_m.T])
        return points_m, np.arctan2(step_north_m, step_east_m)


class LaneGraph:
    """The lanes of a network, and where each leads.

    Parameters
    ----------
    network : a map without connections has no ways from lane to lane, only distances on one edge.
    keep_lanes : True for the distances of vehicles that do not change lanes.

    Attributes
    ----------
    graph : nodes are numbers of lanes: those of `network.lanes`, then one for each of `network.connections`. Edges have
        `length_m` and `time_s` (at the speed limit) of the lane that they lead away from.
    lines_m : centre line of each lane, (n, 2) in driving direction.
    length_m : (lanes,) of the lines.

    Examples
    --------
    >>> from gis.roads.lanes import Connection, Lane
    >>> one = Lane("one", "one", 0, "one", +1, np.array([[0.0, 0.0], [50.0, 0.0]]), 3.5, 10.0)
    >>> two = Lane("two", "two", 0, "two", +1, np.array([[60.0, 10.0], [60.0, 90.0]]), 3.5, 10.0)
    >>> bend = Connection("one", "two", "x", np.array([[50.0, 0.0], [60.0, 0.0], [60.0, 10.0]]), 5.0)
    >>> graph = LaneGraph(RoadNetwork([one, two], connections=[bend]))
    >>> start, ends = LanePlaces.of([0], [40.0]), LanePlaces.of([1, 2], [5.0, 15.0])
    >>> graph.distances_m(start, ends).tolist(), graph.travel_times_s(start, ends).tolist()
    ([[35.0, 25.0]], [[5.5, 4.0]])
    >>> graph.distances_m(ends, start).tolist()                 # nothing leads back
    [[inf], [inf]]
    >>> graph.route(start, ends.take([0])).points([0.0, 0.5, 1.0])[0].tolist()
    [[40.0, 0.0], [57.5, 0.0], [60.0, 15.0]]
    """

    def __init__(self, network: RoadNetwork, *, keep_lanes: bool = False) -> None:
        lanes, ways = network.lanes, network.connections
        self._ways = len(lanes)
        self._ends = [(network.lane_index[way.from_lane], network.lane_index[way.to_lane]) for way in ways]
        ways_m = [
            np.array([lanes[start].centre_line_m[-1], lanes[end].centre_line_m[0]]) if way.via_m is None else way.via_m
            for way, (start, end) in zip(ways, self._ends, strict=True)
        ]
        self.lines_m = (*(lane.centre_line_m for lane in lanes), *ways_m)
        self._lines: GeometryArray = np.array([shapely.LineString(line_m) for line_m in self.lines_m])
        self.length_m: FloatArray = np.asarray(shapely.length(self._lines))
        self._s_per_m = 1.0 / np.array(
            [*(lane.speed_limit_mps for lane in lanes), *(way.speed_limit_mps for way in ways)]
        )
        # Lanes that are driven as one have one number; the last is for no lane.
        edges = list(dict.fromkeys(lane.id if keep_lanes else lane.edge for lane in lanes))
        number = {edge: place for place, edge in enumerate(edges)}
        of_lanes = [number[lane.id if keep_lanes else lane.edge] for lane in lanes]
        self._edge = np.array([*of_lanes, *range(len(edges), len(edges) + len(ways)), -1])
        self._is_forward = np.array([lane.direction > 0 for lane in lanes])
        self._opposite = _opposite_lanes(network)
        # Between which ends of roads each lane leads: whose are the same the other way round is its other direction.
        self._leads = [((lane.road, -lane.direction), (lane.road, lane.direction)) for lane in lanes]
        self._leads += [(self._leads[start][1], self._leads[end][0]) for start, end in self._ends]
        self.graph = self._build_graph()
        # Points along the ways through junctions, in a tree over place and heading.
        self._sampled: IntArray = np.zeros(0, dtype=np.int32)
        self._tree: KDTree | None = None
        if ways:
            counts = 1 + np.ceil(self.length_m[self._ways :] / _SAMPLE_M).astype(np.int64)
            samples = [Route((), line_m).points(np.linspace(0, 1, n)) for line_m, n in zip(ways_m, counts, strict=True)]
            numbers = np.arange(self._ways, len(self.lines_m), dtype=np.int32)
            self._sampled = np.append(numbers.repeat(counts), np.int32(-1))
            self._tree = KDTree(np.vstack([_with_heading(*one) for one in samples]))

    @classmethod
    def of(cls, network: RoadNetwork, *, keep_lanes: bool = False) -> Self | None:
        """Make the graph of a map that has connections, and not too many lanes; None of any other one."""
        count = len(network.lanes) + len(network.connections)
        return cls(network, keep_lanes=keep_lanes) if network.connections and count <= _MOST_LANES else None

    def project(self, points_m: FloatArray, heading_rad: FloatArray, at: RoadPositions) -> LanePlaces:
        """Find the places of vehicles.

        Parameters
        ----------
        points_m : (n, 2). heading_rad : (n,).
        at : where they are on the network, (n,).

        Returns
        -------
        On a road: the lane; who drives against it is on the nearest lane of the other direction, or nowhere. Elsewhere:
        the ways through a junction that pass near by in about this direction, or none.
        """
        lane = at.lane.reshape(-1, 1)
        is_forward = np.cos(heading_rad - at.tangent_rad) >= 0.0
        against = ((lane[:, 0] >= 0) & (is_forward != self._is_forward.take(lane[:, 0]))).nonzero()[0]
        if len(against):
            lane = lane.copy()
            lane[against, 0] = self._opposite.take(lane[against, 0])
        off_road = ((at.lane < 0) & np.isfinite(points_m[:, 0] + points_m[:, 1] + heading_rad)).nonzero()[0]
        if len(off_road) and self._tree is not None:
            lane = lane.repeat(_WAYS, axis=1)
            lane[:, 1:] = -1
            lane[off_road] = self._ways_at(self._tree, points_m.take(off_road, axis=0), heading_rad.take(off_road))
        known = (lane.ravel() >= 0).nonzero()[0]
        points = shapely.points(points_m.take(known // lane.shape[1], axis=0))
        along_m = np.zeros(lane.shape)
        along_m.put(known, shapely.line_locate_point(self._lines.take(lane.take(known)), points))
        return LanePlaces(lane, along_m)

    def distances_m(self, starts: LanePlaces, ends: LanePlaces) -> FloatArray:
        """Measure the shortest way from each start to each end.

        Returns
        -------
        (starts, ends) metres in driving direction; inf where no way leads there.
        """
        ways_m: FloatArray = self._between(*_each_with_each(starts, ends), self._lengths_m, np.ones(1)).min(axis=(2, 3))
        return ways_m

    def travel_times_s(self, starts: LanePlaces, ends: LanePlaces) -> FloatArray:
        """Measure the quickest way from each start to each end.

        Returns
        -------
        (starts, ends) seconds at the speed limits; inf where no way leads there.
        """
        times_s: FloatArray = self._between(*_each_with_each(starts, ends), self._times_s, self._s_per_m).min(
            axis=(2, 3)
        )
        return times_s

    def gaps_m(self, places: LanePlaces, pairs: IndexArray) -> FloatArray:
        """Measure the shortest way between pairs of places, there and back.

        Parameters
        ----------
        places : (n,). pairs : (2, pairs) rows.

        Returns
        -------
        (2, pairs) as in `distances_m`, from the first to the second and from the second to the first.
        """
        if places.lane.shape[1] == 1 or pairs.shape[1] <= _FEW_PAIRS:
            return self._there_and_back(places.lane, places.along_m, pairs)
        gaps_m = self._there_and_back(places.lane[:, :1], places.along_m[:, :1], pairs)
        several = np.flatnonzero((places.lane[:, 1] >= 0).take(pairs).any(axis=0))
        gaps_m[:, several] = self._there_and_back(places.lane, places.along_m, pairs.take(several, axis=1))
        return gaps_m

    def _there_and_back(self, lane: IntArray, along_m: FloatArray, pairs: IndexArray) -> FloatArray:
        one, other = lane.take(pairs, axis=0)
        one, other = one[:, :, None], other[:, None, :]
        from_m, to_m = along_m.take(pairs, axis=0)
        ahead_m = to_m[:, None, :] - from_m[:, :, None]
        is_shared = self._edge.take(one) == self._edge.take(other)
        # Flat indices are quicker than pairs; whatever has a -1 in it leads to the last row or column, for no lane.
        sums, stride = self._lengths_m, len(self._lengths_m)
        found = np.array((sums.take(one * stride + other) + ahead_m, sums.take(other * stride + one) - ahead_m))
        if is_shared.any():
            is_shared &= one >= 0
            np.copyto(found[0], ahead_m, where=is_shared & (ahead_m >= 0.0))
            np.copyto(found[1], -ahead_m, where=is_shared & (ahead_m <= 0.0))
        gaps_m: FloatArray = found.min(axis=(2, 3))
        return gaps_m

    def facing_m(self, places: LanePlaces, pairs: IndexArray) -> FloatArray:
        """Measure the way between vehicles of which one comes to the other direction of what the other is on.

        Before a fork a vehicle is taken to go straight on, and in a junction to be on its likeliest way; if both are in
        a junction, on any of them.

        Parameters
        ----------
        places : (n,). pairs : (2, pairs) rows.

        Returns
        -------
        (pairs,) metres that both together have to drive until they meet, below zero once they have; inf for all others.
        """
        starts_m, stride = self._facing_m, len(self._facing_m)
        one, other = places.lane[:, 0].take(pairs)
        gaps_m: FloatArray = starts_m.take(one * stride + other) - places.along_m[:, 0].take(pairs).sum(axis=0)
        inside = np.flatnonzero((one >= self._ways) & (other >= self._ways))
        if len(inside):
            one, other = places.lane.take(pairs[:, inside], axis=0)
            one_m, other_m = places.along_m.take(pairs[:, inside], axis=0)
            ways_m = starts_m[one[:, :, None], other[:, None, :]] - one_m[:, :, None] - other_m[:, None, :]
            gaps_m[inside] = ways_m.min(axis=(1, 2))
        return gaps_m

    def exits_within(self, starts: LanePlaces, reach_m: float) -> list[dict[int, float]]:
        """List where each vehicle can come out of a junction: the lane, and how far it is to its start, if in reach."""
        exits = sorted({end for _, end in self._ends})
        distance_m = self.distances_m(starts, LanePlaces.of(exits, np.zeros(len(exits))))
        return [
            {lane: way_m for lane, way_m in zip(exits, row, strict=True) if way_m <= reach_m}
            for row in distance_m.tolist()
        ]

    def next_ahead(self, places: LanePlaces, reach_m: float) -> tuple[IntArray, FloatArray]:
        """Find the next of the places ahead of each, over whatever way.

        Returns
        -------
        (n,) its row, -1 if there is none within reach, and (n,) the distance to it, inf if there is none.
        """
        distance_m = self.distances_m(places, places)
        np.fill_diagonal(distance_m, np.inf)
        distance_m[distance_m > reach_m] = np.inf
        nearest_m = distance_m.min(axis=1, initial=np.inf)
        ahead = distance_m.argmin(axis=1) if len(distance_m) else np.zeros(0)
        return np.where(np.isfinite(nearest_m), ahead, -1).astype(np.int32), nearest_m

    def route(self, start: LanePlaces, end: LanePlaces) -> Route | None:
        """Draw the shortest way from one place to another, (1,) each; None if there is none."""
        ways_m = self._between(*_each_with_each(start, end), self._lengths_m, np.ones(1))[0, 0]
        row, column = np.unravel_index(ways_m.argmin(), ways_m.shape)
        if not math.isfinite(ways_m[row, column]):
            return None
        first, last = int(start.lane[0, row]), int(end.lane[0, column])
        from_m, to_m = float(start.along_m[0, row]), float(end.along_m[0, column])
        path = [first]
        if self._edge[first] != self._edge[last] or to_m < from_m:
            onward = min(self.graph[first], key=lambda lane: 0.0 if lane == last else self._lengths_m[lane, last])
            path += nx.shortest_path(self.graph, onward, last, weight="length_m")
        pairs = self._entered_and_left(path, last)
        ends_m = [*(float(self.length_m[left]) for _, left in pairs[:-1]), to_m]
        starts_m = [from_m, *(0.0 for _ in pairs[1:])]
        parts_m = [self._part(*pair, *span_m) for pair, *span_m in zip(pairs, starts_m, ends_m, strict=True)]
        line_m = np.vstack(parts_m)
        line_m = line_m[np.append(True, np.diff(line_m, axis=0).any(axis=1))]
        lanes = tuple(lane for lane, _ in groupby(lane for pair in pairs for lane in pair))
        return Route(lanes, line_m if len(line_m) > 1 else line_m.repeat(2, axis=0))

    def _build_graph(self) -> nx.DiGraph[int]:
        graph: nx.DiGraph[int] = nx.DiGraph()
        graph.add_nodes_from(range(len(self.lines_m)))
        lengths_m, times_s = self.length_m.tolist(), (self.length_m * self._s_per_m).tolist()
        lanes_of: dict[int, list[int]] = {}
        for lane, edge in enumerate(self._edge[: self._ways].tolist()):
            lanes_of.setdefault(edge, []).append(lane)
        for way, ends in enumerate(self._ends, self._ways):
            before, after = (lanes_of[int(self._edge[lane])] for lane in ends)
            for one, other in [*((lane, way) for lane in before), *((way, lane) for lane in after)]:
                graph.add_edge(one, other, length_m=lengths_m[one], time_s=times_s[one])
        return graph

    @cached_property
    def _lengths_m(self) -> FloatArray:
        return self._least_sums("length_m")

    @cached_property
    def _times_s(self) -> FloatArray:
        return self._least_sums("time_s")

    @cached_property
    def _facing_m(self) -> FloatArray:
        """Add up the way between the starts of every two lanes on which vehicles meet; the last is for no lane."""
        count = len(self.lines_m)
        turned = [way for way in range(self._ways, count) if self._turns_off(way)]
        onward = nx.restricted_view(self.graph, [], list(self.graph.in_edges(turned)))
        sums = dijkstra(nx.to_scipy_sparse_array(onward, range(count), weight="length_m"))
        lanes_of: dict[object, list[int]] = {}
        for lane, leads in enumerate(self._leads):
            lanes_of.setdefault(leads, []).append(lane)
        facing = np.full((count + 1, count + 1), np.inf)
        for lane, (start, end) in enumerate(self._leads):
            back = lanes_of.get((end, start), [])
            facing[:count, lane] = (sums[:, back] + self.length_m[back]).min(axis=1, initial=np.inf)
        return np.asarray(np.minimum(facing, facing.T))

    def _turns_off(self, way: int) -> bool:
        """Tell whether a way through a junction leads off to the side, from a lane that has other ways as well."""
        start, end = self._ends[way - self._ways]
        turn_rad = Route((), self.lines_m[end]).points([0.0])[1][0] - Route((), self.lines_m[start]).points([1.0])[1][0]
        is_fork = len({self._leads[other][1] for other in self.graph[start]}) > 1
        return is_fork and abs(math.remainder(turn_rad, math.tau)) > _STRAIGHT_RAD

    def _least_sums(self, weight: str) -> FloatArray:
        """Add up from the start of each lane to the start of each; the last row and column are for no lane.

        From a lane to itself it is once round.
        """
        count = len(self.lines_m)
        sums = np.full((count + 1, count + 1), np.inf)
        sums[:count, :count] = dijkstra(nx.to_scipy_sparse_array(self.graph, range(count), weight=weight))
        np.fill_diagonal(sums, np.inf)
        for lane in range(count):
            rounds = [step[weight] + sums[after, lane] for after, step in self.graph[lane].items()]
            sums[lane, lane] = min(rounds, default=np.inf)
        return sums

    def _between(self, starts: LanePlaces, ends: LanePlaces, sums: FloatArray, rate: FloatArray) -> FloatArray:
        """Look up all ways between places, whose arrays are broadcast against each other.

        `sums` are metres or seconds, and `rate`, (lanes,) or (1,), how many of them a metre takes.
        """
        start, end = starts.lane, ends.lane
        rate_of_start, rate_of_end = (rate.take(lane, mode="clip") for lane in (start, end))
        ahead_m = ends.along_m - starts.along_m
        is_ahead = (self._edge.take(start) == self._edge.take(end)) & (start >= 0) & (ahead_m >= 0.0)
        onward: FloatArray = sums[start, end] - starts.along_m * rate_of_start + ends.along_m * rate_of_end
        return np.where(is_ahead, ahead_m * rate_of_start, onward)

    def _entered_and_left(self, path: Sequence[int], last: int) -> list[tuple[int, int]]:
        """Name the lanes on which each part of a path begins and ends: on an edge a vehicle may change between them."""
        pairs: list[tuple[int, int]] = []
        entered = path[0]
        for here, after in zip(path, [*path[1:], None], strict=True):
            if here >= self._ways:
                pairs.append((here, here))
                entered = self._ends[here - self._ways][1]
            else:
                pairs.append((entered, last if after is None else self._ends[after - self._ways][0]))
        return pairs

    def _part(self, entered: int, left: int, from_m: float, to_m: float) -> FloatArray:
        """Draw the way along a lane, or evenly from one lane over to another one beside it."""
        if entered == left:
            return shapely.get_coordinates(substring(self._lines[entered], from_m, to_m))
        share = np.linspace(0.0, 1.0, _CHANGE_STEPS)[:, None]
        along_m = from_m + share[:, 0] * (to_m - from_m)
        one_m, other_m = (
            shapely.get_coordinates(shapely.line_interpolate_point(self._lines[lane], along_m))
            for lane in (entered, left)
        )
        return np.asarray((1.0 - share) * one_m + share * other_m)

    def _ways_at(self, tree: KDTree, points_m: FloatArray, heading_rad: FloatArray) -> IntArray:
        """List the nearest ways through junctions, (n, _WAYS)."""
        _, sample = tree.query(_with_heading(points_m, heading_rad), _NEAREST, distance_upper_bound=_REACH_M)
        lane = self._sampled.take(sample)
        is_again = ((lane[:, :, None] == lane[:, None, :]) & _IS_BEFORE).any(axis=2)
        lane[is_again] = -1
        order = (lane < 0).argsort(axis=1, kind="stable")[:, :_WAYS]
        return lane.take(order + _NEAREST * np.arange(len(lane))[:, None])


def _each_with_each(starts: LanePlaces, ends: LanePlaces) -> tuple[LanePlaces, LanePlaces]:
    return (
        LanePlaces(starts.lane[:, None, :, None], starts.along_m[:, None, :, None]),
        LanePlaces(ends.lane[None, :, None, :], ends.along_m[None, :, None, :]),
    )


def _with_heading(points_m: FloatArray, heading_rad: FloatArray) -> FloatArray:
    return np.column_stack((points_m, _HEADING_M * np.cos(heading_rad), _HEADING_M * np.sin(heading_rad)))


def _opposite_lanes(network: RoadNetwork) -> IntArray:
    """Find for each lane the nearest one of the other direction on its road; -1 for none."""
    opposite = np.full(len(network.lanes), -1, dtype=np.int32)
    for road in network.roads:
        members = [network.lanes[network.lane_index[lane]] for lane in road.lanes]
        for lane in members:
            others = [other for other in members if other.direction != lane.direction]
            if others:
                nearest = min(others, key=lambda other: border_gap([lane], [other]))
                opposite[network.lane_index[lane.id]] = network.lane_index[nearest.id]
    return opposite
