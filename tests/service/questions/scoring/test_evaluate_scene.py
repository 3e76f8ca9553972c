"""Is this the truth of the scene that the run saw?"""

from pathlib import Path

import pytest

from service.cli.app import run as run_command
from service.questions.scoring.evaluate_log import scene_doubts
from service.records.runs import RunStatus
from service.store.log import open_log
from tests.service.logs import run, state

STEP_US = 100_000


def log(folder: Path, site: str = "crossing", status: RunStatus = "finished") -> str:
    """Write a run of ten seconds in which one car drives east at 10 m/s."""
    url = f"sqlite:///{folder / 'log.db'}"
    with open_log(url, "w") as written:
        writer = written.begin_run(run(site=site))
        for frame in range(100):
            writer.append_frames([frame * STEP_US])
            writer.append_states([state(frame * STEP_US, "car1", float(frame), 0.0)])
        writer.finish(status)
    return url


def truth(folder: Path, *, y_m: float = 0.0, from_us: int = 0, site: str | None = "crossing") -> Path:
    where = folder / "truth"
    where.mkdir()
    columns = "t_us,id,class,x_m,y_m,heading_rad,speed_mps,length_m,width_m,visible"
    rows = [f"{from_us + frame * STEP_US},sim1,car,{float(frame)},{y_m},0,10,4,2,1" for frame in range(100)]
    (where / "truth.csv").write_text("\n".join([columns, *rows]))
    (where / "truth_events.jsonl").write_text("")
    if site is not None:
        (where / "site.toml").write_text(f'name = "{site}"\nstart_utc = 2026-05-01T08:00:00Z\n')
    return where


@pytest.mark.parametrize("site", ["crossing", None], ids=["with its site", "truth alone"])
def test_the_truth_of_the_same_scene_raises_no_doubt(tmp_path: Path, site: str | None) -> None:
    assert scene_doubts(log(tmp_path), truth(tmp_path, y_m=1.0, site=site)) == ()


def test_another_site_is_told_by_its_name(tmp_path: Path) -> None:
    (doubt,) = scene_doubts(log(tmp_path), truth(tmp_path, site="roundabout"))
    assert doubt.endswith("expected the truth of the site that the run was given, 'crossing', got that of 'roundabout'")


@pytest.mark.long
def test_cars_where_the_truth_has_nobody_are_told(tmp_path: Path) -> None:
    (doubt,) = scene_doubts(log(tmp_path), truth(tmp_path, y_m=5.0))
    assert "expected a vehicle of the truth within 2 m of most cars that run r1 saw, got one at 0% of them" in doubt


def test_a_truth_of_other_times_is_told(tmp_path: Path) -> None:
    (doubt,) = scene_doubts(log(tmp_path), truth(tmp_path, from_us=60_000_000))
    assert "at which run r1 saw cars, 0.00 s to 9.90 s, got one for 60.00 s to 69.90 s" in doubt


def test_a_run_that_was_cut_is_told(tmp_path: Path) -> None:
    (doubt,) = scene_doubts(log(tmp_path, status="interrupted"), truth(tmp_path))
    assert doubt == "run 'r1' of demo.mp4 was interrupted; it covers 00:00.000 to 00:09.900"


def test_a_doubt_is_a_warning_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["evaluate", log(tmp_path), str(truth(tmp_path, y_m=5.0)), "--what", "detection"]
    run_command(arguments)
    assert capsys.readouterr().err.startswith(f"warning: {tmp_path / 'truth'}: expected a vehicle of the truth")
