"""The commands for writers of chronicles: check, test, recognise."""

import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from service.cli.app import run
from tests.service.logs import write_small_log

MET = """\
message met[?a, ?b] { ?a in Car  ?b in Car }
chronicle met[?a, ?b](t1, t2) {
  event(close[?a, ?b]:(false, true), t1)
  event(beside[?a, ?b]:(false, true), t2)
  t2 - t1 in [0s, 9s]
  when recognised { report "?a met ?b"  emit met[?a, ?b] }
}
"""
PASSING = 'example "meet" { 1s close[x, y]:(false, true) 2s beside[x, y]:(false, true) expect met[a=x, b=y] 1s..2s }\n'
FAILING = 'example "part" { 1s close[x, y]:(true, false) expect met[a=x, b=y] 1s..2s }\n'
EVENTS = "t_s,name,arg1,arg2,old,new\n2,beside,x,y,false,true\n1,close,x,y,false,true\n"


def written(folder: Path, name: str, text: str) -> str:
    (folder / name).write_text(text)
    return str(folder / name)


def test_check_annotates_for_a_code_host(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET.replace("close[", "clse["))
    assert run(["check", path, "--format", "github"]) == 3
    assert capsys.readouterr().out.startswith(f"::error file={path},line=3,col=9,")


def test_check_tells_what_is_wrong_with_monitors_in_the_format_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, "a.chronicle", MET)
    monitors = written(tmp_path, "b.monitors", "monitor a per Car: always spead[?c] < 50 km/h")
    assert run(["check", path, "--monitors", monitors, "--format", "json"]) == 3
    [found] = json.loads(capsys.readouterr().out)
    assert (found["code"], found["file"], found["edit"]["newText"]) == ("F0201", monitors, "speed")
    assert run(["check", path, "--monitors", monitors, "--format", "github"]) == 3
    assert capsys.readouterr().out.startswith(f"::error file={monitors},line=1,col=27,endColumn=32,title=F0201::")


def test_check_prints_nothing_that_a_terminal_obeys(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "chronicle c { event(\x1b[31ma, t1) } chronicle \x07" + "b" * 6_676
    assert run(["check", written(tmp_path, "a.chronicle", text)]) == 3
    told = capsys.readouterr()
    assert all(line.isprintable() and len(line) < 200 for line in (told.out + told.err).splitlines())


def test_check_without_findings_is_an_empty_list_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", written(tmp_path, "a.chronicle", MET), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_check_bounds_the_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET)
    assert run(["check", path, "--cost", "--rate", "close=2"]) == 0
    assert "t1           19  close*9s + 1" in capsys.readouterr().out
    assert run(["check", path, "--cost", "--rate", "close=often"]) == 2
    assert "expected NAME=HZ, such as behind=0.5, got 'close=often'" in capsys.readouterr().err


LOUD = "message honk[?c]\nchronicle loud[?c](t1) { event(honk[?c], t1) }\n"
OWN_CLASH = "attribute on[?lamp]\nchronicle lit[?lamp](t1) { event(on[?lamp]:(?, true), t1) }\n"


def test_check_doubts_what_no_stream_produces(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", written(tmp_path, "a.chronicle", LOUD), "--stream", "traffic"]) == 0
    shown = capsys.readouterr()
    assert "C0901" in shown.out
    assert shown.err == "1 file: 0 errors, 1 warning\n"


@pytest.mark.parametrize("text", [LOUD, OWN_CLASH, LOUD.split("\n", 1)[1]])
def test_texts_about_events_of_their_own_are_checked_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    path = written(tmp_path, "a.chronicle", text)
    assert run(["check", path, "--cost"]) == 0
    shown = capsys.readouterr()
    assert "error" not in shown.out
    assert "C0901" not in shown.out
    assert "note: taken as texts about their own events; --stream traffic takes them with" in shown.err
    assert run(["check", path, "--stream", "own"]) == 0
    assert "note" not in capsys.readouterr().err


def test_texts_that_look_at_a_relation_are_checked_with_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = OWN_CLASH + "chronicle off[?c](t1) { event(moving[?c]:(?, false), t1) }\n"
    path = written(tmp_path, "a.chronicle", text)
    assert run(["check", path]) == 3
    shown = capsys.readouterr()
    assert "C0203" in shown.out
    assert "note: taken with DyKnow's relations; --stream own" in shown.err
    assert run(["check", written(tmp_path, "b.chronicle", OWN_CLASH), "--stream", "traffic"]) == 3


def test_an_undeclared_name_that_is_nearly_a_relation_is_a_slip(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "chronicle a[?a, ?b](t1) { event(NAME[?a, ?b]:(false, true), t1) }\n"
    path = written(tmp_path, "a.chronicle", text.replace("NAME", "clse"))
    events = written(tmp_path, "e.csv", EVENTS)
    assert run(["check", path]) == 3
    assert "did you mean 'close'?" in capsys.readouterr().out
    for command in (["test", path], ["recognise", events, "--chronicles", path]):
        assert run(command) == 3
        assert capsys.readouterr().err.startswith("note: --stream traffic takes texts with DyKnow's relations")
        assert run([*command, "--stream", "own"]) == 0
        assert "--stream" not in capsys.readouterr().err
    assert run(["check", written(tmp_path, "a.chronicle", text.replace("NAME", "light"))]) == 0


def test_a_name_that_nobody_declares_is_told_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET.replace("close[", "clse["))
    assert run(["check", path, "--format", "json"]) == 3
    assert [one["code"] for one in json.loads(capsys.readouterr().out)] == ["C0201"]


def test_the_examples_of_texts_about_their_own_events_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = 'example "lamp" { 1s on[l]:(false, true) expect lit[lamp=l] 1s..1s }\n'
    path = written(tmp_path, "a.chronicle", OWN_CLASH + example)
    assert run(["test", path]) == 0
    assert capsys.readouterr().err.startswith("1 example: 1 passed, 0 failed\nnote: taken as texts about their own")
    assert run(["test", path, "--stream", "traffic"]) == 3


def test_a_rate_without_a_cost_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", written(tmp_path, "a.chronicle", MET), "--rate", "close=2"]) == 2
    assert "expected --cost to go with it" in capsys.readouterr().err


@pytest.mark.long
def test_the_program_runs_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "service.cli.app", "--version"], capture_output=True, check=True)
    assert done.stdout


