"""Are the events that are recognised again in a log those that the run told?

Scenes of 60 s of each kind are processed, and the library is recognised again in what the log has. Events are the same
if type, times, roles, confidence and place are, to the last digit; doubtful and retracted ones do not count.

``python -m benchmarks.compare_stored [--only KIND ...] [--seed 1] [--folder FOLDER]``
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.evaluate_scenes import KINDS, made_scene
from benchmarks.whole_runs import process_whole
from service.cli.printing import format_table
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.recognition.stored_recognition import recognise_stored
from service.records.events import EventRecord
from service.runs.processing import RunRequest
from service.store.log import open_log

SECONDS = 60
TITLES = ("scene", "told", "again", "the same")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=tuple(KINDS), default=tuple(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="keeps the scenes; default: they are made and thrown away")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="stored_") as own:
        folder = options.folder or Path(own)
        scenes = ((name, made_scene(KINDS[name], folder, seed=options.seed, seconds=SECONDS)) for name in options.only)
        rows = [[name, *_compared(scene, Path(own) / "log.db")] for name, scene in scenes]
    print(format_table(TITLES, rows), end="")


def _compared(scene: Path, log: Path) -> list[str]:
    log.unlink(missing_ok=True)
    process_whole(RunRequest(scene / "video.mp4", scene / "site.toml", str(log)))
    with open_log(str(log)) as opened:
        told = _counted(map(decode_event, iterate_events(opened, EventFilter())))
    again = _counted(one.event for one in recognise_stored(str(log), ()).events if one.event.status != "doubtful")
    return [str(count.total()) for count in (told, again, told & again)]


def _counted(events: Iterable[EventRecord]) -> Counter[str]:
    return Counter(repr((one.type, one.start_us, one.end_us, one.roles, one.confidence, one.place)) for one in events)


if __name__ == "__main__":
    main()
