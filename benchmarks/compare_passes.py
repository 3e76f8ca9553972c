"""How many listed passes are in a log? Events of one type against a list made by somebody else.

``python -m benchmarks.compare_passes LOG LIST.csv`` takes a log made from a trajectory file and a CSV file with the
columns ``t_start, t_end`` (seconds), ``overtaker, overtaken`` (identifiers of the trajectory file). A listed pass is
found when an event of the same ordered pair overlaps it, give or take two seconds.
"""

import argparse
import csv
from collections import Counter, defaultdict
from pathlib import Path

from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.scoring.proportions import wilson_interval
from service.records.events import EventRecord
from service.store.log import EventLog, open_log

MARGIN_US = 2_000_000

Intervals = dict[tuple[str, str], list[tuple[int, int]]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log")
    parser.add_argument("list", type=Path)
    parser.add_argument("--type", default="pass")
    options = parser.parse_args()
    with open_log(options.log) as log:
        recognised = recognised_passes(log, options.type)
    listed = _listed(options.list)
    found, listed_count = overlapping(listed, recognised), sum(map(len, listed.values()))
    on_list, claimed = overlapping(recognised, listed), sum(map(len, recognised.values()))
    low, high = wilson_interval(found, listed_count)
    print(
        f"listed passes found: {found} of {listed_count} = {found / listed_count:.3f} (95 %: {low:.3f} to {high:.3f})"
    )
    print(f"recognised, on the list: {on_list} of {claimed}; the others are {_sort_of_others(recognised, listed)}")


def recognised_passes(log: EventLog, event_type: str = "pass") -> Intervals:
    """List when each object of a trajectory file passed each other one."""
    run = log.run()
    intervals: Intervals = defaultdict(list)
    for text in iterate_events(log, EventFilter(types=(event_type,), runs=(run.id,))):
        event = decode_event(text)
        passer, passed = (_file_id(log, run.id, event, role) for role in ("passer", "passed"))
        intervals[passer, passed].append((event.start_us, event.end_us))
    return intervals


def _file_id(log: EventLog, run_id: str, event: EventRecord, role: str) -> str:
    """Return which object of the trajectory file played a role: a car symbol may have several, one after another."""
    states = [state for state in log.states(run_id, cars=(event.roles[role],), to_us=event.end_us) if state.vision_id]
    during = [state.vision_id for state in states if state.t_us >= event.start_us - MARGIN_US]
    # Who was hidden all the time is whom we saw last.
    return Counter(during or [states[-1].vision_id]).most_common(1)[0][0]


def _listed(path: Path) -> Intervals:
    intervals: Intervals = defaultdict(list)
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            times = (round(float(row["t_start"]) * 1e6), round(float(row["t_end"]) * 1e6))
            intervals[row["overtaker"], row["overtaken"]].append(times)
    return intervals


def overlapping(these: Intervals, those: Intervals) -> int:
    """Count the intervals of one list that overlap one of the same pair in the other, within the margin."""
    return sum(
        any(start <= other_end + MARGIN_US and other_start <= end + MARGIN_US for other_start, other_end in those[pair])
        for pair, intervals in list(these.items())
        for start, end in intervals
    )


def _sort_of_others(recognised: Intervals, listed: Intervals) -> str:
    same_pair = sum(len(times) for pair, times in recognised.items() if listed[pair])
    total = sum(map(len, recognised.values()))
    return (
        f"of a pair that is listed at another time ({same_pair - overlapping(recognised, listed)}) or not at all "
        f"({total - same_pair})"
    )


if __name__ == "__main__":
    main()
