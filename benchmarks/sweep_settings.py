"""What does each setting change? Every one halved and doubled, on scenes with truth.

``python -m benchmarks.sweep_settings --write docs/settings.md`` makes the scenes that are not there yet, processes each
once as shipped and, for every setting, twice with that one number changed in a site file, as a user would. A room is
tried on the scenes that its code sees. The figures are those of `dyknow evaluate`, pooled over these scenes: precision
and recall of what vision sees, IDF1 of the cars, all as changes in thousandths, and the change in the number of events;
``=`` says that not one row of the log changed, and ``refused`` that the site file may not say so. ``--only
vision.background`` tries the settings whose names begin so.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import pickle
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from itertools import chain
from multiprocessing import get_context
from pathlib import Path
from typing import get_args

from anchoring.settings import AnchoringSettings
from benchmarks.pooled_scores import pooled
from benchmarks.whole_runs import process_whole
from data_gen.outputs.scene import generate
from qsr.settings import RelationSettings
from service.errors import InputError
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.scoring.scene_scores import CARS, Compared, compare_log, score_scene
from service.records.events import EventStatus
from service.runs.processing import RunRequest
from service.store.log import open_log
from vision.settings import VisionSettings

SECONDS = 10
SIZE_PX = (960, 540)
SEED = 1
FACTORS = (0.5, 2.0)
GENERATED: Mapping[str, tuple[str, str]] = {
    "rural": ("rural_overtaking", "vertical"),
    "junction": ("junction", "vertical"),
    "oblique": ("rural_overtaking", "oblique"),
    "drone": ("rural_overtaking", "uav"),
}
GOLDEN: Mapping[str, str] = {"detections": "found.csv", "junction_tracks": "tracks.csv"}
ROOT = Path(__file__).parents[1]
GOLDEN_FOLDER = ROOT / "tests" / "golden"
PACKAGES = ("anchoring", "chronicles", "data_gen", "dyknow", "gis", "qsr", "service", "vision")
CODE = (".py", ".lark", ".kpl", ".chronicle", ".linkage")
SCENES_OF: Mapping[str, tuple[str, ...]] = {
    "vision.registration": ("drone",),
    "vision.networks": ("detections",),
    "vision.background": ("junction",),
    "vision.road": ("oblique",),
    "vision.detection": ("junction",),
    "vision.tracking": ("rural",),
    "vision": ("rural", "drone"),
    "anchoring": ("junction_tracks",),
    "relations": ("junction_tracks",),
}
"""By the first two parts of a setting's name."""
TREES = {"vision": VisionSettings(), "anchoring": AnchoringSettings(), "relations": RelationSettings()}


@dataclass(frozen=True, slots=True)
class Setting:
    """Name one number of the trees, and say what is tried instead."""

    room: str
    name: str
    value: float

    @property
    def path(self) -> str:
        """Return its name with those of its rooms."""
        return f"{self.room}.{self.name}"

    @property
    def scenes(self) -> tuple[str, ...]:
        """Return the names of the scenes on which it is tried."""
        return SCENES_OF[".".join(self.room.split(".")[:2])]

    def changed(self, factor: float) -> float:
        """Give the number halved or doubled; whole numbers stay whole."""
        return round(self.value * factor) if isinstance(self.value, int) else self.value * factor


@dataclass(frozen=True, slots=True)
class Outcome:
    """Hold what one log says: a digest of its rows, the number of events, and both sides of the scores."""

    digest: str
    events: int
    compared: Compared | None


Task = tuple[str, Setting | None, float, Path]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=[""], help="beginnings of settings' names; default: all")
    parser.add_argument("--folder", type=Path, default=Path("out/sweep"), help="where the scenes are kept")
    parser.add_argument("--write", type=Path, help="the page in whose table the rows are to be made anew")
    options = parser.parse_args(arguments)
    known = [one for root, tree in TREES.items() for one in walk(tree, root)]
    settings = [one for one in known if one.path.startswith(tuple(options.only))]
    scenes = sorted({scene for one in settings for scene in one.scenes})
    for scene in scenes:
        _make(scene, options.folder)
    tasks: list[Task] = [(scene, None, 1.0, options.folder) for scene in scenes]
    tasks += [(scene, one, by, options.folder) for one in settings for by in (0.5, 2.0) for scene in one.scenes]
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        outcomes = dict(zip([task[:3] for task in tasks], pool.map(_remembered, tasks), strict=True))
    rows = {one.path: _row(one, outcomes) for one in settings}
    print("\n".join([HEADER, *rows.values()]))
    if options.write:
        _rewrite(options.write, rows, [one.path for one in known])


def walk(tree: object, room: str) -> Iterator[Setting]:
    """Give every number of a tree of dataclasses, depth first."""
    for field in fields(tree):  # type: ignore[arg-type]  # a dataclass, as all rooms
        value = getattr(tree, field.name)
        if is_dataclass(value):
            yield from walk(value, f"{room}.{field.name}")
        elif isinstance(value, int | float):
            yield Setting(room, field.name, value)


