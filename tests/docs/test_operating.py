"""Do the unit, the container file and the page on operating start commands that there are, and as nobody special?"""

import json
import re
import shlex
import shutil
import subprocess
import sys
from configparser import ConfigParser
from pathlib import Path

import pytest

from service.cli.app import run
from tests.docs.commands import ROOT, refusal, split

DEPLOY = ROOT / "deploy"
PAGE = (ROOT / "docs" / "operating.md").read_text(encoding="utf-8")
PROGRAM = "/opt/dyknow/bin/dyknow"


def unit() -> dict[str, str]:
    """Give the section [Service] of the unit."""
    parser = ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # names keep their capitals
    parser.read(DEPLOY / "dyknow.service", encoding="utf-8")
    return dict(parser["Service"])


def container() -> dict[str, str]:
    """Give the last instruction of each kind in the image that is made."""
    text = (DEPLOY / "Containerfile").read_text(encoding="utf-8").split("\nFROM ")[-1]
    return dict(re.findall(r"^([A-Z]+) (.*)$", text, re.MULTILINE))


def test_the_unit_serves_the_log_of_its_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(unit()["ExecStart"])
    assert program == PROGRAM
    name, _, file = unit()["Environment"].partition("=")
    assert Path(file).name == (DEPLOY / "dyknow.toml").name
    monkeypatch.setenv(name, str(DEPLOY / "dyknow.toml"))
    assert run(["config", "show", *words, "--json"]) == 0
    settings = {one["name"]: one["value"] for one in json.loads(capsys.readouterr().out)["settings"]}
    assert Path(settings["log"]).parent == Path("/var/lib") / unit()["StateDirectory"]
    assert run(words) == 3  # all is well but for the log, which is not on this machine
    assert f"log '{settings['log']}': expected an event log, got no such file" in capsys.readouterr().err


def test_the_unit_runs_as_nobody_special() -> None:
    service = unit()
    assert service["User"] not in ("", "root", "0")
    assert service["CapabilityBoundingSet"] == ""
    assert service["ProtectSystem"] == "strict"
    for name in ("NoNewPrivileges", "ProtectHome", "PrivateTmp", "PrivateDevices", "ProtectKernelTunables"):
        assert service[name] == "yes"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_understands_the_unit(tmp_path: Path) -> None:
    text = (DEPLOY / "dyknow.service").read_text(encoding="utf-8").replace(PROGRAM, sys.executable)
    (tmp_path / "dyknow.service").write_text(text, encoding="utf-8")
    verified = subprocess.run(
        ["systemd-analyze", "verify", tmp_path / "dyknow.service"], capture_output=True, text=True, check=False
    )
    told = [line for line in verified.stderr.splitlines() if "dyknow.service" in line]  # not of other units
    assert (verified.returncode, told) == (0, [])


def test_the_container_starts_a_command_that_there_is_without_root() -> None:
    image = container()
    program, *words = json.loads(image["ENTRYPOINT"]) + json.loads(image["CMD"])
    assert program == "dyknow"
    assert refusal(tuple(words)) == ""
    assert words[words.index("--port") + 1] == image["EXPOSE"]
    assert Path(words[1]).is_relative_to(image["VOLUME"])
    assert int(image["USER"]) > 0
    assert f":{image['EXPOSE']}/healthz'" in image["HEALTHCHECK"]


def test_the_commands_of_the_page_are_ones() -> None:
    lines = re.findall(rf"^[^`\n]*{PROGRAM} (.*?)(?: \|\| .*)?$", PAGE, re.MULTILINE)
    lines += re.findall(r"^    podman run .* dyknow (\w+ .*)$", PAGE, re.MULTILINE)
    assert len(lines) >= 7
    assert {line: said for line in lines if (said := refusal(split(line)))} == {}


def test_the_files_of_the_page_are_there() -> None:
    named = set(re.findall(r"\bdeploy/[\w.]+", PAGE)) | {
        f"docs/{one}" for one in re.findall(r"\]\(([\w./]+?)[#)]", PAGE)
    }
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []
    assert len(named) > 5
