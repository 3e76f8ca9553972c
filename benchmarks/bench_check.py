"""How long does checking a chronicle text of 1,000 lines take, with all diagnostics?

The text has about 70 chronicles with events, absences, holds, counts, constraints and emitted events. Parsing and
compiling are timed apart; loading the grammar, once
a process and no part of the check, is a row of its own. Best of seven runs.

    python -m benchmarks.bench_check [--lines 1000]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable

from chronicles import check_texts
from chronicles.language.parser import parse
from dyknow.language.diagnostics import Reporter

HEAD = """domain Car = symbol
domain Road = symbol
domain Truth = {true, false}
constant patience = 20s
attribute behind[?a, ?b] { ?a in Car  ?b in Car  value in Truth }
attribute beside[?a, ?b] { ?a in Car  ?b in Car  value in Truth }
attribute on[?car, ?road] { ?car in Car  ?road in Road  value in Truth }
message enter[?car] { ?car in Car }
message leave[?car] { ?car in Car }
"""
# 14 lines: about 70 of them make 1,000.
CHRONICLE = """# what happens when number {n} is looked at
message seen{n}[?a, ?b] {{ ?a in Car  ?b in Car }}
chronicle manoeuvre{n}[?a, ?b, ?road](t1, t3) {{
  event(beside[?a, ?b]:(false, true), t1)
  event(beside[?a, ?b]:(true, false), t2)
  event(enter[?a], t3)
  hold(on[?a, ?road]:true, (t1, t2))
  hold(behind[?a, ?b]:true, (t1 - 600ms, t1 - 100ms))
  noevent(leave[?a], (t1, t3))
  noevent(enter[?other], (t1 - 2s, t1))
  t2 - t1 in [1s, 60s]
  t3 - t2 in ]0s, patience]
  when recognised {{ emit seen{n}[?a, ?b] }}
}}
"""
START = """
import time
from chronicles.language.parser import grammar
start = time.perf_counter()
grammar()
print(time.perf_counter() - start)
"""


def text(lines: int) -> str:
    """Write a text of about so many lines, without errors."""
    count = (lines - HEAD.count("\n")) // CHRONICLE.count("\n")
    return HEAD + "".join(CHRONICLE.format(n=number) for number in range(count))


def best_ms(run: Callable[[], object]) -> float:
    """Run seven times; give the best time."""
    spent = []
    for _ in range(7):
        start = time.perf_counter()
        run()
        spent.append(time.perf_counter() - start)
    return min(spent) * 1000


def grammar_ms() -> float:
    """Measure how long a new process takes to load the grammar, and Lark for it."""
    done = subprocess.run([sys.executable, "-c", START], check=True, capture_output=True, text=True)
    return float(done.stdout) * 1000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lines", type=int, default=1000)
    written = text(parser.parse_args().lines)
    found = check_texts([("text", written)])
    parse_ms = best_ms(lambda: parse(written, "text", Reporter({"text": written})))
    check_ms = best_ms(lambda: check_texts([("text", written)]))
    print(f"{written.count(chr(10)):,} lines, {len(found)} findings")
    rows = {"parse": parse_ms, "compile": check_ms - parse_ms, "check": check_ms, "load the grammar": grammar_ms()}
    for name, spent_ms in rows.items():
        print(f"{name:18}{spent_ms:8.1f} ms")


if __name__ == "__main__":
    main()
