"""Where the command line says nothing, the environment does, else a file, else the default."""

import json
from pathlib import Path

import pytest

from service.cli.app import COMMANDS, run

Capsys = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DYKNOW_CONFIG", raising=False)


def shown(capsys: Capsys, *words: str) -> dict[str, tuple[str | None, str]]:
    assert run(["config", "show", *words, "--json"]) == 0
    settings = json.loads(capsys.readouterr().out)["settings"]
    return {one["name"]: (one["value"], one["from"]) for one in settings}


def refused(capsys: Capsys, *words: str) -> str:
    assert run(words or ["config", "show"]) == 3
    return capsys.readouterr().err


def test_a_flag_goes_before_a_variable_before_the_file_before_the_default(
    capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("dyknow.toml").write_text('[events]\nlogs = ["file.db"]\nlimit = 7\norder = "-start"\n')
    monkeypatch.setenv("DYKNOW_EVENTS_LIMIT", "8")
    settings = shown(capsys, "events")
    assert settings["order"] == ("-start", "file")
    assert settings["limit"] == ("8", "environment")
    assert settings["match"] == ("overlap", "default")
    assert run(["events"]) == 3
    assert "log 'file.db': expected" in capsys.readouterr().err
    monkeypatch.setenv("DYKNOW_EVENTS_LOGS", "variable.db")
    assert run(["events"]) == 3
    assert "log 'variable.db': expected" in capsys.readouterr().err
    assert run(["events", "flag.db"]) == 3
    assert "log 'flag.db': expected" in capsys.readouterr().err


def test_settings_are_named_as_options_and_those_of_groups_too(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("dyknow.toml").write_text('[log.prune]\nkeep = ["events=9d", "views=1d"]\n[why-not]\nfrom = "2s"\n')
    monkeypatch.setenv("DYKNOW_LOG_PRUNE_DRY_RUN", "1")
    assert shown(capsys, "log", "prune")["keep"] == ("['events=9d', 'views=1d']", "file")
    assert shown(capsys, "log", "prune")["dry_run"] == ("1", "environment")
    assert shown(capsys, "why-not")["from"] == ("2s", "file")


def test_every_command_has_settings(capsys: Capsys) -> None:
    kinds = {place for name in COMMANDS for _, place in shown(capsys, *name.split()).values()}
    assert kinds == {"default"}


def test_a_password_is_not_shown(capsys: Capsys) -> None:
    Path("dyknow.toml").write_text('[serve]\nlog = "postgresql+psycopg://road:secret@db/log"\n')
    assert run(["config", "show", "--origin"]) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[1].split() == ["log", "postgresql+psycopg://road:***@db/log", "file"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[serve]\nprot = 1", "dyknow.toml: [serve]: expected one of log, host, port"),
        ("[serve]\nprot = 1", "got 'prot'; did you mean 'port'?"),
        ("[sreve]\nport = 1", "did you mean 'serve'?"),
        ("[log.pruen]\nkeep = []", "did you mean 'prune'?"),
        ("serve = 1", "dyknow.toml: serve: expected a table [serve], got 1"),
        ("[config.show]\norigin = 'maybe'", "dyknow.toml: [config.show] origin: expected what --origin takes"),
        ("[serve", "dyknow.toml: expected TOML in UTF-8"),
    ],
    ids=["setting", "nearest", "command", "command of a group", "no table", "value", "no TOML"],
)
def test_a_wrong_file_is_refused(capsys: Capsys, text: str, told: str) -> None:
    Path("dyknow.toml").write_text(text)
    assert told in refused(capsys)


def test_a_wrong_variable_is_refused_by_its_command_alone(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DYKNOW_EVENTS_LIMTI", "1")
    assert "got 'DYKNOW_EVENTS_LIMTI'; did you mean 'DYKNOW_EVENTS_LIMIT'?" in refused(capsys, "events", "a.db")
    assert "did you mean 'DYKNOW_EVENTS_LIMIT'?" in refused(capsys, "config", "show", "events")
    assert shown(capsys, "serve")["port"] == ("8420", "default")
    monkeypatch.delenv("DYKNOW_EVENTS_LIMTI")
    monkeypatch.setenv("DYKNOW_EVENTS_LIMIT", "few")
    assert "DYKNOW_EVENTS_LIMIT: expected what --limit takes, got 'few'" in refused(capsys, "events", "a.db")


def test_the_file_may_lie_elsewhere(capsys: Capsys, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    Path("other.toml").write_text("[serve]\nport = 81\n")
    assert run(["--config", "other.toml", "config", "show"]) == 0
    assert "81" in capsys.readouterr().out
    monkeypatch.setenv("DYKNOW_CONFIG", str(tmp_path / "other.toml"))
    assert shown(capsys)["port"] == ("81", "file")
    assert "missing.toml: expected a path that can be used" in refused(capsys, "--config", "missing.toml", "events")


def test_an_unknown_command_has_no_settings(capsys: Capsys) -> None:
    assert "did you mean 'events'?" in refused(capsys, "config", "show", "event")


def test_a_shell_completes_commands_and_options(capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_DYKNOW_COMPLETE", "complete_bash")
    for words, expected in (("dyknow why", "why-not"), ("dyknow serve --por", "--port")):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
        assert run([]) == 0
        assert capsys.readouterr().out.split() == [expected]