def test_check_explains_a_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--explain", "c0201"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("C0201: ")
    assert "Mended:" in shown
    assert run(["check", "--explain", "C9999"]) == 3
    assert "got 'C9999'" in capsys.readouterr().err
    assert run(["check"]) == 2


def test_check_says_that_a_file_holds_no_chronicle(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "empty.chronicle", "# nothing yet\n")
    assert run(["check", path]) == 0
    assert f"warning: {path}: expected a chronicle, got none" in capsys.readouterr().err


def test_format_lays_files_out_in_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", "message honk[ ?c ] // loud\n")
    (tmp_path / "a.chronicle").chmod(0o640)
    (tmp_path / "link.chronicle").symlink_to(path)
    assert run(["format", str(tmp_path / "link.chronicle")]) == 0
    assert (tmp_path / "a.chronicle").read_text() == "message honk[?c]  // loud\n"
    assert (tmp_path / "a.chronicle").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "link.chronicle").is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.chronicle", "link.chronicle"]
    assert capsys.readouterr().err == "1 file: 1 laid out anew\n"
    assert run(["format", path]) == 0
    assert capsys.readouterr().err == "1 file: 0 laid out anew\n"


def test_format_can_check_and_show_without_writing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "message honk[ ?c ]\n"
    path = written(tmp_path, "a.chronicle", text)
    assert run(["format", path, "--check"]) == 5
    assert capsys.readouterr().err == f"{path}\n1 file: 1 would change\n"
    assert run(["format", path, "--diff"]) == 0
    assert capsys.readouterr().out.splitlines()[2:] == ["@@ -1 +1 @@", "-message honk[ ?c ]", "+message honk[?c]"]
    assert Path(path).read_text() == text


def test_format_leaves_a_file_with_an_error_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken, other = "chronicle x( {\n", written(tmp_path, "b.chronicle", "message honk[ ?c ]\n")
    path = written(tmp_path, "a.chronicle", broken)
    assert run(["format", path, other]) == 3
    assert Path(path).read_text() == broken
    assert Path(other).read_text() == "message honk[?c]\n"
    shown = capsys.readouterr().err
    assert shown.startswith("error[")
    assert shown.endswith("2 files: 1 laid out anew, 1 with errors left alone\n")
    assert run(["format", str(tmp_path / "none.chronicle")]) == 3
    assert capsys.readouterr().err.startswith("error: ")


def test_format_reads_standard_input(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("message honk[ ?c ]"))
    assert run(["format", "-"]) == 0
    assert capsys.readouterr().out == "message honk[?c]\n"


def test_examples_that_hold_pass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET + PASSING)
    assert run(["test", path]) == 0
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "1 example: 1 passed, 0 failed\n")
    assert run(["test", path, "--verbose"]) == 0
    assert capsys.readouterr().out == f"ok   {path}:8: meet\n"


