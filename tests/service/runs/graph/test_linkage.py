"""What a user changes in the linkage text shows in the run."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from anchoring.hypotheses.language import default_text
from service.cli import printing
from service.cli.app import run
from service.store.log import open_log
from tests.service.tracks import HEADER

# A car that stays at 15 m/s, and a car and a bus that speed up from there by 5 m/s2; how far apart they drive.
VEHICLES = (("a", 0.0, "4.5,1.8", 0), ("b", 5.0, "4.5,1.8", 20), ("c", 5.0, "12.0,2.6", 40))


def drive(folder: Path) -> Path:
    path = folder / "drive.csv"
    rows = [
        f"{100_000 * k},{name},{1.5 * k + gain * k * k / 200},{y_m}.0,0.0,{15.0 + gain * k / 10},{size}"
        for k in range(60)
        for name, gain, size, y_m in VEHICLES
    ]
    path.write_text("\n".join([HEADER, *rows, ""]))
    return path


def process(folder: Path, text: str | None = None, *options: str, name: str = "log.db") -> Path:
    """Run the command; give the log."""
    log, mine = folder / name, folder / "mine.linkage"
    if text is not None:
        mine.write_text(text)
        options = (*options, "--linkage", str(mine))
    assert run(["process", str(drive(folder)), "--log", str(log), "--again", *options]) == printing.OK
    return log


def changed(old: str, new: str) -> str:
    assert old in default_text()
    return default_text().replace(old, new)


def links(log: Path, kind: str, level: str = "car") -> list[tuple[int, str]]:
    """Give when links changed, and their upper objects."""
    with closing(sqlite3.connect(log)) as connection:
        query = "SELECT t_us, upper FROM links WHERE level = ? AND kind = ? ORDER BY t_us, upper"
        return [(int(t_us), str(upper)) for t_us, upper in connection.execute(query, [level, kind])]


def test_names_come_later_where_links_are_established_later(tmp_path: Path) -> None:
    usual = links(process(tmp_path), "established")
    later = links(process(tmp_path, changed("establish_us", "1s"), name="later.db"), "established")
    assert [t_us for t_us, _ in (*usual, *later)] == [400_000] * 3 + [1_000_000] * 3


def test_cars_faster_than_their_norm_are_refuted_and_others_are_not(tmp_path: Path) -> None:
    log = process(tmp_path, changed("speed up to 70 m/s", "speed up to 20 m/s"))
    assert links(log, "established") == [(400_000, "car1"), (400_000, "car2"), (400_000, "car3")]
    assert links(log, "refuted") == [(3_200_000, "car2")]


@pytest.mark.long
def test_formulas_of_any_shape_are_progressed(tmp_path: Path) -> None:
    # Of objects that are seen for a second without a break, nothing is believed any longer.
    log = process(tmp_path, changed("always no_jump\n", "always not always[0, 1s] visible\n"))
    assert {t_us for t_us, _ in links(log, "refuted", level="world")} >= {1_500_000, 2_700_000}
    assert links(process(tmp_path, name="usual.db"), "refuted", level="world") == []


@pytest.mark.long
def test_log_keeps_the_text_and_a_text_is_part_of_what_a_run_is(tmp_path: Path) -> None:
    mine = changed("establish_us", "1s")
    for text in (None, default_text(), mine, mine):
        log = process(tmp_path, text)
    with open_log(str(log)) as opened:
        assert sorted(one.linkage for one in opened.runs()) == ["", mine]


def test_settings_of_the_site_still_set_the_durations_of_the_text(tmp_path: Path) -> None:
    site = tmp_path / "site.toml"
    site.write_text('name = "here"\n[anchoring]\nestablish_us = 700_000\n')
    assert {t_us for t_us, _ in links(process(tmp_path, None, "--site", str(site)), "established")} == {700_000}


def test_wrong_texts_are_refused_by_process_and_found_by_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine, log = tmp_path / "mine.linkage", tmp_path / "log.db"
    mine.write_text(changed("visible and fits", "visible and fts"))
    for arguments in (
        ["process", str(drive(tmp_path)), "--log", str(log), "--linkage", str(mine)],
        ["check", str(mine)],
    ):
        assert run(arguments) == printing.INVALID
        told = capsys.readouterr()
        assert f"{mine}:19:30" in told.out + told.err
        assert "error[F0201]: expected a known feature, got 'fts'" in told.out + told.err
    assert not log.exists()
    mine.write_text(default_text())
    assert run(["check", str(mine)]) == printing.OK
    assert "1 file: 0 errors" in capsys.readouterr().err
