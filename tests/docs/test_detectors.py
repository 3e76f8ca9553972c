"""The page on detectors is run as it stands; its tables list what there is."""

import doctest
import re
import tomllib
from dataclasses import fields
from pathlib import Path

from service.runs.inputs.sites.site import SiteFile
from service.texts.toml_tables import read_toml, tables_of
from vision.networks.box_detector import CLASS_NAMES
from vision.networks.detection_files import KNOWN_COLUMNS
from vision.networks.onnx.settings import OnnxSettings

PAGE = Path(__file__).parents[2] / "docs" / "detectors.md"
TEXT = PAGE.read_text(encoding="utf-8")


def toml_blocks() -> list[str]:
    return re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


def test_the_example_of_the_page_runs() -> None:
    failed, attempted = doctest.testfile(str(PAGE), module_relative=False)
    assert attempted > 10
    assert failed == 0


def test_the_site_table_of_the_page_has_every_field() -> None:
    assert tuple(tomllib.loads(toml_blocks()[0])["detector"]) == dict(tables_of(SiteFile))["detector"]


def test_the_description_of_a_network_on_the_page_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "traffic.toml"
    path.write_text(toml_blocks()[1], encoding="utf-8")
    assert read_toml(path, OnnxSettings, what="a description").tiles == (2, 1)


def test_the_page_names_every_setting_column_and_class() -> None:
    named = set(re.findall(r"\w+", TEXT))
    assert named >= {*KNOWN_COLUMNS, *CLASS_NAMES, *(field.name for field in fields(OnnxSettings))}
