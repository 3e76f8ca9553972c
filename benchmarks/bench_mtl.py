"""How many states a second does a formula take, how large does it get, and what does a noisy sensor do to it?

Readings are false for less than half a second, then true for more than two seconds, over and over: nothing is ever
violated, and obligations come and go. Rates are of one progressor that gets one state after another. rtamt and reelay
run on the same readings where they are installed (``pip install rtamt reelay``): see the notes printed with the table.

Run from the root of the repository: ``python -m benchmarks.bench_mtl [speed monitors peers noise]``
"""

import importlib.util
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any  # what peers return

import numpy as np

from dyknow.mtl.formula import Formula
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.progressor import Progressor
from dyknow.mtl.progression.shared_work import SharedWork
from dyknow.mtl.progression.states import DictState, Verdict

SIMPLE = "always eventually[0s, 1s] p"
NESTED = "always (not p implies eventually[0s, 1s] always[0s, 1s] p)"
States = Sequence[tuple[int, DictState]]


def readings(count: int, step_us: int, seed: int = 1) -> list[bool]:
    """Draw readings at a pace; dips are shorter than half a second and more than two seconds apart."""
    rng = np.random.default_rng(seed)
    second = 1_000_000 // step_us
    values: list[bool] = []
    while len(values) < count:
        values += [True] * int(rng.integers(2 * second + 2, 3 * second))
        values += [False] * int(rng.integers(1, second // 2 + 1))
    return values[:count]


def states_of(values: Sequence[bool], step_us: int, *, is_irregular: bool) -> list[tuple[int, DictState]]:
    """Give readings times: at an even pace, or each after 80 to 100 % of the step."""
    rng = np.random.default_rng(2)
    steps = rng.integers(step_us * 4 // 5, step_us + 1, len(values)) if is_irregular else np.full(len(values), step_us)
    times_us = np.cumsum(steps).tolist()
    return [(t_us, DictState({"p": value})) for t_us, value in zip(times_us, values, strict=True)]


def rate(formula: Formula, states: States, *, remembers: bool) -> float:
    """Progress through all states and give the states per second."""
    progressor = Progressor(formula, shared=SharedWork(remembers=remembers))
    progress = progressor.progress
    start_s = time.process_time()
    for t_us, state in states:
        progress(t_us, state)
    passed_s = time.process_time() - start_s
    assert progressor.verdict is Verdict.UNKNOWN
    return len(states) / passed_s


def first_alarm(formula: Formula, states: States) -> int:
    """Give the number of the state at which the formula is violated."""
    progressor = Progressor(formula)
    return next(k for k, (t_us, state) in enumerate(states) if progressor.progress(t_us, state) is Verdict.FALSE)


def largest_size(formula: Formula, states: States) -> int:
    progressor = Progressor(formula)
    sizes = [0]
    for t_us, state in states:
        progressor.progress(t_us, state)
        sizes.append(progressor.size)
    return max(sizes)


def speed(count: int = 100_000) -> None:
    print(
        f"{'formula':8} {'step':>6} {'times':>9} {'states/s':>11} {'progression alone':>18} {'ratio':>6} {'nodes':>6}"
    )
    for name, text in (("simple", SIMPLE), ("nested", NESTED)):
        formula = parse_formula(text)
        for step_us in (100_000, 10_000):
            for is_irregular in (False, True):
                states = states_of(readings(count, step_us), step_us, is_irregular=is_irregular)
                fast, plain = (rate(formula, states, remembers=remembers) for remembers in (True, False))
                times = "irregular" if is_irregular else "even"
                size = largest_size(formula, states)
                row = f"{name:8} {step_us // 1000:4d}ms {times:>9} {fast:11,.0f} {plain:18,.0f}"
                print(f"{row} {fast / plain:5.1f}x {size:6d}")
    print(f"simple: {SIMPLE}\nnested: {NESTED}")


def monitors(count: int = 1000, state_count: int = 300) -> None:
    """Time one state for many monitors: all alike, and one for each of as many cars."""
    values = readings(state_count + 7 * count, 100_000)
    print(f"{count} monitors of the nested formula, milliseconds a state: mean and worst of {state_count}")
    names = [f"car{k}" for k in range(count)]
    per_car = parse_formula(NESTED.replace("p", "p[?c]", 1).replace(" p)", " p[?c])"), variables=["c"])
    alike = parse_formula(NESTED)
    for label, remembers in (("steps remembered", True), ("progression alone", False)):
        shared = SharedWork(remembers=remembers)
        same = [Progressor(alike, shared=shared) for _ in names]
        states: list[DictState] = [DictState({"p": value}) for value in values[:state_count]]
        print(f"  all alike,       {label:18} {_milliseconds(same, states)}")
        each = [Progressor(per_car, {"c": name}, shared=shared) for name in names]
        # Cars dip at different times.
        rows = [{("p", (name,)): values[k + 7 * n] for n, name in enumerate(names)} for k in range(state_count)]
        print(f"  one of each car, {label:18} {_milliseconds(each, [DictState(row) for row in rows])}")

    by_sort = parse_formula("always forall ?c in Car: " + NESTED.replace("p", "p[?c]", 1).replace(" p)", " p[?c])"))
    few = names[: count // 10]
    rows = [{("p", (name,)): values[k + 7 * n] for n, name in enumerate(few)} for k in range(state_count)]
    states = [DictState(row, {"Car": few}) for row in rows]
    print(f"  one over the sort of {len(few)} cars{'':19} {_milliseconds([Progressor(by_sort)], states)}")


def _milliseconds(progressors: Sequence[Progressor], states: Sequence[DictState]) -> str:
    passed = []
    for k, state in enumerate(states):
        start_s = time.process_time()
        for one in progressors:
            one.progress(100_000 * k, state)
        passed.append(1e3 * (time.process_time() - start_s))
    assert {one.verdict for one in progressors} == {Verdict.UNKNOWN}
    return f"{np.mean(passed):8.2f} {np.max(passed):8.2f}"


# ---- peers


def peers(count: int = 20_000) -> None:
    """Run peers on the same readings, with a failure at the end; each gets its input ready made."""
    known = {"reelay": _reelay, "rtamt": _rtamt}
    installed = {name: run for name, run in known.items() if importlib.util.find_spec(name) is not None}
    if missing := sorted(set(known) - set(installed)):
        print(f"not installed: {', '.join(missing)}")
    for name, text in (("simple", SIMPLE), ("nested", NESTED)):
        formula = parse_formula(text)
        for step_us in (100_000, 10_000):
            window = 1_000_000 // step_us
            values = [*readings(count, step_us), True, *([False] * 3 * window)]
            states = states_of(values, step_us, is_irregular=False)
            plain, fast = (rate(formula, states[: -3 * window], remembers=remembers) for remembers in (False, True))
            alarm = first_alarm(formula, states)
            print(f"{name} {step_us // 1000:4d}ms: ours {fast:,.0f} states/s, progression alone {plain:,.0f}")
            for peer, run in installed.items():
                found, peer_alarm = run(name, values, window)
                late = f"alarm {peer_alarm - alarm} states after ours"
                print(
                    f"  {peer:7} {found:11,.0f} states/s; ours {fast / found:.1f}x, alone {plain / found:.1f}x; {late}"
                )
    print(
        "reelay knows the past only: it runs the formula turned into the past by hand, so that its answer to a state\n"
        "comes late by the window. rtamt runs the body without the outer always, and computes robustness; its answers\n"
        "come late too. Both count states and not time here, and neither says what is still open."
    )


def _reelay(name: str, values: Sequence[bool], window: int) -> tuple[float, int]:
    import reelay

    patterns = {
        "simple": f"historically(once[0:{window}]{{p}})",
        "nested": f"historically(once[{2 * window}:{2 * window}](!{{p}}) -> "
        f"once[0:{window}](historically[0:{window}]{{p}}))",
    }
    inputs = [({"p": value},) for value in values]
    updates = [reelay.discrete_timed_monitor(pattern=patterns[name], condense=False).update for _ in range(2)]
    return _timed(updates[0], inputs), next(k for k, one in enumerate(inputs) if not updates[1](*one)["value"])


def _rtamt(name: str, values: Sequence[bool], window: int) -> tuple[float, int]:
    import rtamt

    bodies = {
        "simple": f"eventually[0,{window}](p >= 0.5)",
        "nested": f"(not(p < 0.5)) or (eventually[0,{window}](always[0,{window}](p >= 0.5)))",
    }

    def update() -> Callable[..., float]:
        monitor = rtamt.StlDiscreteTimeSpecification()
        monitor.declare_var("p", "float")
        monitor.spec = bodies[name]
        monitor.parse()
        monitor.pastify()
        return monitor.update  # type: ignore[no-any-return]  # rtamt is not typed

    inputs = [(k, [("p", float(value))]) for k, value in enumerate(values)]
    again = update()
    return _timed(update(), inputs), next(k for k, one in enumerate(inputs) if again(*one) < 0.0)


def _timed(update: Callable[..., Any], inputs: Sequence[tuple[Any, ...]]) -> float:
    """Time all updates; answers are not kept, since that would time the garbage collector."""
    start_s = time.process_time()
    for one in inputs:
        update(*one)
    return len(inputs) / (time.process_time() - start_s)


# ---- noise

STEP_US = 100_000
FLIPS = (0.0, 0.01, 0.02, 0.05, 0.1)
FORMS = (
    "always p",
    "always eventually[0s, 500ms] p",
    "always tolerate(p, 500ms, 200ms)",
    "always tolerate(p, 1s, 200ms)",
    "always tolerate(p, 1s, 500ms)",
)


def noise(hours: float = 1.0, faults: int = 200) -> None:
    """Print what flipped readings do: a property that holds is sampled at 10 Hz, and then breaks for good."""
    print(f"false alarms an hour, and seconds from a fault to the alarm (mean / worst of {faults} faults)")
    print(f"{'readings flipped':34}" + "".join(f"{f'{flip:.0%}':>18}" for flip in FLIPS))
    for text in FORMS:
        cells = [noise_cell(text, flip, hours=hours, faults=faults) for flip in FLIPS]
        shown = [f"{alarms:,.0f} {mean_s:.1f}/{worst_s:.1f}" for alarms, mean_s, worst_s in cells]
        print(f"{text:34}" + "".join(f"{cell:>18}" for cell in shown))


def noise_cell(text: str, flip: float, *, hours: float, faults: int) -> tuple[float, float, float]:
    """Run one formula at one flip probability.

    Returns
    -------
    False alarms an hour while the property holds (after an alarm the formula starts anew), mean and largest delay in
    seconds from the moment at which it breaks.
    """
    rng = np.random.default_rng(int(1000 * flip))
    formula, shared = parse_formula(text), SharedWork()
    alarms = _alarms(formula, shared, rng.random(int(hours * 36_000)) >= flip)
    delays_s = []
    for _ in range(faults):
        before = 30
        truth = np.arange(before + 600) < before
        found = [k for k in _alarms(formula, shared, truth ^ (rng.random(len(truth)) < flip)) if k >= before]
        delays_s.append((found[0] - before) * STEP_US / 1e6)
    return len(alarms) / hours, float(np.mean(delays_s)), max(delays_s)


def _alarms(formula: Formula, shared: SharedWork, values: "np.ndarray[Any, np.dtype[np.bool_]]") -> list[int]:
    """Give the numbers of the readings at which the formula was violated."""
    found: list[int] = []
    progressor = Progressor(formula, shared=shared)
    for k, value in enumerate(values.tolist()):
        if progressor.progress(k * STEP_US, DictState({"p": value})) is Verdict.FALSE:
            found.append(k)
            progressor = Progressor(formula, shared=shared)
    return found


def main() -> None:
    known = {"speed": speed, "monitors": monitors, "peers": peers, "noise": noise}
    for name in sys.argv[1:] or known:
        print(f"-- {name}")
        known[name]()


if __name__ == "__main__":
    main()
