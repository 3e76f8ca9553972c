"""An overtake is told, doubted and taken back: its overtaker was another car all the time.

A car follows a slow one and is lost; another one of its size is seen first beside the slow one, and passes it. That
is taken for the lost car that has overtaken, until the lost car is seen again, still behind.
"""

from pathlib import Path

import pytest

from data_gen.scenarios.catalogue import scenario_named
from service.cli.app import run as dyknow
from service.questions.identity import links_of
from service.questions.queries import EventFilter, decode_event, iterate_events
from service.records import EventRecord
from service.store.log import open_log
from tests.service.tracks import HEADER

S = 1_000_000


def rows(t_s: float, *, comes_back: bool) -> dict[str, str]:
    """Lay out who is seen: all drive to the east, at constant speed."""
    east = "-1.75,0"
    seen = {
        "rear": f"{20 + 5 * t_s},{east},5,4.5,1.8",
        "front": f"{900 + 5 * t_s},{east},5,4.5,1.8",
        "slow": f"{300 + 10 * t_s},{east},10,4.5,1.8",
    }
    if t_s <= 6:
        seen["lost"] = f"{278 + 12 * t_s},{east},12,4.3,1.75"
    if t_s >= 8.5:
        seen["other"] = f"{277.5 + 13 * t_s},{'0.2' if t_s < 11 else '-1.75'},0,13,4.6,1.75"
    if t_s >= 11.8 and comes_back:
        seen["back"] = f"{292 + 10 * t_s},{east},10,4.3,1.75"
    return seen


@pytest.fixture
def logs(tmp_path: Path) -> dict[bool, str]:
    """Process the scene in which the lost car comes back, and the one in which it does not."""
    network = scenario_named("rural_overtaking").network_file
    site = tmp_path / "site.toml"
    site.write_text(
        f'name = "doubted"\n[frame]\norigin_lat_deg = 58.4\norigin_lon_deg = 15.6\n[network]\nsumo = "{network}"\n'
    )
    made = {}
    for comes_back in (True, False):
        tracks, made[comes_back] = tmp_path / f"{comes_back}.csv", str(tmp_path / f"{comes_back}.db")
        frames = [(k * 100_000, rows(k / 10, comes_back=comes_back)) for k in range(180)]
        lines = [f"{t_us},{name},{row}" for t_us, seen in frames for name, row in seen.items()]
        tracks.write_text("\n".join([HEADER, *lines, ""]))
        assert dyknow(["process", str(tracks), "--site", str(site), "--log", made[comes_back]]) == 0
    return made


def overtakes(url: str, *statuses: str) -> list[EventRecord]:
    with open_log(url) as log:
        wanted = EventFilter(types=("overtake",), statuses=statuses)  # type: ignore[arg-type]  # words of the literal
        return [decode_event(text) for text in iterate_events(log, wanted)]


def test_an_overtake_is_taken_back_when_the_car_is_found_elsewhere(logs: dict[bool, str]) -> None:
    assert overtakes(logs[True]) == []
    [told] = overtakes(logs[True], "retracted")
    assert told.revises is not None
    assert 11.8 * S <= told.recognised_us < 12 * S  # when it was taken back, and not when it was told
    with open_log(logs[True]) as log:
        chain = links_of(log, log.run(), told.roles["overtaker"])
    world = [(one.lower, one.verdict, one.start_us) for one in chain if one.level == "world"]
    assert [(lower, verdict) for lower, verdict, _ in world] == [
        ("lost", "validated"),
        ("other", "refuted"),
        ("back", world[2][1]),
    ]
    assert (world[1][2], world[2][2]) == (8.5 * S, 11.8 * S)


def test_an_overtake_stands_when_nothing_speaks_against_it(logs: dict[bool, str]) -> None:
    [told] = overtakes(logs[False])
    assert told.status in ("tentative", "confirmed")


def test_what_was_taken_back_is_listed_when_asked_for(
    logs: dict[bool, str], capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert dyknow(["events", logs[True], "--type", "overtake", "--status", "retracted"]) == 0
    assert "retracted" in capsys.readouterr().out
