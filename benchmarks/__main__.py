"""Run every benchmark, or those named: `python -m benchmarks [gis vision ...]`."""

import importlib
import sys
from pathlib import Path


def main() -> None:
    """Run `main()` of each `bench_*.py`, one after another."""
    known = sorted(path.stem.removeprefix("bench_") for path in Path(__file__).parent.glob("bench_*.py"))
    wanted = sys.argv[1:] or known
    unknown = sorted(set(wanted) - set(known))
    if unknown:
        sys.exit(f"benchmarks: expected names out of {', '.join(known)}, got {unknown[0]!r}")
    for name in wanted:
        print(f"== {name}", flush=True)
        sys.argv = [f"bench_{name}"]  # some take options of their own when run alone
        importlib.import_module(f"benchmarks.bench_{name}").main()


if __name__ == "__main__":
    main()