def _make(scene: str, folder: Path) -> None:
    made = folder / scene
    if scene in GOLDEN:
        shutil.copytree(GOLDEN_FOLDER / scene, made, dirs_exist_ok=True)
    elif not (made / "site.toml").exists():  # written last, so a scene that was cut short is made anew
        scenario, camera = GENERATED[scene]
        generate(
            scenario,
            seed=SEED,
            duration_us=SECONDS * 1_000_000,
            out_dir=made,
            width_px=SIZE_PX[0],
            height_px=SIZE_PX[1],
            camera=camera,  # type: ignore[arg-type]  # a text of `GENERATED`
        )


def _remembered(task: Task) -> Outcome | None:
    """Take an outcome from the folder, if an earlier sweep of the same code was cut short."""
    name = hashlib.sha256(repr((*task[:3], _code())).encode()).hexdigest()[:16]
    path = task[3] / f"{name}.outcome"
    if not path.exists():
        path.write_bytes(pickle.dumps(_try(task)))
    return pickle.loads(path.read_bytes())  # type: ignore[no-any-return]  # what was written above


@cache
def _code() -> str:
    """Give the digest of all that is processed with: the files of the packages."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*")):
            if file.suffix in CODE:
                digest.update(file.read_bytes())
    return digest.hexdigest()


def _try(task: Task) -> Outcome | None:
    """Process a scene with one number changed; None if the site file may not say so."""
    scene, setting, factor, folder = task
    source = folder / scene / GOLDEN.get(scene, "video.mp4")
    with tempfile.TemporaryDirectory(dir=folder) as own:
        site = folder / scene / f"{Path(own).name}.toml"  # beside the scene's own, for the paths in it
        text = (folder / scene / "site.toml").read_text(encoding="utf-8")
        if setting is not None:
            text += f"\n[{setting.room}]\n{setting.name} = {setting.changed(factor)!r}\n"
        site.write_text(text, encoding="utf-8")
        log = Path(own) / "log.db"
        try:
            process_whole(
                RunRequest(source, site, str(log), detector=f"file:{source}" if scene == "detections" else None)
            )
        except InputError:
            if setting is None:
                raise
            return None
        finally:
            site.unlink()
        compared = None if scene in GOLDEN else compare_log(str(log), folder / scene)
        return Outcome(*_rows(str(log)), compared)


def _rows(path: str) -> tuple[str, int]:
    """Return a digest of what a log says, and the number of its events; without identifiers, which differ always."""
    digest = hashlib.sha256()
    with open_log(path) as log:
        run_id = log.run().id
        for row in chain(log.objects(run_id), log.states(run_id), log.relations(run_id)):
            digest.update(repr(row).encode())
        events = [decode_event(text) for text in iterate_events(log, EventFilter(statuses=get_args(EventStatus)))]
    for one in events:
        digest.update(repr((one.type, one.start_us, one.end_us, one.status)).encode())
    return digest.hexdigest(), len(events)


HEADER = "| setting | shipped | halved: P, R, IDF1, events | doubled: P, R, IDF1, events |\n|---|---|---|---|"


def _row(setting: Setting, outcomes: Mapping[tuple[str, Setting | None, float], Outcome | None]) -> str:
    scenes = setting.scenes
    shipped = [outcomes[scene, None, 1.0] for scene in scenes]
    cells = [_cell(shipped, [outcomes[scene, setting, by] for scene in scenes]) for by in FACTORS]
    return f"| `{setting.path}` | {setting.value:g} | {' | '.join(cells)} |"


def _cell(shipped: Sequence[Outcome | None], changed: Sequence[Outcome | None]) -> str:
    if any(one is None for one in changed):
        return "refused"
    before, after = [one for one in shipped if one], [one for one in changed if one]
    if [one.digest for one in before] == [one.digest for one in after]:
        return "="
    events = sum(one.events for one in after) - sum(one.events for one in before)
    parts = zip(_figures(before), _figures(after), strict=True)
    return ", ".join([*(_difference(old, new) for old, new in parts), f"{events:+d}"])


def _difference(old: float | None, new: float | None) -> str:
    return "-" if old is None or new is None else f"{round(1000 * (new - old)):+d}"


def _figures(outcomes: Sequence[Outcome]) -> tuple[float | None, ...]:
    """Give precision, recall and IDF1 over the scenes that have a truth; nothing if none has."""
    compared = [one.compared for one in outcomes if one.compared is not None]
    if not compared:
        return ()
    score = score_scene(pooled(compared))
    return score.detection.precision, score.detection.recall, score.tracks[CARS].idf1


def _rewrite(page: Path, rows: Mapping[str, str], known: Sequence[str]) -> None:
    """Put rows into the table of a page, which ends at an empty line or with it; rows of other settings stay."""
    before, heading, rest = page.read_text(encoding="utf-8").partition(HEADER)
    assert heading, f"{page}: expected a table headed {HEADER.splitlines()[0]!r}, got none"
    table, empty, after = rest.partition("\n\n")
    rows = {line.split("`")[1]: line for line in table.splitlines() if line} | rows
    lines = [HEADER, *(rows[path] for path in known if path in rows)]
    page.write_text(before + "\n".join(lines) + (empty or "\n") + after, encoding="utf-8")


if __name__ == "__main__":
    main()
