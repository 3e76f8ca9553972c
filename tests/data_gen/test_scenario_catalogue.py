"""Scenarios by name, their options, and the networks they ship."""

import os
from pathlib import Path

import numpy as np
import pytest

from data_gen.errors import DataGenError
from data_gen.scenarios.catalogue import SCENARIOS, scenario_named
from data_gen.simulation.simulate import simulate

FOLDER = Path(scenario_named("junction").network_file).parents[1]
NETWORKS = sorted(FOLDER.glob("*/network.net.xml"))


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        (
            "rural_overtaking",
            {"block": "1"},
            r"scenario 'rural_overtaking': expected options out of blocked=0\|1, aborted=.*, got 'block'",
        ),
        ("rural_overtaking", {"blocked": "yes"}, "option 'blocked': expected 0 or 1, got 'yes'"),
        ("junction", {"lights": ""}, "option 'lights': expected fixed or actuated, got ''"),
        ("meeting_only", {"demand": "low"}, "scenario 'meeting_only': expected no options, got 'demand'"),
        ("moon", {}, "scenario: expected one of following_only, .*, got 'moon'"),
    ],
    ids=["unknown", "flag", "choice", "none-known", "scenario"],
)
def test_what_is_not_known_is_refused(name: str, options: dict[str, str], message: str) -> None:
    with pytest.raises(DataGenError, match=message):
        scenario_named(name, options)


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_value_of_every_option_makes_a_scenario(name: str) -> None:
    for option in SCENARIOS[name].options:
        made = [scenario_named(name, {option.name: value}) for value in option.values]
        assert made[0] == scenario_named(name)
        assert all(a != b for number, a in enumerate(made) for b in made[:number])


@pytest.mark.parametrize("name", SCENARIOS)
def test_shares_sum_to_one_in_every_flow(name: str) -> None:
    for flow in scenario_named(name).flows:
        if flow.kinds:
            assert sum(kind.share for kind in flow.kinds) == pytest.approx(1.0)


@pytest.mark.parametrize("network", NETWORKS, ids=lambda path: path.parent.name)
def test_a_network_ships_with_its_sources_and_tells_nothing_of_the_machine(network: Path) -> None:
    text = network.read_text(encoding="utf-8")
    assert len(text) < 200_000
    assert "<!--" not in text
    assert len(list(network.parent.glob("*.nod.xml"))) == len(list(network.parent.glob("*.edg.xml"))) == 1
    assert os.access(network.parent / "build.sh", os.X_OK)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "options"),
    [("rural_overtaking", {"aborted": "1"}), ("lane_change_only", {}), ("urban_grid", {})],
    ids=["attempts", "lane-changes", "parked"],
)
def test_a_longer_clip_begins_with_the_shorter_one(name: str, options: dict[str, str]) -> None:
    short, long = (
        simulate(
            scenario_named(name, options),
            seed=2,
            rng=np.random.default_rng(2),
            duration_us=seconds * 1_000_000,
            step_us=100_000,
        )
        for seconds in (4, 25)
    )
    for step, same in zip(short, long, strict=False):
        assert step.ids == same.ids
        np.testing.assert_array_equal(step.centre_m, same.centre_m)
        np.testing.assert_array_equal(step.appearance, same.appearance)
