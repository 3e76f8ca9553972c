"""Do all executors find what the brute-force oracle of the tests finds, on many random cases?

Each case is a random text (partial orders, variables, noevent, occurs, hold, assert, selection, emitted events, set
attributes) and a random trace with ties and hypotheses. Each executor gets the stored trace; the recogniser gets it
once more out of order, within a lateness. Prints counts; exits with 1 if one result differs from the oracle.
"""

from __future__ import annotations

import argparse
import sys

from tests.chronicles.execution.case_runner import EXECUTORS, disagreements, make_case

_SHOWN = 3


def main(arguments: list[str]) -> int:
    """Check the cases asked for and print counts; give the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.check_executors", description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000, help="number of random cases")
    parser.add_argument("--first-seed", type=int, default=1_000_000, help="seed of the first case")
    parser.add_argument("--executors", nargs="+", default=list(EXECUTORS), help="names of executors")
    options = parser.parse_args(arguments)
    matched = matches = refused = 0
    found: list[str] = []
    for seed in range(options.first_seed, options.first_seed + options.cases):
        case = make_case(seed)
        matched += bool(case.expected)
        matches += len(case.expected)
        refused += case.refused
        found += [f"seed {seed}: {one}" for one in disagreements(case, options.executors)]
    for one in found[:_SHOWN]:
        print(one, end="\n\n")
    print(f"executors         {', '.join(options.executors)}, and the recogniser out of order")
    print(f"cases             {options.cases}")
    print(f"with matches      {matched}")
    print(f"matches           {matches}")
    print(f"refused texts     {refused}")
    print(f"disagreements     {len(found)}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
