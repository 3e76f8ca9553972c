"""The relations, slow and obvious: one ordered pair of objects, one number, one `if` at a time."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from gis.roads.lane_graph import LaneGraph, LanePlaces
from gis.roads.road_network import RoadPositions
from qsr.changes.crossings import RelationChange
from qsr.measuring.footprints import Footprints
from qsr.settings import RelationSettings


@dataclass
class Body:
    x: float
    y: float
    heading: float
    speed: float
    length: float
    width: float
    road: int
    along: float
    across: float
    tangent: float
    junction: int
    lane: int
    observed: bool
    has_moved: bool
    sigma: float


@dataclass
class Hysteresis:
    """One quantity with a threshold at zero."""

    margin: float
    backdate_us: int
    last_t_us: int = 0
    last_value: float = 0.0
    crossed_us: int = 0
    since_us: int = 0
    is_on: bool | None = None

    def update(self, t_us: int, value: float) -> None:
        if self.is_on is None:
            self.is_on, self.since_us, self.crossed_us = value > 0, t_us, t_us
        else:
            if (value > 0) != (self.last_value > 0):
                share = self.last_value / (self.last_value - value)
                self.crossed_us = self.last_t_us + round(share * (t_us - self.last_t_us))
            if (self.is_on and value < -self.margin) or (not self.is_on and value > self.margin):
                self.is_on = not self.is_on
                self.since_us = max(self.crossed_us, t_us - self.backdate_us)
        self.last_t_us, self.last_value = t_us, value


@dataclass
class Pair:
    """The state of an ordered pair."""

    switches: dict[str, Hysteresis]
    values: dict[str, bool] = field(default_factory=dict)
    changed_us: dict[str, int] = field(default_factory=dict)


def turn(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def corners(length: float, width: float) -> list[tuple[float, float]]:
    return [(sx * length / 2, sy * width / 2) for sx in (-1, 1) for sy in (-1, 1)]


def box_distance(body: Body, other: Body) -> float:
    """Distance from a body to the box around the other's corners, in the body's frame."""
    dx, dy = other.x - body.x, other.y - body.y
    c, s = math.cos(body.heading), math.sin(body.heading)
    x, y = dx * c + dy * s, dy * c - dx * s
    delta = other.heading - body.heading
    xs = [px * math.cos(delta) - py * math.sin(delta) for px, py in corners(other.length, other.width)]
    ys = [px * math.sin(delta) + py * math.cos(delta) for px, py in corners(other.length, other.width)]
    gap_x = max(x + min(xs) - body.length / 2, -(x + max(xs)) - body.length / 2, 0.0)
    gap_y = max(y + min(ys) - body.width / 2, -(y + max(ys)) - body.width / 2, 0.0)
    return math.hypot(gap_x, gap_y)


def depth(a: Body, b: Body) -> float:
    """How far one body would have to be pushed out of the other: the least overlap of their shadows on four lines."""
    overlaps = []
    for angle in (one.heading + quarter for one in (a, b) for quarter in (0.0, math.pi / 2)):
        spans = []
        for one in (a, b):
            delta = one.heading - angle
            at = one.x * math.cos(angle) + one.y * math.sin(angle)
            box = corners(one.length, min(one.width, RelationSettings().widest_m))
            reach = max(x * math.cos(delta) - y * math.sin(delta) for x, y in box)
            spans.append((at - reach, at + reach))
        (low, high), (other_low, other_high) = spans
        overlaps.append((high - low + other_high - other_low) / 2 - abs(low + high - other_low - other_high) / 2)
    return min(overlaps)


def contact_time(apart: tuple[float, float], rate: tuple[float, float], reach: tuple[float, float]) -> float:
    """Step through the intervals in which two boxes overlap along each axis; 10 s stands for never."""
    start, end = 0.0, math.inf
    for x, v, r in zip(apart, rate, reach, strict=True):
        if v == 0.0:
            if abs(x) > r:
                return 10.0
            continue
        times = sorted([(-r - x) / v, (r - x) / v])
        start, end = max(start, times[0]), min(end, times[1])
    return min(start, 10.0) if start < end and end > 0 else 10.0


def contact_in_frame_of(body: Body, other: Body) -> float:
    def turned(x: float, y: float) -> tuple[float, float]:
        c, s = math.cos(body.heading), math.sin(body.heading)
        return x * c + y * s, y * c - x * s

    delta = other.heading - body.heading
    box = [
        (px * math.cos(delta) - py * math.sin(delta), px * math.sin(delta) + py * math.cos(delta))
        for px, py in corners(other.length, other.width)
    ]
    reach = body.length / 2 + max(x for x, _ in box), body.width / 2 + max(y for _, y in box)
    return contact_time(turned(other.x - body.x, other.y - body.y), turned(*relative_velocity(body, other)), reach)


def course_overlap(a: Body, b: Body) -> float:
    """How far they overlap, seen along the way in which b moves seen from a."""
    vx, vy = relative_velocity(a, b)
    way = math.atan2(vy, vx)
    away = abs((b.y - a.y) * math.cos(way) - (b.x - a.x) * math.sin(way))
    reach = [
        body.length / 2 * abs(math.sin(body.heading - way)) + body.width / 2 * abs(math.cos(body.heading - way))
        for body in (a, b)
    ]
    return sum(reach) - away


def relative_velocity(a: Body, b: Body) -> tuple[float, float]:
    return (
        b.speed * math.cos(b.heading) - a.speed * math.cos(a.heading),
        b.speed * math.sin(b.heading) - a.speed * math.sin(a.heading),
    )


def is_on_one_road(a: Body, b: Body, settings: RelationSettings) -> bool:
    far = 2 * max(settings.leave_radius_m, math.hypot(a.x - b.x, a.y - b.y))
    return a.road == b.road and a.road >= 0 and abs(a.along - b.along) <= far


def distance_of(a: Body, b: Body) -> float:
    return math.hypot(a.x - b.x, a.y - b.y) - a.length / 2 - b.length / 2


def is_near(a: Body, b: Body, settings: RelationSettings, *, was_near: bool) -> bool:
    return distance_of(a, b) <= (settings.leave_radius_m if was_near else settings.enter_radius_m)


def is_near_in_time(a: Body, b: Body, settings: RelationSettings, *, was_near: bool) -> bool:
    if is_near(a, b, settings, was_near=was_near):
        return True
    reach_s = settings.leave_reach_s if was_near else settings.enter_reach_s
    line_m = settings.leave_line_m if was_near else settings.enter_line_m
    if is_on_one_road(a, b, settings):
        sideways = abs(a.across - b.across)
    elif abs(turn(a.heading - b.heading)) < settings.heading_limit_rad:
        mean = b.heading + turn(a.heading - b.heading) / 2
        sideways = abs((a.y - b.y) * math.cos(mean) - (a.x - b.x) * math.sin(mean))
    else:
        return False
    return distance_of(a, b) <= reach_s * max(a.speed, b.speed) and sideways <= line_m


def travel_of(body: Body) -> float:
    return math.cos(body.heading - body.tangent)


def conflict_quantities(a: Body, b: Body, settings: RelationSettings) -> dict[str, float]:
    a, b = (replace(body, width=min(body.width, settings.widest_m)) for body in (a, b))
    cosine = math.sqrt(settings.road_alignment)
    if is_on_one_road(a, b, settings) and abs(travel_of(a)) > cosine and abs(travel_of(b)) > cosine:
        rate = b.speed * travel_of(b) - a.speed * travel_of(a)
        reach = (a.length + b.length) / 2, (a.width + b.width) / 2
        ttc = contact_time((b.along - a.along, b.across - a.across), (rate, 0.0), reach)
        course = reach[1] - abs(b.across - a.across)
    else:
        course = course_overlap(a, b)
        rate = math.hypot(*relative_velocity(a, b))
        ttc = max(contact_in_frame_of(a, b), contact_in_frame_of(b, a))
    braking = abs(rate) / 2 / max(ttc, settings.conflict_at_once_s)
    return {"ttc": settings.conflict_ttc_s - ttc, "braking": braking - settings.conflict_braking_mps2, "course": course}


def ways_m(a: Body, b: Body, graph: LaneGraph) -> tuple[float, float]:
    """Metres from a to where b is, and from b to where a is."""
    place_a, place_b = (place_of(body, graph) for body in (a, b))
    return float(graph.distances_m(place_a, place_b)[0, 0]), float(graph.distances_m(place_b, place_a)[0, 0])


def place_of(body: Body, graph: LaneGraph) -> LanePlaces:
    return places_of([body], graph)


def places_of(bodies: list[Body], graph: LaneGraph) -> LanePlaces:
    along, across, tangent = np.array([[body.along, body.across, body.tangent] for body in bodies]).T
    road, lane, junction = np.array([[body.road, body.lane, body.junction] for body in bodies], dtype=np.int32).T
    at = RoadPositions(road, along, across, lane, junction, tangent)
    return graph.project(
        np.array([[body.x, body.y] for body in bodies]), np.array([body.heading for body in bodies]), at
    )


def quantities(a: Body, b: Body, settings: RelationSettings, graph: LaneGraph | None) -> dict[str, float]:
    """What is compared with thresholds for the ordered pair (a, b), but for what depends on other cars."""
    dx, dy = a.x - b.x, a.y - b.y
    delta = turn(a.heading - b.heading)
    if is_on_one_road(a, b, settings):
        travel_a, travel_b = travel_of(a), travel_of(b)
        gap = (a.along - b.along) * (1 if travel_a + travel_b >= 0 else -1)
        lateral = abs(a.across - b.across)
        left = (a.across - b.across) * (1 if travel_b >= 0 else -1)
        direction = travel_a * travel_b - settings.road_alignment
    else:
        mean_x = math.cos(a.heading) + math.cos(b.heading)
        mean_y = math.sin(a.heading) + math.sin(b.heading)
        norm = max(math.hypot(mean_x, mean_y), 0.1)
        gap = (dx * mean_x + dy * mean_y) / norm
        lateral = abs(dy * mean_x - dx * mean_y) / norm
        left = dy * math.cos(b.heading) - dx * math.sin(b.heading)
        direction = math.cos(delta) - math.cos(settings.heading_limit_rad)
        if graph is not None:
            to_b, to_a = ways_m(a, b, graph)
            if settings.far_along * min(to_b, to_a) < max(to_b, to_a):
                gap = -to_b if to_b < to_a else to_a
                astray = [body for body in (a, b) if body.lane >= 0 and place_of(body, graph).lane[0, 0] != body.lane]
                lateral = settings.widest_m if astray else 0.0
                direction = 1.0 - math.cos(settings.heading_limit_rad)
    h, half_widths = (a.length + b.length) / 2, (a.width + b.width) / 2
    return {
        "past_rear": gap + h,
        "past_front": gap - h,
        "near": settings.beside_lateral_m - (0.0 if is_on_one_road(a, b, settings) else lateral),
        "same": direction,
        "close": settings.close_m - max(box_distance(a, b), box_distance(b, a)),
        "left": left - half_widths,
        "right": -left - half_widths,
        "path": (min(a.width, settings.widest_m) + min(b.width, settings.widest_m)) / 2 - lateral,
        **conflict_quantities(a, b, settings),
    }


def headway_quantities(
    pair: tuple[str, str],
    measured: dict[tuple[str, str], dict[str, float]],
    bodies: dict[str, Body],
    s: RelationSettings,
) -> dict[str, float]:
    """Time gaps of the first car to the second one, if that is the next in its path."""

    def bumper(other: tuple[str, str]) -> float:
        return -measured[other]["past_rear"]

    def is_in_front(other: tuple[str, str]) -> bool:
        half_lengths = (bodies[other[0]].length + bodies[other[1]].length) / 2
        centre_gap = measured[other]["past_rear"] - half_lengths
        return measured[other]["same"] > 0 and measured[other]["path"] > 0 and centre_gap < 0

    in_front = [bumper(other) for other in measured if other[0] == pair[0] and is_in_front(other)]
    if not is_in_front(pair) or bumper(pair) > min(in_front) + 1e-9:
        return {"follows": -100.0, "short": -100.0}
    speed = bodies[pair[0]].speed
    gap_s = bumper(pair) / max(speed, 0.01)
    s_per_mps = s.time_gap_margin_s / s.moving_margin_mps
    return {
        "follows": max(min(s.following_s - gap_s, (speed - s.moving_mps) * s_per_mps), -100.0),
        "short": max(min(s.short_headway_s - gap_s, (speed - s.short_headway_least_mps) * s_per_mps), -100.0),
    }


def facing_m(a: Body, b: Body, graph: LaneGraph) -> float:
    """Metres that a and b have to drive until they meet; inf if they do not drive towards each other on a route."""
    return float(graph.facing_m(places_of([a, b], graph), np.array([[0], [1]]))[0])


def bumpers_to_meeting_m(a: Body, b: Body, settings: RelationSettings, graph: LaneGraph | None) -> float | None:
    """Metres between those who drive towards each other, below zero once they have met; None of all others."""
    half_lengths = (a.length + b.length) / 2
    if a.road == b.road and a.road >= 0:
        is_straight = min(abs(travel_of(a)), abs(travel_of(b))) > math.sqrt(settings.road_alignment)
        if not is_straight or travel_of(a) * travel_of(b) > 0:
            return None
        return (b.along - a.along) * (1 if travel_of(a) > 0 else -1) - half_lengths
    if graph is None or distance_of(a, b) > settings.oncoming_leave_m:
        return None
    way_m = facing_m(a, b, graph)
    return way_m - half_lengths if math.isfinite(way_m) else None


def meeting_quantity(a: Body, b: Body, ahead: float, settings: RelationSettings) -> float:
    on_one_road = a.road == b.road and a.road >= 0
    speeds = [body.speed * (abs(travel_of(body)) if on_one_road else 1.0) for body in (a, b)]
    return settings.oncoming_s - (min(ahead / max(sum(speeds), 0.01), 100.0) if ahead > 0 else 100.0)


# relation -> switches and the value each must have
NEAR = {
    "behind": {"same": True, "past_rear": False},
    "beside": {"same": True, "past_rear": True, "past_front": False, "near": True},
    "ahead": {"same": True, "past_front": True},
    "close": {"close": True},
    "left": {"left": True},
    "right": {"right": True},
    "same_direction": {"same": True},
}
NEAR_IN_TIME = {
    "following": {"same": True, "past_rear": False, "path": True, "follows": True},
    "short_headway": {"same": True, "past_rear": False, "path": True, "short": True},
    "conflict": {"ttc": True, "braking": True, "course": True},
}


class Oracle:
    """Observes every ordered pair on its own."""

    def __init__(
        self,
        road_ids: list[str],
        junction_ids: list[str],
        settings: RelationSettings,
        lanes: list[tuple[str, int]] | None = None,
        graph: LaneGraph | None = None,
    ) -> None:
        self.settings = settings
        self.graph = graph
        self.lanes = lanes or []
        self.place_ids = {"on": road_ids, "in_crossing": junction_ids, "in_lane": [name for name, _ in self.lanes]}
        self.pairs: dict[tuple[str, str], Pair] = {}
        self.pairs_in_time: dict[tuple[str, str], Pair] = {}
        self.facing: dict[tuple[str, str], Pair] = {}
        self.moving: dict[str, Pair] = {}
        self.places: dict[tuple[str, str], tuple[int, int, int]] = {}  # now at, candidate, since
        self.visited: dict[tuple[str, str], dict[int, tuple[bool, int]]] = {}
        self.states: dict[tuple[str, str], tuple[bool | None, bool | None, int, int]] = {}  # ..., last change
        self.seniority: dict[str, int] = {}
        self.appeared = 0
        self.known: set[str] = set()
        self.unseen_us: dict[str, int] = {}
        self.in_each_other_us: dict[frozenset[str], int] = {}
        self.one_vehicle_us: dict[frozenset[str], int] = {}

    def observe(self, frame: Footprints) -> list[RelationChange]:
        bodies = {
            name: body for name, body in bodies_of(frame).items() if body.observed or name in self.known
        }  # nobody begins with a guess
        changes = self.forget(frame.t_us, bodies)
        for name in bodies:
            if name not in self.seniority:
                self.appeared += 1
                self.seniority[name] = self.appeared
        self.find_doubles(frame.t_us, bodies)
        changes += self.observe_pairs(frame.t_us, bodies, self.pairs, is_near, NEAR)
        changes += self.observe_pairs(frame.t_us, bodies, self.pairs_in_time, is_near_in_time, NEAR_IN_TIME)
        changes += self.observe_facing(frame.t_us, bodies)
        for a, body_a in bodies.items():
            if not body_a.observed:
                continue
            changes += self.observe_moving(frame.t_us, a, body_a.speed if body_a.has_moved else 0.0)
            changes += self.observe_place(frame.t_us, "on", a, body_a.road)
            changes += self.observe_place(frame.t_us, "in_crossing", a, body_a.junction)
            changes += self.observe_state(frame.t_us, "forward", a, self.is_forward(body_a))
            if self.lanes:
                changes += self.observe_place(frame.t_us, "in_lane", a, body_a.lane)
                changes += self.observe_state(frame.t_us, "against_traffic", a, self.is_against_traffic(body_a))
        self.known = set(bodies)
        unseen = [name for name, body in bodies.items() if not body.observed]
        self.unseen_us = {name: self.unseen_us.get(name, frame.t_us) for name in unseen}
        return changes

    def find_doubles(self, t_us: int, bodies: dict[str, Body]) -> None:
        settings = self.settings
        for pair in [frozenset((a, b)) for a in bodies for b in bodies if a < b]:
            a, b = (bodies[name] for name in pair)
            if not (a.observed and b.observed):
                if self.in_each_other_us.get(pair, t_us) < t_us - settings.double_us:
                    del self.in_each_other_us[pair]
            elif math.isnan(a.sigma + b.sigma):
                continue
            elif depth(a, b) <= max(settings.margin_m, settings.sigma_factor * math.hypot(a.sigma, b.sigma)):
                self.in_each_other_us.pop(pair, None)
            elif t_us - self.in_each_other_us.setdefault(pair, t_us) >= settings.place_dwell_us:
                self.one_vehicle_us[pair] = t_us + settings.double_us
        for past in (self.in_each_other_us, self.one_vehicle_us):
            for pair in [pair for pair in past if not pair <= set(bodies)]:
                del past[pair]

    def are_two_vehicles(self, t_us: int, bodies: dict[str, Body], pair: tuple[str, str]) -> bool:
        moved = all(bodies[name].has_moved for name in pair)
        return moved and self.one_vehicle_us.get(frozenset(pair), t_us) <= t_us

    def lost_us(self, t_us: int, bodies: dict[str, Body], *names: str) -> int:
        """When the first of some that are gone was not seen any more."""
        return min([self.unseen_us.get(name, t_us) for name in names if name not in bodies], default=t_us)

    def is_forward(self, body: Body) -> bool | None:
        if not body.has_moved or body.road < 0 or abs(travel_of(body)) < math.sqrt(self.settings.road_alignment):
            return None
        return travel_of(body) > 0

    def is_against_traffic(self, body: Body) -> bool | None:
        forward = self.is_forward(body)
        if forward is None or body.lane < 0:
            return None
        return forward != (self.lanes[body.lane][1] > 0)

    def forget(self, t_us: int, bodies: dict[str, Body]) -> list[RelationChange]:
        changes = []
        for pairs in (self.pairs, self.pairs_in_time):
            for pair in [pair for pair in pairs if not set(pair) <= set(bodies)]:
                changes += self.end_pair(t_us, pair, pairs, self.lost_us(t_us, bodies, *pair))
        for name in [name for name in self.moving if name not in bodies]:
            old = self.moving.pop(name).values["moving"]
            changes.append(RelationChange("moving", (name,), self.lost_us(t_us, bodies, name), t_us, old, None))
        for relation, name in [key for key in self.places if key[1] not in bodies]:
            del self.places[relation, name]
            for place, (value, _) in self.visited.pop((relation, name), {}).items():
                args = (name, self.place_ids[relation][place])
                since_us = self.lost_us(t_us, bodies, name)
                changes.append(RelationChange(relation, args, since_us, t_us, value, None))
        for relation, name in [key for key in self.states if key[1] not in bodies]:
            current = self.states.pop((relation, name))[0]
            if current is not None:
                since_us = self.lost_us(t_us, bodies, name)
                changes.append(RelationChange(relation, (name,), since_us, t_us, current, None))
        for name in [name for name in self.seniority if name not in bodies]:
            del self.seniority[name]
        return changes

    def end_pair(
        self, t_us: int, pair: tuple[str, str], pairs: dict[tuple[str, str], Pair], since_us: int
    ) -> list[RelationChange]:
        values = pairs.pop(pair).values
        return [RelationChange(name, pair, since_us, t_us, value, None) for name, value in values.items()]

    def observe_pairs(
        self,
        t_us: int,
        bodies: dict[str, Body],
        pairs: dict[tuple[str, str], Pair],
        is_close_enough: Callable[..., bool],
        meanings: dict[str, dict[str, bool]],
    ) -> list[RelationChange]:
        settings, changes = self.settings, []
        measured: dict[tuple[str, str], dict[str, float]] = {}
        for pair in [(a, b) for a in bodies for b in bodies if a != b]:
            a, b = (bodies[name] for name in pair)
            if not (a.observed and b.observed):
                continue
            is_near_enough = is_close_enough(a, b, settings, was_near=pair in pairs)
            if is_near_enough and self.are_two_vehicles(t_us, bodies, pair):
                measured[pair] = quantities(a, b, settings, self.graph)
            elif pair in pairs:
                changes += self.end_pair(t_us, pair, pairs, t_us)
        for pair, values in measured.items():
            if pair not in pairs:
                pairs[pair] = self.new_pair()
            state = pairs[pair]
            for name, value in (values | headway_quantities(pair, measured, bodies, settings)).items():
                state.switches[name].update(t_us, value)
            # A conflict is told once for two cars, the elder first.
            is_elder = self.seniority[pair[0]] < self.seniority[pair[1]]
            meaning = {name: wanted for name, wanted in meanings.items() if name != "conflict" or is_elder}
            changes += self.changes_of(t_us, pair, state, meaning)
        return changes

    def new_pair(self) -> Pair:
        settings = self.settings
        names = ("past_rear", "past_front", "near", "left", "right", "path", "course")
        margins = dict.fromkeys(names, settings.margin_m)
        margins |= dict.fromkeys(("follows", "short"), settings.time_gap_margin_s)
        margins |= {"same": settings.direction_margin, "close": max(settings.close_margin_m, settings.margin_m)}
        margins |= {"ttc": settings.conflict_ttc_margin_s, "braking": settings.conflict_braking_margin_mps2}
        return Pair({name: Hysteresis(margin, settings.backdate_us) for name, margin in margins.items()})

    def observe_facing(self, t_us: int, bodies: dict[str, Body]) -> list[RelationChange]:
        settings, changes = self.settings, []
        looked_at: dict[tuple[str, str], float | None] = {}
        for pair in [(a, b) for a in bodies for b in bodies if a != b]:
            a, b = (bodies[name] for name in pair)
            limit = settings.oncoming_leave_m if pair in self.facing else settings.oncoming_enter_m
            ahead = bumpers_to_meeting_m(a, b, settings, self.graph)
            if not (a.observed and b.observed):
                if pair in self.facing:
                    looked_at[pair] = None
            elif not (a.has_moved and b.has_moved):
                pass
            elif ahead is not None and abs(ahead + (a.length + b.length) / 2) - (a.length + b.length) / 2 <= limit:
                looked_at[pair] = meeting_quantity(a, b, ahead, settings)
        for pair in [pair for pair in self.facing if pair not in looked_at]:
            old = self.facing.pop(pair).values["oncoming"]
            since_us = self.lost_us(t_us, bodies, *pair)
            changes.append(RelationChange("oncoming", pair, since_us, t_us, old, None))
        for pair, value in looked_at.items():
            if value is None:
                continue
            fresh = Pair({"meet": Hysteresis(settings.oncoming_margin_s, settings.backdate_us)})
            state = self.facing.setdefault(pair, fresh)
            state.switches["meet"].update(t_us, value)
            changes += self.changes_of(t_us, pair, state, {"oncoming": {"meet": True}})
        return changes

    def observe_state(self, t_us: int, relation: str, name: str, state: bool | None) -> list[RelationChange]:
        key = relation, name
        if key not in self.states:
            self.states[key] = (state, state, t_us, t_us)
            return [] if state is None else [RelationChange(relation, (name,), t_us, t_us, None, state)]
        current, candidate, since_us, last_us = self.states[key]
        if state != candidate:
            candidate, since_us = state, t_us
        changes = []
        if candidate != current and t_us - since_us >= self.settings.place_dwell_us:
            at_us = max(since_us, t_us - self.settings.backdate_us, last_us + 1)
            changes.append(RelationChange(relation, (name,), at_us, t_us, current, candidate))
            current, last_us = candidate, at_us
        self.states[key] = (current, candidate, since_us, last_us)
        return changes

    def changes_of(
        self, t_us: int, args: tuple[str, ...], state: Pair, meaning: dict[str, dict[str, bool]]
    ) -> list[RelationChange]:
        changes = []
        for name, wanted in meaning.items():
            right = {switch: state.switches[switch].is_on == value for switch, value in wanted.items()}
            new, old = all(right.values()), state.values.get(name)
            if new == old:
                continue
            times = [state.switches[switch].since_us for switch in wanted if new or not right[switch]]
            at_us = max(times) if new else min(times)
            at_us = t_us if old is None else max(at_us, state.changed_us[name] + 1)
            state.values[name], state.changed_us[name] = new, at_us
            changes.append(RelationChange(name, args, at_us, t_us, old, new))
        return changes

    def observe_moving(self, t_us: int, name: str, speed: float) -> list[RelationChange]:
        settings = self.settings
        if name not in self.moving:
            self.moving[name] = Pair({"moving": Hysteresis(settings.moving_margin_mps, settings.backdate_us)})
        state = self.moving[name]
        state.switches["moving"].update(t_us, speed - settings.moving_mps)
        return self.changes_of(t_us, (name,), state, {"moving": {"moving": True}})

    def observe_place(self, t_us: int, relation: str, name: str, place: int) -> list[RelationChange]:
        key = relation, name
        if key not in self.places:
            self.places[key] = (place, place, t_us)
            return [self.set_place(t_us, t_us, key, place, is_there=True)] if place >= 0 else []
        current, candidate, since_us = self.places[key]
        if place != candidate:
            candidate, since_us = place, t_us
        changes = []
        if candidate != current and t_us - since_us >= self.settings.place_dwell_us:
            at_us = max(since_us, t_us - self.settings.backdate_us)
            if current >= 0:
                changes.append(self.set_place(t_us, at_us, key, current, is_there=False))
            if candidate >= 0:
                changes.append(self.set_place(t_us, at_us, key, candidate, is_there=True))
            current = candidate
        self.places[key] = (current, candidate, since_us)
        return changes

    def set_place(self, t_us: int, at_us: int, key: tuple[str, str], place: int, *, is_there: bool) -> RelationChange:
        relation, name = key
        visited = self.visited.setdefault(key, {})
        old: bool | None = False if name in self.known else None
        if place in visited:
            old, last_us = visited[place]
            at_us = max(at_us, last_us + 1)
        visited[place] = (is_there, at_us)
        return RelationChange(relation, (name, self.place_ids[relation][place]), at_us, t_us, old, is_there)


def bodies_of(frame: Footprints) -> dict[str, Body]:
    return {
        name: Body(
            x=float(frame.centre_m[k, 0]),
            y=float(frame.centre_m[k, 1]),
            heading=float(frame.heading_rad[k]),
            speed=float(frame.speed_mps[k]),
            length=float(frame.length_m[k]),
            width=float(frame.width_m[k]),
            road=int(frame.road[k]),
            along=float(frame.along_m[k]),
            across=float(frame.across_m[k]),
            tangent=float(frame.tangent_rad[k]),
            junction=int(frame.junction[k]),
            lane=int(frame.lane[k]),
            observed=bool(frame.observed[k]),
            has_moved=bool(frame.has_moved[k]),
            sigma=float(frame.sigma_m[k]),
        )
        for k, name in enumerate(frame.ids)
    }
