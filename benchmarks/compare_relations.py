"""Are relations that are computed from the cars of a log those of a run that watched them?

Scenes and tracks of 60 s are processed with all relations watched. From the cars of that log all of them are computed
again, as for a run that watched none; changes are the same if name, arguments, time and values are, and what rests on a
link that was refuted does not count. The library is then recognised in both: the same, or moved in time, lost, gained.

``python -m benchmarks.compare_relations [--folder FOLDER]``
"""

import argparse
import re
import tempfile
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from benchmarks.bench_memory import LOST
from benchmarks.evaluate_scenes import KINDS, made_scene
from benchmarks.whole_runs import process_whole
from chronicles import library
from chronicles.events import Event
from chronicles.recogniser import recognise
from service.cli.app import run
from service.cli.printing import format_table
from service.questions.observations.computed_relations import computed_relations
from service.questions.observations.run_sites import ground_of
from service.questions.observations.stored_events import stored_events
from service.runs.processing import RunRequest
from service.store.log import open_log

SECONDS = 60
SCENES = (("rural", 3), ("rural uav", 3), ("junction", 1))
TRACKS = (("rural_overtaking", ()), ("junction", ()), ("junction", LOST))
TITLES = ("input", "changes", "computed", "the same", "events", "the same", "moved", "lost", "gained")
_ATTRIBUTE = re.compile(r"^attribute (\w+)\[(\?\w+)(.*?)\]", re.MULTILINE)


def main() -> None:
    """Print a row for each input."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="keeps the scenes; default: they are made and thrown away")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="relations_") as own:
        folder = options.folder or Path(own)
        rows = []
        for name, seed in SCENES:
            scene = made_scene(KINDS[name], folder, seed=seed, seconds=SECONDS)
            rows.append([f"{name}, seed {seed}", *_compared(scene / "video.mp4", scene / "site.toml", Path(own))])
        for name, faults in TRACKS:
            tracks = Path(own) / "tracks.csv"
            run(["trajectories", name, "--out", str(tracks), "--seed", "3", "--seconds", str(SECONDS), *faults])
            title = f"tracks of {name}{', lost and exchanged' if faults else ''}"
            rows.append([title, *_compared(tracks, tracks.with_name("site.toml"), Path(own))])
    print(format_table(TITLES, rows), end="")


def every_relation() -> str:
    """Write chronicles that look at each relation."""
    found = _ATTRIBUTE.findall(library.relations_text())
    return "\n".join(
        f"chronicle w_{name}[{first}](t1) {{ event({name}[{first}{rest}]:(?, ?), t1) }}" for name, first, rest in found
    )


def _compared(source: Path, site: Path, folder: Path) -> list[str]:
    chronicle, path = folder / "every.chronicle", str(folder / "log.db")
    chronicle.write_text(every_relation())
    name = process_whole(RunRequest(source, site, path, chronicle_files=(chronicle,), again=True)).run
    with open_log(path) as log:
        record = log.run(name)
        stored = stored_events(log, record.id)
        computed = [
            Event(one.name, one.args, one.t_us, one.old, one.new, confidence=one.confidence)
            for one in computed_relations(log, record, record.relations, ground_of(record, "all relations"))
        ]
    changes = [
        Counter((one.name, one.args, one.t_us, one.old, one.new) for one in found)
        for found in (stored.events, computed)
    ]
    events = [_library_events(found, stored.until_us) for found in (stored.events, computed)]
    left, new = (Counter(one[:2] for one in (events[a] - events[1 - a]).elements()) for a in (0, 1))
    counts = (
        changes[0].total(),
        changes[1].total(),
        (changes[0] & changes[1]).total(),
        events[0].total(),
        (events[0] & events[1]).total(),
        (left & new).total(),
        (left - new).total(),
        (new - left).total(),
    )
    return [str(one) for one in counts]


def _library_events(events: Iterable[Event], until_us: int) -> Counter[tuple[object, ...]]:
    found = recognise(library.load_library(), events, until_us=until_us)
    return Counter((one.chronicle, tuple(sorted(one.roles.items())), one.start_us, one.end_us) for one in found)


if __name__ == "__main__":
    main()
