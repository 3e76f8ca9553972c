"""Chronicles change while a run goes on: is what it tells in the end what it would have told with the last ones?"""

import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any  # what opens an input

import pytest

from service.questions.recognition.explaining import Explainer
from service.runs import activation, processing
from service.runs.processing import Progress, RunSummary, process
from service.runs.requests import RunRequest
from service.store.log import open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from tests.service.logs import read_all, read_rows
from tests.service.runs.graph.test_hidden_passes import PASSES, rows
from tests.service.tracks import HEADER

pytestmark = pytest.mark.long

BESIDE = "chronicle beside_it[?a, ?b](t1, t2) { event(beside[?a, ?b]:(false, true), t1) t2 = t1 }"
# What is near, which the first texts do not look at; and what rests on another chronicle.
NEAR = "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(?, true), t1) }"
AFTER = """
message passes[?a, ?b]
chronicle passes_twice[?a, ?b](t1, t2) { event(passes[?a, ?], t1) event(passes[?b, ?], t2) t2 - t1 in ]0s, 20s] }
"""
SHORTER = PASSES.replace("t2 - t1 in [0s, 30s]", "t2 - t1 in [0s, 5s]", 1)
CHANGES = {
    "another beside it": (PASSES, PASSES + NEAR),
    "another rule": (PASSES + NEAR, SHORTER + NEAR),
    "what others look at": (PASSES + AFTER, SHORTER + AFTER),
    "what must not happen": (PASSES, PASSES.replace("t2 + 5s", "t2 + 4s")),
    "one less": (PASSES + NEAR, PASSES),
    "a comment": (PASSES, "# what passes\n" + PASSES),
}
AT_US = (6_500_000, 8_900_000, 19_000_000)
"""While one and while two cars are lost, and at the end."""


@pytest.fixture(autouse=True)
def always_looked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(activation, "LOOKED_EVERY_S", 0.0)


def written(folder: Path) -> Path:
    path = folder / "t.csv"
    path.write_text("\n".join([HEADER, *rows(), ""]))
    return path


