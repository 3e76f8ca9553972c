"""Do all that speak of classes of vehicles, from the drawing of scenes to the monitors, use the same words?"""

import re
from typing import get_args

from anchoring.linking.classes import CLASS_NAMES as OF_CARS
from data_gen.scenario import VehicleClass
from service.texts.monitored_features import WORDS
from tests.contracts.tables import page
from vision.networks.box_detector import CLASS_NAMES as OF_BOXES


def test_detectors_know_the_classes_that_scenes_have() -> None:
    assert set(OF_BOXES) == {*get_args(VehicleClass), "unknown"}


def test_classes_of_cars_are_those_of_detectors() -> None:
    assert set(OF_CARS) == set(OF_BOXES)
    assert OF_CARS[-1] == OF_BOXES[-1] == "unknown"


def test_monitors_use_the_classes_of_cars() -> None:
    assert WORDS["class"] == OF_CARS


def test_page_on_detectors_lists_the_classes_of_a_file() -> None:
    (words,) = re.findall(r"a class is one of ([\w, ]+), or a number", page("detectors.md"))
    assert tuple(words.split(", ")) == OF_BOXES