def test_an_example_that_fails_is_shown_and_ends_with_5(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET + PASSING + FAILING)
    assert run(["test", path]) == 5
    assert capsys.readouterr().out == f"FAIL {path}:9: part\n  - met[a=x, b=y] 1s..2s\n"
    assert run(["test", path, "--json"]) == 5
    passed, failed = json.loads(capsys.readouterr().out)["examples"]
    assert (passed["passed"], passed["matched"][0]["roles"]) == (True, {"a": "x", "b": "y"})
    assert failed["missing"] == [
        {"chronicle": "met", "roles": {"a": "x", "b": "y"}, "start_us": 1_000_000, "end_us": 2_000_000}
    ]


def test_a_file_with_an_error_is_not_tested(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["test", written(tmp_path, "a.chronicle", MET.replace("close[", "clse["))]) == 3
    assert "did you mean 'close'?" in capsys.readouterr().err


def test_the_examples_of_the_library_hold(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["test"]) == 0
    assert " 0 failed" in capsys.readouterr().err


@pytest.mark.parametrize("executor", ["eager", "backfill"])
def test_events_of_a_file_are_recognised_in_any_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], executor: str
) -> None:
    path, events = written(tmp_path, "a.chronicle", MET), written(tmp_path, "e.csv", EVENTS)
    assert run(["recognise", events, "--chronicles", path, "--executor", executor]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "start      end        type  roles    road  status      sure  source  reports",
        "00:01.000  00:02.000  met   a=x b=y        recognised  1.00  e.csv   x met y",
    ]


def test_live_recognition_leaves_late_events_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, events = written(tmp_path, "a.chronicle", MET), written(tmp_path, "e.csv", EVENTS)
    command = ["recognise", events, "--chronicles", path, "--format", "jsonl", "--evidence", "--lateness"]
    assert run([*command, "500000"]) == 0
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "1 event came too late and was left out\n")
    assert run([*command, "1s", "--executor", "eager"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["start_us"], found["roles"], found["reports"]) == (1_000_000, {"a": "x", "b": "y"}, ["x met y"])
    assert [event["t_us"] for event in found["events"]] == [1_000_000, 2_000_000]
    assert run([*command, "1s", "--executor", "backfill"]) == 2


@pytest.mark.parametrize("executor", ["eager", "backfill"])
def test_start_and_end_are_the_smaller_and_the_larger_time_of_the_header(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], executor: str
) -> None:
    path = written(tmp_path, "a.chronicle", MET.replace("[0s, 9s]", "[-9s, 9s]").replace("(t1, t2)", "(t2, t1)"))
    events = written(tmp_path, "e.csv", EVENTS)
    command = ["recognise", events, "--chronicles", path, "--executor", executor, "--format", "jsonl"]
    assert run(command) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["start_us"], found["end_us"]) == (1_000_000, 2_000_000)
    assert found["sub_events"] == [{"label": "t1", "t_us": 1_000_000}, {"label": "t2", "t_us": 2_000_000}]


@pytest.mark.parametrize("executor", ["auto", "lazy"])
def test_executors_that_are_gone_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], executor: str) -> None:
    events = written(tmp_path, "e.csv", EVENTS)
    assert run(["recognise", events, "--executor", executor]) == 2
    told = capsys.readouterr().err
    assert "eager" in told
    assert "backfill" in told


def test_nothing_recognised_is_a_success(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    events = written(tmp_path, "e.csv", "t_us,name\n")
    out = tmp_path / "found.jsonl"
    assert run(["recognise", events, "--format", "jsonl", "--out", str(out)]) == 0
    assert capsys.readouterr().out == ""
    assert out.read_text() == ""


def test_an_event_file_with_a_fault_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["recognise", written(tmp_path, "e.csv", "t_us,name\nx,p\n")]) == 3
    assert "e.csv:2: column t_us: expected a whole number, got 'x'" in capsys.readouterr().err


ALONE = """\
message honk[?c]
chronicle alone[?c](t1) { event(honk[?c], t1)  noevent(honk[?], (t1 + 1us, t1 + 5s)) }
"""


@pytest.mark.parametrize("name", ["e.csv", "sub/../e.csv", "link.csv", "a.chronicle"])
def test_what_is_read_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    path, events = written(tmp_path, "a.chronicle", MET), written(tmp_path, "e.csv", EVENTS)
    (tmp_path / "sub").mkdir()
    (tmp_path / "link.csv").symlink_to(events)
    assert run(["recognise", events, "--chronicles", path, "--out", str(tmp_path / name)]) == 3
    assert "expected a new file, got one that is being read" in capsys.readouterr().err
    assert (Path(events).read_text(), Path(path).read_text()) == (EVENTS, MET)


def test_a_log_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write_small_log(tmp_path / "a.db")
    before = (tmp_path / "a.db").read_bytes()
    assert run(["recognise", log, "--out", str(tmp_path / "a.db")]) == 3
    assert "got one that is being read" in capsys.readouterr().err
    assert (tmp_path / "a.db").read_bytes() == before


