"""The house rules about who may import whom."""

import ast
import functools
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("gis", "vision", "chronicles", "dyknow", "anchoring", "qsr", "data_gen", "service")
LANGUAGE = "dyknow.language"  # below all packages: how texts are read
MAY_IMPORT = {
    LANGUAGE: set[str](),
    "gis": set[str](),
    "vision": set[str](),
    "chronicles": {LANGUAGE},
    "dyknow": {LANGUAGE},
    "anchoring": {"gis", LANGUAGE},
    "qsr": {"gis"},
    "data_gen": {"gis"},
    "service": {*PACKAGES, LANGUAGE},
}
NOT_SHIPPED = {"training", "benchmarks", "tests"}
"""Beside the packages, for who makes them; `training` alone may import torch and onnx."""
SERVICE_ONLY = {"alembic", "fastapi", "starlette", "uvicorn", "sqlalchemy", "typer", "rich"}
CLOCKS_AND_STORES = {"time", "sqlite3", "socket"}
FORBIDDEN_FILE_NAMES = {"utils", "helpers", "common", "misc"}

FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


@functools.cache
def imported_modules(path: Path) -> set[str]:
    """Return every module a file imports, at any depth of nesting."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: expected an absolute import"
            assert node.module is not None
            found.update(_module_behind(node.module, alias.name) for alias in node.names)
    return found


def _module_behind(module: str, name: str) -> str:
    """Return `package.name` where that is a module of ours, else the module that the name is taken from."""
    return f"{module}.{name}" if (ROOT / module.replace(".", "/") / f"{name}.py").is_file() else module


def offenders(rule: Callable[[Path], object]) -> list[str]:
    """Name the files of the eight packages that break a rule, each with what the rule found in it."""
    return [f"{path.relative_to(ROOT).as_posix()}: {found}" for path in FILES if (found := rule(path))]


def package_of(path: Path) -> str:
    return path.relative_to(ROOT).parts[0]


def level_of(module: str) -> str:
    return LANGUAGE if f"{module}.".startswith(f"{LANGUAGE}.") else module.split(".", maxsplit=1)[0]


def roots(path: Path) -> set[str]:
    return {name.split(".")[0] for name in imported_modules(path)}


@pytest.mark.long
def test_package_imports_only_what_its_level_allows() -> None:
    def too_far(path: Path) -> set[str]:
        package = level_of(path.relative_to(ROOT).with_suffix("").as_posix().replace("/", "."))
        allowed = {package} | MAY_IMPORT[package]
        if path.name == "adapter.py":
            allowed |= {"dyknow", LANGUAGE}
        return {name for name in imported_modules(path) if level_of(name) in MAY_IMPORT.keys() - allowed}

    assert not offenders(too_far)


def test_only_service_imports_adapters() -> None:
    def adapters(path: Path) -> list[str]:
        return [name for name in imported_modules(path) if name.endswith(".adapter") and package_of(path) != "service"]

    assert not offenders(adapters)


def test_http_sql_and_command_line_live_in_service() -> None:
    assert not offenders(lambda path: package_of(path) != "service" and roots(path) & SERVICE_ONLY)


def test_engines_read_no_clock_and_open_no_store() -> None:
    assert not offenders(lambda path: package_of(path) != "service" and roots(path) & CLOCKS_AND_STORES)


def test_packages_stand_without_what_is_not_shipped() -> None:
    assert not offenders(lambda path: roots(path) & (NOT_SHIPPED | {"torch", "onnx"}))


def test_training_needs_no_part_of_the_service() -> None:
    files = sorted((ROOT / "training").glob("*.py"))
    assert files
    assert not [path.name for path in files if roots(path) & (set(PACKAGES) - {"gis", "vision", "data_gen"})]


def test_no_file_imports_its_own_package_root() -> None:
    assert not offenders(lambda path: path.name != "__init__.py" and package_of(path) in imported_modules(path))


def test_file_is_named_after_its_thing() -> None:
    assert not offenders(lambda path: path.stem in FORBIDDEN_FILE_NAMES)


def test_no_import_cycles_between_modules() -> None:
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in FILES}
    graph = {name: {other for other in imported_modules(path) if other in modules} for name, path in modules.items()}
    done: set[str] = set()

    def visit(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, f"cycle: {' -> '.join((*trail[trail.index(name) :], name))}"
        if name in done:
            return
        for other in sorted(graph[name]):
            visit(other, (*trail, name))
        done.add(name)

    for name in sorted(graph):
        visit(name, ())
