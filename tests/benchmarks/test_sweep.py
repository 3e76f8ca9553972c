"""The table of a page, where some settings are swept again."""

from pathlib import Path

from benchmarks.sweep_settings import HEADER, _rewrite


def test_rows_of_settings_that_were_not_swept_stay_in_their_order(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    for after in ("\n", "\n\nMore.\n"):
        page.write_text(f"Before.\n\n{HEADER}\n| `a.x` | 1 | old |\n| `a.gone` | 1 | old |\n| `b.y` | 1 | old |{after}")
        _rewrite(page, {"b.y": "| `b.y` | 2 | new |", "a.z": "| `a.z` | 3 | new |"}, ["a.x", "a.z", "b.y"])
        rows = "| `a.x` | 1 | old |\n| `a.z` | 3 | new |\n| `b.y` | 2 | new |"
        assert page.read_text() == f"Before.\n\n{HEADER}\n{rows}{after}"
