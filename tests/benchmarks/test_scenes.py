"""The tables of scenes: what is made and processed, and how figures stand beside the aims."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.evaluate_scenes import KINDS, Measured, _figure, _overtake_row, _scene_name, _seen_row, made_scene
from data_gen.scenarios.catalogue import SCENARIOS
from service.questions.scoring.evaluate import evaluate_events, positions_from_rows
from service.questions.scoring.scene_scores import CARS, OBJECTS, Compared
from tests.service.questions.scoring.support import rows


def test_every_kind_is_of_a_scenario_that_exists() -> None:
    assert {kind.scenario for kind in KINDS.values()} <= SCENARIOS.keys()


def test_kinds_share_a_scene_only_if_they_differ_in_how_it_is_processed() -> None:
    names = [_scene_name(kind) for kind in KINDS.values()]
    assert _scene_name(KINDS["rural"]) == _scene_name(KINDS["rural 5 fps"])
    assert len(set(names)) == len(names) - 1


def test_scene_that_is_there_is_not_made_again(tmp_path: Path) -> None:
    scene = tmp_path / f"{_scene_name(KINDS['rural'])}_seed3_60s"
    scene.mkdir()
    (scene / "site.toml").write_text("written last")
    assert made_scene(KINDS["rural 5 fps"], tmp_path, seed=3, seconds=60) == scene
    assert [one.name for one in scene.iterdir()] == ["site.toml"]


@pytest.mark.parametrize(
    ("value", "aim", "is_least", "text"),
    [
        (0.995, 0.99, True, "0.995 (>= 0.99)"),
        (0.985, 0.99, True, "0.985! (>= 0.99)"),
        (0.36, 0.35, False, "0.360! (<= 0.35)"),
        (0.5, None, True, "0.500"),
        (None, 0.99, True, "-"),
        (float("nan"), 0.35, False, "-"),
    ],
)
def test_figure_stands_beside_its_aim(value: float | None, aim: float | None, is_least: bool, text: str) -> None:
    assert _figure(value, aim, is_least=is_least) == text


def test_row_tells_what_was_seen_and_followed() -> None:
    true = rows([(k, "a", float(k), 0.0) for k in range(4)])
    found = rows([(k, f"v{k // 2}", k + 0.5, 0.0) for k in range(4)])
    nowhere = positions_from_rows([0], ["a"], [(0.0, 0.0)])
    overtakes = evaluate_events([], nowhere, [], nowhere, event_type="overtake")
    measured = Measured((Compared({OBJECTS: (true, found), CARS: (true, true)}),), overtakes, (6.0, 10.0))
    cells = [cell.strip() for cell in _seen_row("rural", measured, {"precision": 0.99, "speed": 9.0}).split("|")[1:-1]]
    assert cells[:5] == ["rural", "1.000 (>= 0.99)", "1.000", "0.500", "0.500"]
    assert cells[5:8] == ["-", "0.500", "1.000"]
    assert cells[9:] == ["1", "8.0! (>= 9)"]
    assert np.isfinite(float(cells[8]))
    assert _overtake_row("rural", measured, {}) == "| rural | 0 | 0 | 0 | 0 | - | - | - | - |"
