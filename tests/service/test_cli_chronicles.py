"""The commands for writers of chronicles: check, test, recognise."""

import io
import json
from pathlib import Path

import pytest

from service.cli.app import run

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


def test_check_without_findings_is_an_empty_list_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", written(tmp_path, "a.chronicle", MET), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_check_bounds_the_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET)
    assert run(["check", path, "--cost", "--rate", "close=2"]) == 0
    assert "t1           19  close*9s + 1" in capsys.readouterr().out
    assert run(["check", path, "--cost", "--rate", "close=often"]) == 2
    assert "expected NAME=HZ, such as behind=0.5, got 'close=often'" in capsys.readouterr().err


def test_check_doubts_what_no_stream_produces(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "message honk[?c]\nchronicle loud[?c](t1) { event(honk[?c], t1) }\n"
    assert run(["check", written(tmp_path, "a.chronicle", text)]) == 0
    shown = capsys.readouterr()
    assert "honk" in shown.out
    assert "0 errors, 1 warnings" in shown.err


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


def test_format_reads_standard_input(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("message honk[ ?c ]"))
    assert run(["format", "-"]) == 0
    assert capsys.readouterr().out == "message honk[?c]\n"


def test_examples_that_hold_pass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.chronicle", MET + PASSING)
    assert run(["test", path]) == 0
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "1 examples: 1 passed, 0 failed\n")
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


@pytest.mark.parametrize("executor", ["eager", "lazy", "backfill", "auto"])
def test_events_of_a_file_are_recognised_in_any_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], executor: str
) -> None:
    path, events = written(tmp_path, "a.chronicle", MET), written(tmp_path, "e.csv", EVENTS)
    assert run(["recognise", events, "--chronicles", path, "--executor", executor]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "start      end        chronicle  roles    reports",
        "00:01.000  00:02.000  met        a=x b=y  x met y",
    ]


def test_live_recognition_leaves_late_events_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, events = written(tmp_path, "a.chronicle", MET), written(tmp_path, "e.csv", EVENTS)
    command = ["recognise", events, "--chronicles", path, "--format", "jsonl", "--lateness"]
    assert run([*command, "500000"]) == 0
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "1 events came too late and were left out\n")
    assert run([*command, "1s", "--executor", "lazy"]) == 0
    lazy = capsys.readouterr().out
    assert run([*command, "1s"]) == 0
    eager = capsys.readouterr().out
    assert lazy == eager
    found = json.loads(eager)
    assert (found["start_us"], found["roles"], found["reports"]) == (1_000_000, {"a": "x", "b": "y"}, ["x met y"])
    assert [event["t_us"] for event in found["events"]] == [1_000_000, 2_000_000]
    assert run([*command, "1s", "--executor", "backfill"]) == 2


def test_nothing_recognised_is_a_success(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    events = written(tmp_path, "e.csv", "t_us,name\n")
    out = tmp_path / "found.jsonl"
    assert run(["recognise", events, "--format", "jsonl", "--out", str(out)]) == 0
    assert capsys.readouterr().out == ""
    assert out.read_text() == ""


def test_an_event_file_with_a_fault_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["recognise", written(tmp_path, "e.csv", "t_us,name\nx,p\n")]) == 3
    assert "e.csv:2: column t_us: expected a number, got 'x'" in capsys.readouterr().err
