"""Which events of one type does the product tell of a file of tracks, and are they those of the scene's truth?"""

from importlib.resources import as_file, files
from pathlib import Path

from benchmarks.whole_runs import process_whole
from data_gen.outputs.track_scene import TrackScene
from service.questions.scoring.evaluate import Evaluation
from service.questions.scoring.evaluate_log import evaluate_log
from service.runs.processing import RunRequest


def score_recognition(scene: TrackScene, file: Path, event_type: str) -> Evaluation:
    """Run everything after vision, with the one shipped chronicle, and score what it tells.

    Parameters
    ----------
    scene : whose truth it is. file : the tracks; a log beside it is written anew. event_type : names the chronicle too.
    """
    log = file.with_suffix(".db")
    log.unlink(missing_ok=True)
    with as_file(files("chronicles.library") / f"{event_type}.chronicle") as chronicle:
        site = scene.folder / "site.toml"
        process_whole(RunRequest(input=file, site=site, log_url=str(log), chronicle_files=(chronicle,)))
    return evaluate_log(str(log), scene.folder, event_type=event_type)
