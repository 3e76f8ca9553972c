"""Random chronicle texts and traces, small enough for the oracle."""

import random

from chronicles.events import Event

THINGS = ("c1", "c1", "c2", "c2", "c3")
VALUES = ("on", "off", "unknown")
ARITIES = {"a": 0, "b": 1, "c": 2, "p": 1, "q": 2}
ATTRIBUTES = ("p", "q")
DECLARATIONS = """
domain Thing = symbol
domain State = {on, off}
message a[]
message b[?x] { ?x in Thing }
message c[?x, ?y] { ?x in Thing ?y in Thing }
message d[?x] { ?x in Thing }
attribute p[?x] { ?x in Thing value in State DEFAULT }
attribute q[?x, ?y] { ?x in Thing value in State }
"""


class CaseMaker:
    """Makes one random text and one random trace from a seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.known: list[str] = []
        self.used_names: list[str] = []
        self.emits: list[str] = []
        self.asserts: list[str] = []
        self.has_hypotheses = False

    def text(self) -> str:
        """Write a chronicle of one to four events; it may be inconsistent or unbounded."""
        pick = self.random
        self.used_names = []
        count = pick.choice((1, 1, 2, 2, 2, 3, 3, 4))
        points = [f"t{index}" for index in range(1, count + 1)]
        at = [point if pick.random() < 0.95 else points[0] for point in points]
        lines = [f"event({self.pattern()}, {point})" for point in at]
        used = list(dict.fromkeys(at))
        for index in range(1, len(used)):
            lines.append(self.constraint(used[index], pick.choice(used[:index])))
        if len(used) > 1 and pick.random() < 0.3:
            later, earlier = pick.sample(used, 2)
            lines.append(self.constraint(later, earlier))
        free = [*used]
        if pick.random() < 0.25:
            lines.append(f"{pick.choice(used)} - t9 in [{(gap := pick.randint(-4, 4))}, {gap}]")
            free.append("t9")
        lines += [f"noevent({self.pattern()}, {self.interval(free)})" for _ in range(pick.choice((0, 0, 0, 1, 1, 2)))]
        lines += [f"hold({self.fluent()}, {self.interval(free)})" for _ in range(pick.choice((0, 0, 0, 1, 1, 2)))]
        lines += [
            f"occurs({self.count()}, {self.pattern()}, {self.interval(free)})" for _ in range(pick.choice((0, 0, 0, 1)))
        ]
        lines += [self.assertion(lines, free) for _ in range(pick.choice((0, 0, 0, 1)))]
        lines += self.selection(used)
        lines += self.value_constraints(" ".join(lines))
        pick.shuffle(lines)
        return (
            self.head(lines, free)
            + "\n  ".join(["", *(f"{line};" for line in lines)])
            + self.reaction(free)
            + "\n}\n"
            + self.second()
        )

    def head(self, lines: list[str], points: list[str]) -> str:
        """Write declarations or none, and the head with some of the bound variables."""
        pick = self.random
        declarations = ""
        if pick.random() < 0.6:
            declarations = DECLARATIONS.replace("DEFAULT", pick.choice(("", "", "default off")))
        bound = "".join(line for line in lines if line.startswith(("event", "hold")))
        self.known = [name for name in ("x", "y", "z") if f"?{name}" in bound]
        roles = ", ".join(f"?{name}" for name in self.known if pick.random() < 0.8)
        exported = pick.choice(([], points[:1], pick.sample(points, min(2, len(points)))))
        return f"timeunit 1us\n{declarations}chronicle one[{roles}]({', '.join(exported)}) {{"

    def reaction(self, points: list[str]) -> str:
        """Sometimes emit an event or set an attribute."""
        pick = self.random
        self.emits, self.asserts = [], []
        if self.known and pick.random() < 0.3:
            self.emits = [f"emit event(d[?{self.known[0]}], {pick.choice(points)} + 1)"]
        if self.known and pick.random() < 0.3:
            offsets = pick.choice(((" + 2",), ("",), (" - 3",), ("", " + 1")))
            self.asserts = [f"assert({self.setting()}, {pick.choice(points)}{offset})" for offset in offsets]
        actions = " ".join(self.emits + self.asserts)
        return f"\n  when recognised {{ {actions} }}" if actions else ""

    def setting(self) -> str:
        """Write an attribute of a bound variable with the value to set."""
        return f"p[?{self.random.choice(self.known)}]:{self.random.choice(('on', 'on', 'off'))}"

    def second(self) -> str:
        """Sometimes write a chronicle about what the first emits or sets."""
        pick = self.random
        if not (self.emits or self.asserts) or pick.random() < 0.3:
            return ""
        gap = pick.randint(1, 8)
        self.used_names += ["b", "b"]
        obligations = ("", "", f"noevent(d[?], (t1 + 1, t1 + {1 + gap}))", "occurs(1, 2, d[?], (t2 - 1, t1 + 9))")
        first = "d[?u]" if self.emits else "p[?u]:(?, on)"
        seen = pick.choice(("b[?w]", "b[?w]", "c[?u, ?w]", first.replace("?u", "?w")))
        obligation = pick.choice(obligations)
        if self.asserts:
            first = pick.choice((first, "p[?u]:(?, on)", "p[?u]:(unknown, ?)"))
            held = ("", "", f"hold(p[?u]:on, (t1, t1 + {1 + gap}))", "assert(p[?w]:off, (t1 - 2, t2))")
            obligation += " " + pick.choice(held)
        return f"""chronicle two[?u, ?w](t1, t2) {{
  event({first}, t1) event({seen}, t2)
  t2 - t1 in [{-gap}, {gap}] {obligation}
}}
"""

    def count(self) -> str:
        """Write how many events there may be."""
        least = self.random.choice((0, 1, 1, 2))
        most = self.random.choice(("oo", "oo", *range(least, 4)))
        return f"({least}, {most})"

    def assertion(self, lines: list[str], points: list[str]) -> str:
        """Write an assert about variables that are bound elsewhere."""
        pick = self.random
        bound = "".join(line for line in lines if line.startswith(("event", "hold")))
        names = [f"?{name}" for name in "xyz" if f"?{name}" in bound] + ["c1"]
        name = pick.choice(ATTRIBUTES)
        self.used_names.append(name)
        arguments = ", ".join(pick.choice(names) for _ in range(ARITIES[name]))
        values = ("on", "on", "off", "unknown", *(["?v"] if "?v" in bound else []))
        return f"assert({name}[{arguments}]:{pick.choice(values)}, {self.interval(points)})"

    def selection(self, points: list[str]) -> list[str]:
        """Mostly tell all occurrences."""
        pick = self.random
        chosen = pick.choice((f"select first({pick.choice(points)})", "select non_overlapping", "select all"))
        return [chosen] if pick.random() < 0.25 else []

    def pattern(self) -> str:
        """Write an event pattern."""
        name = self.random.choice(tuple(ARITIES))
        self.used_names.append(name)
        if name not in ATTRIBUTES:
            return f"{name}[{self.arguments(name)}]"
        old, new = self.value(), self.value()
        return f"{name}[{self.arguments(name)}]:({old}, {'?' if new == old else new})"

    def fluent(self) -> str:
        """Write an attribute with a value."""
        name = self.random.choice(ATTRIBUTES)
        self.used_names.append(name)
        return f"{name}[{self.arguments(name)}]:{self.value()}"

    def arguments(self, name: str) -> str:
        """Write arguments: mostly variables."""
        return ", ".join(
            self.random.choice(("?x", "?x", "?x", "?y", "?y", "?z", "?", "c1")) for _ in range(ARITIES[name])
        )

    def value(self) -> str:
        """Write an attribute's value."""
        return self.random.choice(("on", "on", "off", "?", "?", "?v", "unknown"))

    def constraint(self, later: str, earlier: str) -> str:
        """Write a constraint in one of its forms."""
        pick = self.random
        low = pick.randint(-5, 3)
        high = low + pick.randint(0, 12)
        return (
            pick.choice(
                (
                    f"{later} - {earlier} in [{low}, {high}]",
                    f"{later} - {earlier} in ]{low - 1}, {high}]",
                    f"{later} - {earlier} in [{low}, {high + 1}[",
                    f"{earlier} - {later} in [{-high}, {-low}]",
                    f"{low} <= {later} - {earlier} < {high + 1}",
                    f"{later} > {earlier} - {1 - low} {later} <= {earlier} + {high}" if low <= 1 and high >= 0 else "",
                )
            )
            or f"{later} - {earlier} in [{low}, {high}]"
        )

    def interval(self, points: list[str]) -> str:
        """Write an interval between two points, with offsets."""
        pick = self.random
        offsets = [pick.choice(("", "", " + 1", " - 2", " + 3")) for _ in range(2)]
        start, end = pick.choice(points), pick.choice(points)
        if start == end:
            return f"({start} - {pick.randint(0, 3)}, {end} + {pick.randint(1, 4)})"
        return f"({start}{offsets[0]}, {end}{offsets[1]})"

    def value_constraints(self, body: str) -> list[str]:
        """Write constraints on the variables of a body."""
        choices = ("?x != ?y", "?x == ?y", "allow ?x == ?y", "?x in {c1, c2}", "?y != c2", "?x == c1", "allow ?y == ?z")
        known = [one for one in choices if all(f"?{name}" in body for name in "xyz" if f"?{name}" in one)]
        return [one for one in known if self.random.random() < 0.1]

    def trace(self) -> list[Event]:
        """Make events with ties, restated values and changes that do not fit each other."""
        pick = self.random
        last = pick.choice((6, 10, 16))
        self.has_hypotheses = pick.random() < 0.4
        return [self.event(pick.randint(0, last)) for _ in range(pick.randint(10, 24))]

    def event(self, t_us: int) -> Event:
        """Make one event."""
        pick = self.random
        # Mostly what the chronicle looks at, or most cases would have no match.
        name = pick.choice(self.used_names if pick.random() < 0.85 else tuple(ARITIES))
        args = tuple(pick.choice(THINGS) for _ in range(ARITIES[name]))
        labels = tuple(pick.sample(("h1", "h2", "h3"), pick.choice((0, 0, 0, 1, 2)))) if self.has_hypotheses else ()
        if name not in ATTRIBUTES:
            return Event(name, args, t_us, hypotheses=labels)
        return Event(name, args, t_us, pick.choice(VALUES), pick.choice(("on", "on", "off", "unknown")), labels)

    def arrival(self, trace: list[Event], lateness_us: int) -> list[Event | int]:
        """Put a trace into an order in which no event is late, with times to advance to in between.

        The last time is far behind everything.
        """
        pick = self.random
        delayed = sorted(trace, key=lambda event: event.t_us + pick.uniform(0, lateness_us or 0.5))
        steps: list[Event | int] = []
        for index, event in enumerate(delayed):
            if pick.random() < 0.4:
                steps.append(min(one.t_us for one in delayed[index:]) + pick.randint(0, lateness_us))
            steps.append(event)
        while len(steps) < 100 and pick.random() < 0.7:
            steps.append(pick.randint(0, 60))
        return [*steps, 10_000]
