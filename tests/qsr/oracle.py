"""The relations, slow and obvious: one ordered pair of objects, one number, one `if` at a time."""

import math
from dataclasses import dataclass, field

from qsr.changes import RelationChange
from qsr.footprints import Footprints
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


def quantities(a: Body, b: Body, settings: RelationSettings) -> dict[str, float]:
    """What is compared with thresholds for the ordered pair (a, b)."""
    dx, dy = a.x - b.x, a.y - b.y
    delta = turn(a.heading - b.heading)
    on_road = a.road == b.road and a.road >= 0 and abs(a.along - b.along) <= 2 * settings.leave_radius_m
    if on_road:
        travel_a, travel_b = math.cos(a.heading - a.tangent), math.cos(b.heading - b.tangent)
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
    h, half_widths = (a.length + b.length) / 2, (a.width + b.width) / 2
    return {
        "past_rear": gap + h,
        "past_front": gap - h,
        "near": settings.beside_lateral_m - lateral,
        "same": direction,
        "close": settings.close_m - max(box_distance(a, b), box_distance(b, a)),
        "left": left - half_widths,
        "right": -left - half_widths,
    }


# relation -> switches and the value each must have
MEANING = {
    "behind": {"same": True, "past_rear": False},
    "beside": {"same": True, "past_rear": True, "past_front": False, "near": True},
    "ahead": {"same": True, "past_front": True},
    "close": {"close": True},
    "left": {"left": True},
    "right": {"right": True},
    "same_direction": {"same": True},
}


class Oracle:
    """Observes every ordered pair on its own."""

    def __init__(self, road_ids: list[str], junction_ids: list[str], settings: RelationSettings) -> None:
        self.settings = settings
        self.place_ids = {"on": road_ids, "in_crossing": junction_ids}
        self.pairs: dict[tuple[str, str], Pair] = {}
        self.moving: dict[str, Pair] = {}
        self.places: dict[tuple[str, str], tuple[int, int, int]] = {}  # now at, candidate, since
        self.visited: dict[tuple[str, str], dict[int, tuple[bool, int]]] = {}
        self.known: set[str] = set()

    def observe(self, frame: Footprints) -> list[RelationChange]:
        bodies = bodies_of(frame)
        changes = self.forget(frame.t_us, bodies)
        for a, body_a in bodies.items():
            for b, body_b in bodies.items():
                if a != b:
                    changes += self.observe_pair(frame.t_us, (a, b), body_a, body_b)
            changes += self.observe_moving(frame.t_us, a, body_a.speed)
            changes += self.observe_place(frame.t_us, "on", a, body_a.road)
            changes += self.observe_place(frame.t_us, "in_crossing", a, body_a.junction)
        self.known = set(bodies)
        return changes

    def forget(self, t_us: int, bodies: dict[str, Body]) -> list[RelationChange]:
        changes = []
        for pair in [pair for pair in self.pairs if not set(pair) <= set(bodies)]:
            changes += self.end_pair(t_us, pair)
        for name in [name for name in self.moving if name not in bodies]:
            changes.append(RelationChange("moving", (name,), t_us, t_us, self.moving.pop(name).values["moving"], None))
        for relation, name in [key for key in self.places if key[1] not in bodies]:
            del self.places[relation, name]
            for place, (value, _) in self.visited.pop((relation, name), {}).items():
                args = (name, self.place_ids[relation][place])
                changes.append(RelationChange(relation, args, t_us, t_us, value, None))
        return changes

    def end_pair(self, t_us: int, pair: tuple[str, str]) -> list[RelationChange]:
        values = self.pairs.pop(pair).values
        return [RelationChange(name, pair, t_us, t_us, value, None) for name, value in values.items()]

    def observe_pair(self, t_us: int, pair: tuple[str, str], a: Body, b: Body) -> list[RelationChange]:
        settings = self.settings
        distance = math.hypot(a.x - b.x, a.y - b.y) - a.length / 2 - b.length / 2
        if distance > (settings.leave_radius_m if pair in self.pairs else settings.enter_radius_m):
            return self.end_pair(t_us, pair) if pair in self.pairs else []
        if pair not in self.pairs:
            margins = dict.fromkeys(("past_rear", "past_front", "near", "left", "right"), settings.margin_m)
            margins |= {"same": settings.direction_margin, "close": max(settings.close_margin_m, settings.margin_m)}
            self.pairs[pair] = Pair(
                {name: Hysteresis(margin, settings.backdate_us) for name, margin in margins.items()}
            )
        state = self.pairs[pair]
        for name, value in quantities(a, b, settings).items():
            state.switches[name].update(t_us, value)
        return self.changes_of(t_us, pair, state, MEANING)

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
        )
        for k, name in enumerate(frame.ids)
    }