@pytest.fixture
def tracks(tmp_path: Path) -> Path:
    return written(tmp_path)


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Give the log of the tracks processed with a text that stays; nobody writes into it."""

    @cache
    def log(text: str, *, final: bool = False) -> str:
        folder = tmp_path_factory.mktemp("unchanged")
        run(written(folder), str(folder / "a.db"), text, final=final)
        return str(folder / "a.db")

    return log


def run(tracks: Path, log: str, text: str, *changes: tuple[int, Callable[[], object]], **request: object) -> RunSummary:
    """Process tracks with a text; at each of some media times, in microseconds, something is done."""
    chronicles = tracks.with_suffix(".chronicle")
    chronicles.write_text(text)
    waiting = list(changes)

    def on_progress(progress: Progress) -> None:
        while waiting and progress.media_us >= waiting[0][0]:
            waiting.pop(0)[1]()

    asked = RunRequest(tracks, None, log, (chronicles,), is_live=True, **request)  # type: ignore[arg-type]  # by name
    done = process(asked, on_progress=on_progress)
    assert done.status == "finished"
    assert not waiting
    return done


def change(tracks: Path, text: str) -> Callable[[], object]:
    return lambda: tracks.with_suffix(".chronicle").write_text(text)


def told(log: str) -> list[tuple[str, str, int, int, Sequence[tuple[str, str]], float, object]]:
    """Tell what stands in a log."""
    return sorted(
        (
            one.type,
            one.chronicle.version,
            one.start_us,
            one.end_us,
            sorted(one.roles.items()),
            one.confidence,
            one.place,
        )
        for one in read_all(log)
    )


USUAL = {("another rule", False, 0), ("what others look at", False, 1), ("what others look at", True, 0)}
USUAL |= {("what must not happen", False, 2)}  # of which all others say as much


@pytest.mark.parametrize(
    ("kind", "final", "at"),
    [
        pytest.param(*one, marks=() if one in USUAL else pytest.mark.slow)
        for one in product(CHANGES, (False, True), range(len(AT_US)))
    ],
)
def test_a_run_tells_in_the_end_what_it_would_have_told_with_the_last_chronicles(
    tracks: Path, unchanged: Callable[..., str], kind: str, final: bool, at: int
) -> None:
    first, last = CHANGES[kind]
    whole, changed = unchanged(last, final=final), str(tracks.with_name("a.db"))
    done = run(tracks, changed, first, (AT_US[at], change(tracks, last)), final=final)
    assert told(changed) == told(whole) != []
    assert done.progress.events == len(told(whole))
    with open_log(changed) as one, open_log(whole) as other:
        assert (one.run().chronicles, one.run().texts) == (other.run().chronicles, other.run().texts)
        assert one.run().id == other.run().id


@pytest.mark.parametrize("at_us", [9_000_000, 11_200_000], ids=["before", "after others met"])
def test_who_is_hidden_as_chronicles_change_may_have_met_somebody(tmp_path: Path, at_us: int) -> None:
    """Nobody sees a from 5 s to 11.4 s; it is near b at 8.9 s, and c, which comes the other way, at 11 s."""
    lines = [HEADER]
    for frame in range(75):
        t_s = frame / 5
        a = "a" if t_s < 5 else "" if t_s < 11.4 else "a2"
        for name, x_m, y_m, heading_rad, speed_mps in (
            (a, 19 * t_s, 0.0, 0.0, 19.0),
            ("b", 180 + 2 * t_s, 3.0, 0.0, 2.0),
            ("c", 440 - 19 * t_s, 6.0, math.pi, 19.0),
        ):
            if name:
                lines.append(f"{frame * 200_000},{name},{x_m:.2f},{y_m},{heading_rad},{speed_mps},4.5,1.8")
    tracks, changed, whole = tmp_path / "t.csv", str(tmp_path / "a.db"), str(tmp_path / "b.db")
    tracks.write_text("\n".join([*lines, ""]))
    run(tracks, whole, BESIDE + NEAR)
    run(tracks, changed, BESIDE, (at_us, change(tracks, BESIDE + NEAR)))
    assert told(changed) == told(whole)
    assert [one.type for one in read_all(changed)].count("near") == 6


def test_chronicles_that_stay_are_not_told_again(tracks: Path, unchanged: Callable[..., str]) -> None:
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES, (12_000_000, change(tracks, PASSES + NEAR)))
    of_passes = [[one for one in read_rows(each) if one.type != "near"] for each in (log, unchanged(PASSES))]
    assert [(one.type, one.status, one.start_us, one.recognised_us) for one in of_passes[0]] == [
        (one.type, one.status, one.start_us, one.recognised_us) for one in of_passes[1]
    ]


def test_what_was_told_of_a_chronicle_that_ends_is_taken_back_and_stays_in_the_log(tracks: Path) -> None:
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES + NEAR, (12_000_000, change(tracks, PASSES)))
    near = [one for one in read_rows(log) if one.type == "near"]
    stood = {one.id for one in near if one.status != "retracted"}
    assert stood
    assert {one.revises for one in near if one.status == "retracted"} >= {
        one.id for one in near if one.status == "recognised"
    }
    assert not [one for one in read_all(log) if one.type == "near"]


def test_texts_in_the_log_are_looked_for_besides_while_they_stand(tracks: Path) -> None:
    log = str(tracks.with_name("a.db"))

    def put() -> None:
        with open_log(log) as opened:
            texts = ChronicleTexts(opened)
            texts.put("mine", NEAR, None)

    def end() -> None:
        with open_log(log) as opened:
            texts = ChronicleTexts(opened)
            texts.end("mine", 1)

    counts: list[int] = []
    run(
        tracks,
        log,
        PASSES,
        (5_000_000, put),
        (7_000_000, lambda: counts.append(sum(one.type == "near" for one in read_all(log)))),
        (8_000_000, end),
    )
    assert counts[0] > 0
    assert not [one for one in read_all(log) if one.type == "near"]
    with open_log(log) as opened:
        assert [one.name for one in opened.run().chronicles] == ["passes", "alone"]


def test_a_text_in_the_log_that_does_not_go_with_the_others_is_left_out(tracks: Path) -> None:
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES)

    def put() -> None:
        with open_log(log) as opened:
            texts = ChronicleTexts(opened)
            texts.put("passes", SHORTER, None)
            texts.put("mine", NEAR, None)

    tracks.write_text(tracks.read_text() + "\n")  # another input, so another run
    run(tracks, log, PASSES, (5_000_000, put))
    with open_log(log) as opened:
        record = opened.runs()[-1]
    assert [one.name for one in record.chronicles] == ["passes", "alone", "near"]
    (warning,) = [one for one in record.warnings if "chronicle text" in one]
    assert warning.startswith(
        "chronicle text 'passes' of the log: expected one that goes with the others, got error[C0"
    )
    tracks.write_text(tracks.read_text() + "\n")
    done = run(tracks, log, PASSES)  # which finds the texts there
    assert [one.name for one in done.record.chronicles] == ["passes", "alone", "near"]
    assert warning in done.warnings


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("chronicle passes[?a](t1) { event(", "error[C0"),
        (PASSES + "chronicle passes[?a](t1) { event(moving[?a]:(?, true), t1) }", "error[C0"),
        ("# nothing\n", "expected at least one chronicle, got none"),
    ],
)
def test_a_text_that_is_wrong_is_told_and_changes_nothing(
    tracks: Path, unchanged: Callable[..., str], text: str, said: str, caplog: pytest.LogCaptureFixture
) -> None:
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES, (5_000_000, change(tracks, text)))
    assert "the chronicles stay as they are: " in caplog.text
    assert said in caplog.text
    assert caplog.text.count("stay as they are") == 1
    assert told(log) == told(unchanged(PASSES))


def test_what_monitors_look_at_stays(tracks: Path, caplog: pytest.LogCaptureFixture) -> None:
    monitors = tracks.with_name("m.monitors")
    monitors.write_text("monitor calm per ?a in Car: always (passes[?a, ?] implies eventually[0s, 5s] moving[?a])\n")
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES, (5_000_000, change(tracks, SHORTER)), monitor_files=(monitors,))
    assert "chronicle passes: expected one whose events no monitor looks at, got another" in caplog.text
    caplog.clear()
    other = str(tracks.with_name("b.db"))
    run(tracks, other, PASSES, (5_000_000, change(tracks, PASSES + NEAR)), monitor_files=(monitors,))
    assert "stay as they are" not in caplog.text
    assert [one for one in read_all(other) if one.type == "near"]


def test_what_changes_before_the_first_frame_is_not_missed(tracks: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opening = processing.open_input

    def open_late(*given: Any, **options: Any) -> Any:
        tracks.with_suffix(".chronicle").write_text(PASSES + NEAR)
        return opening(*given, **options)

    monkeypatch.setattr(processing, "open_input", open_late)
    done = run(tracks, str(tracks.with_name("a.db")), PASSES)
    assert [one.name for one in done.record.chronicles] == ["passes", "alone", "near"]


def test_a_repeat_stays_with_the_chronicles_that_it_began_with(tracks: Path) -> None:
    log = str(tracks.with_name("a.db"))
    run(tracks, log, PASSES)
    run(tracks, log, PASSES + NEAR, (5_000_000, change(tracks, SHORTER)), again=True)
    with open_log(log) as opened:
        assert [one.name for one in opened.run().chronicles] == ["passes", "alone", "near"]
    assert [one for one in read_all(log) if one.type == "near"]


def test_explanations_are_those_of_the_chronicles_of_now(tracks: Path) -> None:
    log = str(tracks.with_name("a.db"))
    with open_log(str(tracks.with_name("a.db")), "w") as opened:
        explainer = Explainer(opened)
        found: list[str] = []

        def ask() -> None:
            event = next(one for one in read_all(log) if one.type == "passes")
            explained = explainer.explain_event(event.id)
            assert explained is not None
            found.append(explained.render())

        run(tracks, log, PASSES, (12_000_000, ask), (13_000_000, change(tracks, SHORTER)), (14_000_000, ask))
    assert "allowed 0.000 s to 30.000 s" in found[0]
    assert "allowed 0.000 s to 5.000 s" in found[1]


def test_a_file_that_goes_on_to_change_is_taken_each_time(tracks: Path, unchanged: Callable[..., str]) -> None:
    log = str(tracks.with_name("a.db"))
    texts = (PASSES + NEAR, SHORTER + NEAR, PASSES + AFTER, PASSES + BESIDE)
    changes = [(3_000_000 * (k + 1), change(tracks, text)) for k, text in enumerate(texts)]
    run(tracks, log, PASSES, *changes)
    assert told(log) == told(unchanged(texts[-1]))
