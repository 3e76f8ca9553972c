"""Compiled conditions say what progressors say, state by state."""

import re
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
import pytest

from anchoring.hypotheses.adapter import Progressed, load_linkage
from anchoring.hypotheses.conditions import Condition, Verdict, compiled
from anchoring.hypotheses.language import FLUENTS, default_text
from anchoring.settings import AnchoringSettings
from dyknow.mtl.parser import parse_formula
from dyknow.mtl.progression.shared_work import SharedWork

SETTINGS = AnchoringSettings()
NAMES = ("visible", "separate", "uncontested")
ESTABLISH = (
    "visible",
    "visible and separate",
    "visible until [ 0us , oo ] visible",
    "visible until [ 300000us , oo ] visible",
    "( visible and separate ) until [ 400000us , oo ] ( separate and visible )",
    "( visible and separate ) until [ 100001us , oo ] ( visible and separate and uncontested )",
    "visible until [ 0us , oo ] ( visible and uncontested )",
)
MAINTAIN = (
    "always visible",
    "always not ( not visible until [ 0us , oo ] not visible )",
    "always not ( not visible until [ 200001us , oo ] not visible )",
    "always separate and always not ( not visible until [ 300000us , oo ] not visible ) and always uncontested",
    "always visible and always not ( not visible until [ 300000us , oo ] not visible )",
    (
        "always not ( not visible until [ 300000us , oo ] not visible ) "
        "and always not ( not visible until [ 900000us , oo ] not visible )"
    ),
    (
        "always not ( not visible until [ 1us , oo ] not visible ) "
        "and always not ( not separate until [ 400000us , oo ] not separate )"
    ),
)
NOT_USUAL = (
    "not visible",
    "eventually visible",
    "visible or separate",
    "always visible",
    "visible until [ 100us , 200us ] visible",
    "visible until [ 100us , oo ] separate",
    "visible and separate until [ 100us , oo ] visible",
    "visible until [ 100us , oo ] visible and separate",
    "visble",
)
NOT_KEPT = (
    "visible",
    "always ( visible and separate )",
    "always not visible",
    "always not ( not visible until [ 100us , oo ] not separate )",
    "always not ( not visible until [ 100us , 200us ] not visible )",
    "always visible or always separate",
    "always visible and separate",
    "always true",
)


def streams(seed: int, *, count: int = 300) -> Iterator[tuple[int, Mapping[str, bool]]]:
    """Give fluents that hold for some states and then fail, at even, uneven or odd times."""
    rng = np.random.default_rng(seed)
    state, t_us = dict.fromkeys(NAMES, True), 0
    for _ in range(count):
        # Some times lie just at, before or behind the end of a window that began with an earlier state.
        t_us += 100_000 if seed % 3 == 0 else int(rng.choice([1, 33_366, 99_999, 100_000, 100_001, 250_000, 900_000]))
        state = {name: bool(rng.random() < (0.9 if value else 0.4)) for name, value in state.items()}
        yield t_us, state


def disagreement(one: Condition, other: Condition, seed: int) -> int | None:
    """Find the first state in which two conditions differ, up to the one that refutes both."""
    for k, (t_us, state) in enumerate(streams(seed)):
        found = one.progress(t_us, state)
        if other.progress(t_us, state) is not found:
            return k
        if found is Verdict.FALSE:
            return None
    return None


@pytest.mark.long
def test_compiled_conditions_say_what_the_progressor_says() -> None:
    seen = set()
    for texts, is_lasting in ((ESTABLISH, False), (MAINTAIN, True)):
        for text in texts:
            fast = compiled(text, FLUENTS, is_lasting=is_lasting)
            assert fast is not None, text
            slow = partial(Progressed, parse_formula(text), SharedWork(), is_lasting=is_lasting)
            for seed in range(8):
                assert disagreement(fast(), slow(), seed) is None, (text, seed)
            condition = fast()
            seen |= {condition.progress(t_us, state) for t_us, state in streams(1)}
    assert seen == set(Verdict)


def test_other_formulas_are_left_to_the_progressor() -> None:
    for texts, is_lasting in ((NOT_USUAL, False), (NOT_KEPT, True)):
        for text in texts:
            assert compiled(text, FLUENTS, is_lasting=is_lasting) is None, text


def test_conditions_that_call_themselves_idle_stay_as_they_are_in_equal_states() -> None:
    formulas = (*ESTABLISH, *NOT_USUAL[:-1]), (*MAINTAIN, *NOT_KEPT[:-1])
    for texts, is_lasting in zip(formulas, (False, True), strict=True):
        for text in texts:
            slow = partial(Progressed, parse_formula(text), SharedWork(), is_lasting=is_lasting)
            made = [slow, compiled(text, FLUENTS, is_lasting=is_lasting) or slow]
            for maker in made:
                skipping, asked_always = maker(), maker()
                before: Mapping[str, bool] = {}
                verdict = Verdict.UNKNOWN
                for k, (t_us, state) in enumerate(streams(2)):
                    if state != before or not skipping.is_idle:
                        verdict = skipping.progress(t_us, state)
                    before = state
                    assert verdict is asked_always.progress(t_us, state), (text, k)
                    if is_lasting and verdict is Verdict.FALSE:
                        break


def test_default_links_are_all_compiled_and_say_what_their_text_says() -> None:
    text = re.sub("#.*", "", default_text())
    odd = re.sub(r"(establish|maintain):(.*?);", r"\1: not not (\2);", text, flags=re.DOTALL)
    slow, fast = (load_linkage(one, SETTINGS).linkages for one in (odd, text))
    rng = np.random.default_rng(5)
    for one, other in zip(slow, fast, strict=True):
        for kind in ("establish", "reestablish", "maintain"):
            condition, progressed = getattr(other, kind)(), getattr(one, kind)()
            assert "Progressed" not in type(condition).__name__
            assert "Progressed" in type(progressed).__name__
            state = dict.fromkeys(FLUENTS, True)
            for t_us in np.cumsum(rng.integers(1, 300_000, 400)).tolist():
                state = {name: bool(rng.random() < (0.97 if value else 0.6)) for name, value in state.items()}
                found = condition.progress(t_us, state)
                assert found is progressed.progress(t_us, state), (one.level, kind, t_us)
                if found is Verdict.FALSE:
                    condition, progressed = getattr(other, kind)(), getattr(one, kind)()
