"""`dyknow demo`: does it work here? A scene is made, processed and compared with its truth."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson
from service.cli.printing import format_table, print_json
from service.records.times import format_media

if TYPE_CHECKING:
    from service.questions.scoring.evaluate import Evaluation, TrueEvent
    from service.records.events import EventRecord

SCENARIO = "rural_overtaking"
PORT = 8420


def demo(
    out: Annotated[Path, typer.Option(help="Folder for everything the demo makes.")] = Path("out/demo"),
    seed: Annotated[int, typer.Option(min=0, help="Another seed, other traffic.")] = 3,
    seconds: Annotated[float, typer.Option(min=10.0, max=86_400.0, help="Length of the video.")] = 60.0,
    as_json: AsJson = False,
) -> None:
    """Make a scene, process it, and show recognised overtakes beside the truth."""
    from data_gen.outputs.scene import generate
    from service.cli.asking.evaluate import describe
    from service.cli.making.generate import drawing_bar
    from service.cli.making.process import leave_if_cut, progress_bar, tell_if_cut
    from service.questions.scoring.evaluate_log import evaluate_log
    from service.runs.processing import process
    from service.runs.requests import RunRequest

    scene, log = out / "scene", str(out / "log.db")

    def say(line: str) -> None:
        if not as_json:
            print(line, flush=True)

    out.mkdir(parents=True, exist_ok=True)
    # The demo shows one run: another seed before would leave its run in the log.
    for old in out.glob("log.db*"):
        old.unlink()
    say(f"1. A road with {seconds:.0f} s of simulated traffic ({SCENARIO}, seed {seed}), drawn as video ...")
    with drawing_bar("drawing") as on_frame:
        generate(SCENARIO, seed=seed, duration_us=round(seconds * 1e6), out_dir=scene, progress=on_frame)
    say("2. The video goes through vision, anchoring, relations and chronicles ...")
    request = RunRequest(scene / "video.mp4", scene / "site.toml", log, workers=None)
    with progress_bar("processing") as on_progress:
        summary = process(request, on_progress=on_progress)
    tell_if_cut(summary)
    leave_if_cut(summary)
    evaluation = evaluate_log(log, scene, event_type="overtake", run=summary.run)
    if as_json:
        files = {"log": log, "video": str(scene / "video.mp4"), "site": str(scene / "site.toml")}
        print_json({"run": summary.run, "status": summary.status, **files, "evaluation": evaluation.as_record()})
        return
    print("3. Overtakes, recognised from the video alone, beside what really happened:\n")
    titles = ("recognised", "from", "to", "truth", "from", "to", "")
    print(format_table(titles, [row[1:] for row in sorted(_rows(evaluation))]), end="")
    print(f"\n{describe(evaluation)}")
    progress = summary.progress
    print(f"speed     {progress.real_time_factor:.1f} x real time ({progress.frames_per_s:.0f} frames/s)")
    _print_next_steps(out, scene, log)


def _rows(evaluation: "Evaluation") -> "Iterator[tuple[str, ...]]":
    for verdict, matches in (("right", evaluation.right), ("border", evaluation.border)):
        for match in matches:
            claim, fact = match.recognised, match.true
            yield (f"{claim.start_us:015d}", *_cells(claim), *_cells(fact), verdict)
    for claim in evaluation.wrong:
        yield (f"{claim.start_us:015d}", *_cells(claim), "", "", "", "wrong")
    for fact in evaluation.missed:
        yield (f"{fact.start_us:015d}", "", "", "", *_cells(fact), "missed")


def _cells(event: "EventRecord | TrueEvent") -> tuple[str, str, str]:

    pair = f"{event.roles['overtaker']} overtakes {event.roles['overtaken']}"
    return pair, format_media(event.start_us), format_media(event.end_us)


def _print_next_steps(out: Path, scene: Path, log: str) -> None:
    dyknow = sys.argv[0] if Path(sys.argv[0]).name == "dyknow" else "dyknow"
    print(f"""
Ask for them:
  {dyknow} events {log} --type overtake
  {dyknow} serve {log} --port {PORT} &
  curl 'http://127.0.0.1:{PORT}/api/v1/events?type=overtake&limit=3'
See them:
  {dyknow} draw {scene / "video.mp4"} {log} --out {out / "drawn.mp4"}
Files:
  {log}  event log
  {scene / "video.mp4"}  video
  {scene / "site.toml"}  roads and camera
  {scene / "truth.csv"}  what really happened""")
