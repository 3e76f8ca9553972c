"""What strangers see first: names at the package roots, types, and imports that stay light."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("gis", "vision", "chronicles", "dyknow", "anchoring", "qsr", "data_gen", "service")
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
IMPORT = re.compile(rf"^(?:>>> )?\s*(from (?:{'|'.join(PACKAGES)})\b.*)$", re.MULTILINE)


def modules_after(statement: str) -> set[str]:
    """Return the modules that a fresh interpreter holds after a statement."""
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


def test_every_name_of_a_face_can_be_imported() -> None:
    for name in PACKAGES:
        package = importlib.import_module(name)
        assert package.__all__, name
        for offered in package.__all__:
            assert hasattr(package, offered), f"{name}.{offered}"
        assert (ROOT / name / "py.typed").is_file(), name


def test_what_the_docs_import_comes_from_the_faces() -> None:
    found = 0
    for page in PAGES:
        for line in IMPORT.findall(page.read_text(encoding="utf-8")):
            (statement,) = ast.parse(line).body
            assert isinstance(statement, ast.ImportFrom)
            assert statement.module in PACKAGES, f"{page.name}: {line!r} reaches behind the face of its package"
            package = importlib.import_module(statement.module)
            for alias in statement.names:
                assert hasattr(package, alias.name), f"{page.name}: {line!r}: expected {alias.name!r} in the face"
                found += 1
    assert found > 20


def test_an_engine_is_light_until_it_is_used() -> None:
    ours = {name for name in modules_after("import chronicles") if name.split(".")[0] in PACKAGES}
    assert ours == {"chronicles"}


def test_loading_chronicles_needs_nothing_of_dyknow_but_the_workshop_of_languages() -> None:
    loaded = modules_after("from chronicles import Recogniser, load, recognise, why, why_not")
    behind = {name for name in loaded if name.split(".")[0] in PACKAGES and not name.startswith("chronicles")}
    assert {name for name in behind if not name.startswith("dyknow.language")} <= {"dyknow"}


@pytest.mark.long
def test_a_server_that_was_asked_nothing_holds_no_engine_for_video() -> None:
    loaded = {name.split(".")[0] for name in modules_after("import service.api.app")}
    assert not loaded & {"anchoring", "gis", "cv2", "scipy", "networkx", "shapely", "av", "onnxruntime", "libsumo"}