def test_time_goes_on_after_the_last_event_as_far_as_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, events = written(tmp_path, "a.chronicle", ALONE), written(tmp_path, "e.csv", "t_s,name,arg1\n1,honk,a\n")
    command = ["recognise", events, "--chronicles", path, "--format", "jsonl"]
    for live in ([], ["--lateness", "1s"]):
        assert run([*command, *live]) == 0
        assert capsys.readouterr().out == ""
        assert run([*command, *live, "--until", "6s"]) == 0
        assert json.loads(capsys.readouterr().out)["roles"] == {"c": "a"}
    assert run([*command, "--until", "500000"]) == 2
    assert "--until: expected a time not before the last event (1000000 us), got 500000 us" in capsys.readouterr().err


def test_events_that_fit_no_declaration_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    declared = "domain Street = {high, low}\nmessage honk[?c, ?s] { ?s in Street }\n"
    path = written(tmp_path, "a.chronicle", declared + "chronicle any[?c](t1) { event(honk[?c, ?], t1) }\n")
    events = written(
        tmp_path, "e.csv", "t_s,name,arg1,arg2\n1,honk,a,high\n2,honk,a,main\n3,honk,b,main\n4,hunk,a,low\n"
    )
    assert run(["recognise", events, "--chronicles", path]) == 0
    told = capsys.readouterr().err
    inside, declares = "values of 'honk' inside their domains", "events that the texts declare, not 'hunk'"
    assert f"expected {inside}, got 2 events, the first at 2000000 us: honk[a, main]" in told
    assert f"expected {declares}, got 1 event, the first at 4000000 us: hunk[a, low]; did you mean 'honk'?" in told


def test_recognise_shows_the_warnings_that_check_shows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    twice = "event(honk[?a], t1)  event(honk[?a], t2)  t2 - t1 in [0s, 1s]  t2 - t1 in [0s, 2s]"
    path = written(tmp_path, "a.chronicle", f"message honk[?a]\nchronicle twice[?a](t1, t2) {{ {twice} }}\n")
    assert run(["check", path]) == 0
    warning = capsys.readouterr().out.strip()
    assert warning.startswith("warning[")
    for source in (written(tmp_path, "e.csv", EVENTS), write_small_log(tmp_path / "a.db")):
        assert run(["recognise", source, "--chronicles", path]) == 0
        assert warning in capsys.readouterr().err


def test_options_of_a_log_and_of_a_file_are_kept_apart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    events, log = written(tmp_path, "e.csv", EVENTS), write_small_log(tmp_path / "a.db")
    assert run(["recognise", events, "--run", "r1"]) == 2
    assert "--run: expected a log to go with it" in capsys.readouterr().err
    assert run(["recognise", log, "--until", "6s"]) == 2
    assert run(["recognise", log, "--stream", "own"]) == 2
    assert "--stream: expected a file of events to go with it, got a log" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("events", "warning"),
    [
        (
            "1,honk,a,b,,\n2,honk,a,b,,\n",
            "with the arguments and values that the texts have, got 2 events, the first at 1000000 us: honk[a, b]",
        ),
        (
            "1,honk,a,,false,true\n",
            "arguments and values that the texts have, got 1 event, the first at 1000000 us: honk[a]:(false, true)",
        ),
        ("1,hunk,a,,,\n", "expected events 'honk', which chronicle 'alone' looks at, got none; did you mean 'hunk'?"),
        ("1,honk,a,,,\n", ""),
    ],
)
def test_events_that_cannot_match_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], events: str, warning: str
) -> None:
    path = written(tmp_path, "a.chronicle", ALONE)
    file = written(tmp_path, "e.csv", "t_s,name,arg1,arg2,old,new\n" + events)
    assert run(["recognise", file, "--chronicles", path]) == 0
    shown = capsys.readouterr().err
    assert warning in shown
    assert ("warning: " in shown) is bool(warning)
    assert "note: taken as texts about their own events" in shown


def test_messages_that_no_log_holds_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, path = write_small_log(tmp_path / "a.db"), written(tmp_path, "a.chronicle", ALONE)
    assert run(["recognise", log, "--chronicles", path]) == 0
    assert "got 'honk', which chronicle 'alone' looks at and nothing gives" in capsys.readouterr().err


def test_texts_for_a_file_of_events_may_use_the_names_of_relations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, "a.chronicle", OWN_CLASH)
    events = written(tmp_path, "e.csv", "t_s,name,arg1,old,new\n1,on,l,false,true\n")
    assert run(["recognise", events, "--chronicles", path, "--format", "jsonl"]) == 0
    assert json.loads(capsys.readouterr().out)["roles"] == {"lamp": "l"}
    assert run(["recognise", events, "--chronicles", path, "--stream", "traffic"]) == 3
