"""Why a relation was false, by name of the setting: from files of tracks to the answer, and from states alone."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from chronicles.explanation.explanations import Failure, HoldReading, ValueSpan, WhyNot
from chronicles.explanation.json_form import schema, to_json
from chronicles.explanation.rendering import render
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.questions.recognition.thresholds import _because
from service.records.seen import CarState
from service.runs.graph.relations import stored_settings
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from tests.chronicles.explanation.schema_check import faults
from tests.service.logs import run, state
from tests.service.tracks import HEADER

SECOND = 1_000_000
SITE = """\
name = "field"
start_utc = 2026-01-01T00:00:00Z
[frame]
origin_lat_deg = 58.0
origin_lon_deg = 15.0
"""


def absent_pass(folder: Path, aside_m: float, *, site: str = SITE) -> WhyNot:
    """Drive a past b at a distance sideways, off all roads, and ask why there was no pass."""
    rows = [
        f"{100_000 * k},{car},{x_m:.2f},{y_m},0.0,{speed_mps},4.5,1.8"
        for k in range(120)
        for car, x_m, y_m, speed_mps in (("a", 1.5 * k, 0.0, 15.0), ("b", 60.0 + 0.5 * k, aside_m, 5.0))
    ]
    (folder / "t.csv").write_text("\n".join([HEADER, *rows, ""]))
    (folder / "site.toml").write_text(site)
    url = f"sqlite:///{folder / 'log.db'}"
    process(RunRequest(folder / "t.csv", folder / "site.toml", url))
    with open_log(url) as log:
        return Explainer(log).explain_absence(
            AbsenceQuestion(chronicle="pass", roles={"passer": "car1", "passed": "car2"})
        )


def reasons(found: WhyNot) -> list[str]:
    return [one.because for miss in found.near_misses for one in miss.failures if one.because]


def test_a_pass_too_far_aside_names_the_setting_and_what_was_measured(tmp_path: Path) -> None:
    found = absent_pass(tmp_path, 12.6)
    assert found.recognised == 0
    assert "the lateral distance was 12.60 m, above relations.beside_lateral_m (12)" in reasons(found)[0]
    assert f"first: {reasons(found)[0]}\n     so t1: no beside[car1, car2]" in render(found)
    said = to_json(found)
    assert faults(said, schema(), schema()) == []
    assert reasons(found)[0] in [one.get("because") for miss in said["near_misses"] for one in miss["failures"]]


def test_the_settings_are_those_that_the_run_had(tmp_path: Path) -> None:
    found = absent_pass(tmp_path, 4.0, site=f"{SITE}[relations]\nbeside_lateral_m = 3.0\n")
    assert "the lateral distance was 4.00 m, above relations.beside_lateral_m (3)" in reasons(found)[0]


def test_what_is_true_has_no_reason(tmp_path: Path) -> None:
    found = absent_pass(tmp_path, 4.0)
    assert found.recognised == 1
    assert reasons(found) == []


def because(folder: Path, name: str, cars: Sequence[Sequence[CarState]]) -> str:
    """Ask why a relation of one or two cars was false in the first second."""
    names = ", ".join(states[0].car for states in cars)
    span = ValueSpan("false", None, None, None)
    held = HoldReading(
        kind="hold",
        text="",
        line=1,
        start_us=0,
        end_us=SECOND,
        subject=f"{name}[{names}]",
        wanted="true",
        spans=(span,),
    )
    with open_log(f"sqlite:///{folder / 'log.db'}", "w") as log:
        writer = log.begin_run(run())
        writer.append_frames([one.t_us for one in cars[0]])
        for now in zip(*cars, strict=True):
            writer.append_states(now)
        writer.finish("finished")
        return _because(log, "r1", stored_settings(run()), Failure("hold", 0, held), (None, None))


CASES = {
    "close": ({}, {"x_m": 40.0}, "the distance between the bodies was 35.50 m, above relations.close_m (25)"),
    "following": ({}, {"x_m": 60.0}, "the time gap was 3.99 s, above relations.following_s (3)"),
    "short_headway": (
        {"speed_mps": 8.0},
        {"x_m": 10.0},
        "the speed was 8.00 m/s, below relations.short_headway_least_mps (8.33)",
    ),
    "same_direction": (
        {"road": "", "lane": ""},
        {"x_m": 9.0, "road": "", "lane": "", "heading_rad": 0.8},
        "the angle between the headings was 0.80 rad, above relations.heading_limit_rad (0.645772)",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_each_relation_names_its_setting(tmp_path: Path, name: str) -> None:
    one, other, expected = CASES[name]
    cars = [[state(0, "car1", **one)], [state(0, "car2", **other)]]  # type: ignore[arg-type]  # fields of any type, by name
    assert because(tmp_path, name, cars) == f"at 00:00.000 {expected}"


def test_the_frame_that_came_nearest_is_told(tmp_path: Path) -> None:
    slow = [state(t_us, "car1", speed_mps=speed) for t_us, speed in ((0, 0.5), (400_000, 1.5), (800_000, 0.2))]
    expected = "at 00:00.400 the speed was 1.50 m/s, below relations.moving_mps (2)"
    assert because(tmp_path, "moving", [slow]) == expected


UNSAID = {
    "in two lanes the way across is not stored": ("following", {"lane": "road1_1", "x_m": 60.0}),
    "on two roads there may be a route": ("beside", {"road": "road2", "lane": "road2_0", "y_m": 15.0}),
    "no setting says who is behind": ("beside", {"road": "", "lane": "", "x_m": 20.0}),
    "a name that is no relation": ("honking", {}),
}


@pytest.mark.parametrize("case", UNSAID)
def test_what_the_log_cannot_tell_is_not_told(tmp_path: Path, case: str) -> None:
    name, other = UNSAID[case]
    cars = [[state(0, "car1")], [state(0, "car2", **other)]]  # type: ignore[arg-type]  # fields of any type, by name
    assert because(tmp_path, name, cars) == ""
