"""Which words does a grammar know, and which tables does it give for reading them?

Lark reads a grammar and makes the LALR(1) tables. They are run by `reading.py` and not by Lark, which spends most of
its time on the places of trees that nobody keeps; so the tables are put here into the form that a short loop needs.
"""

import re
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any  # lark leaves its tables untyped

END = "$END"


@dataclass(frozen=True, slots=True)
class Reduction:
    """What becomes of the `count` parts of a finished rule.

    `picks` are the parts that count, -1 for a part that is left out; those in `lists` are lists to be taken apart.
    The result is a list for a rule inside another one (`builder` ""), the only part where `is_transparent` and there
    is one, and otherwise what the method `builder` makes of the parts.
    """

    origin: str
    builder: str
    count: int
    picks: tuple[int, ...]
    lists: frozenset[int]
    is_transparent: bool

    def select(self, parts: list[Any]) -> list[Any]:  # Any: words, and what builders make
        """Pick the parts that count."""
        if not self.lists:
            return [parts[index] if index >= 0 else None for index in self.picks]
        found: list[Any] = []
        for index in self.picks:
            if index in self.lists:
                # A list that grows by one is handed on: to copy it each time takes long for thousands of values.
                found = [*found, *parts[index]] if found else parts[index]
            else:
                found.append(parts[index] if index >= 0 else None)
        return found


@dataclass(frozen=True, slots=True)
class Grammar:
    """The words and the tables.

    `pattern` matches one word, its group names the kind; `keywords` gives the kinds of words that `NAME` would match;
    `spellings` is what a user types for each kind that has one spelling; `ignored` kinds are blanks and comments.
    `rows[state][kind]` is the next state (shift) or a reduction, `after[state][rule]` the state after a rule. `starts`
    is the first state of each rule that may stand alone; a text is read when one of the `ends` is reached.
    """

    pattern: re.Pattern[str]
    keywords: Mapping[str, str]
    spellings: Mapping[str, str]
    ignored: frozenset[str]
    rows: Mapping[int, Mapping[str, int | Reduction]]
    after: Mapping[int, Mapping[str, int]]
    starts: Mapping[str, int]
    ends: frozenset[int]

    def accepts(self, states: Iterable[int], kind: str) -> bool:
        """Say whether a word of this kind fits after what led to a stack of states."""
        stack = list(states)
        while (action := self.rows[stack[-1]].get(kind)) is not None:
            if isinstance(action, int):
                return True
            del stack[len(stack) - action.count :]
            stack.append(self.after[stack[-1]][action.origin])
            if kind == END and stack[-1] in self.ends:
                return True
        return False

    def expected(self, states: list[int]) -> frozenset[str]:
        """Give the kinds of words that fit after what led to a stack of states."""
        return frozenset(kind for kind in self.rows[states[-1]] if self.accepts(states, kind))

    def where(self, shifts: Callable[[frozenset[str]], bool]) -> frozenset[int]:
        """Give the states in which the words that fit make a condition true."""
        kinds = {state: [kind for kind, act in row.items() if isinstance(act, int)] for state, row in self.rows.items()}
        return frozenset(state for state, found in kinds.items() if shifts(frozenset(found)))


@cache  # A grammar is a constant that takes 70 ms to load: loaded when the first text is parsed, not on import.
def load_grammar(package: str, file: str, *starts: str) -> Grammar:
    """Load a grammar of a package; a text of it, or a part that stands alone, is one of the rules `starts`."""
    from lark import Lark

    text = files(package).joinpath(file).read_text(encoding="utf-8")
    lark = Lark(text, parser="lalr", lexer="basic", start=list(starts))
    table = lark.parse_interactive("", start=starts[0]).parser_state.parse_conf.parse_table
    rows, after = _tables(table.states, {rule.origin.name for rule in lark.rules})
    pattern, keywords = _words(lark.terminals)
    return Grammar(
        pattern,
        keywords,
        {one.name: one.pattern.value for one in lark.terminals if one.pattern.type == "str"},
        frozenset(lark.ignore_tokens),
        rows,
        after,
        dict(table.start_states),
        frozenset(table.end_states.values()),
    )


def _tables(
    states: Mapping[int, Mapping[str, tuple[Any, Any]]], rules: Container[str]
) -> tuple[dict[int, dict[str, int | Reduction]], dict[int, dict[str, int]]]:
    """Part what words do in a state from what finished rules do; Lark marks the next state by `Shift` in both."""
    from lark.parsers.lalr_analysis import Shift

    reductions: dict[int, Reduction] = {}  # by identity: to hash one of Lark's rules takes longer than to convert it
    rows: dict[int, dict[str, int | Reduction]] = {}
    after: dict[int, dict[str, int]] = {}
    for state, row in states.items():
        after[state] = {name: target for name, (_, target) in row.items() if name in rules}
        rows[state] = {}
        for kind, (action, argument) in row.items():
            if kind in rules:
                continue
            if action is not Shift and id(argument) not in reductions:
                reductions[id(argument)] = _reduction(argument)
            rows[state][kind] = argument if action is Shift else reductions[id(argument)]
    return rows, after


def _reduction(rule: Any) -> Reduction:
    """Take from a rule of Lark's what its tree builder would do: marks are dropped, `[...]` leaves a gap."""
    gaps = [*rule.options.empty_indices] or [False] * len(rule.expansion)
    picks: list[int] = []
    lists: set[int] = set()
    index = 0
    for is_gap in gaps:
        if is_gap:
            picks.append(-1)
            continue
        symbol = rule.expansion[index]
        if not (symbol.is_term and symbol.filter_out):
            picks.append(index)
        if not symbol.is_term and symbol.name.startswith("_"):
            lists.add(index)
        index += 1
    origin = str(rule.origin.name)
    builder = "" if origin.startswith("_") else str(rule.alias or origin)
    is_transparent = bool(rule.options.expand1) and rule.alias is None
    return Reduction(origin, builder, len(rule.expansion), tuple(picks), frozenset(lists), is_transparent)


def _words(terminals: Iterable[Any]) -> tuple[re.Pattern[str], dict[str, str]]:
    """Make the pattern of all words in the order in which Lark tries them, and the keywords."""
    ordered = sorted(
        terminals,
        key=lambda one: (-one.priority, -one.pattern.max_width, -len(one.pattern.value), one.name),
    )
    keywords = {
        one.pattern.value: one.name for one in ordered if one.pattern.type == "str" and one.pattern.value.isidentifier()
    }
    others = [one for one in ordered if one.pattern.value not in keywords]
    return re.compile("|".join(f"(?P<{one.name}>{one.pattern.to_regexp()})" for one in others)), keywords
