"""Drawn departures and the routes written from them."""

from xml.etree import ElementTree

import numpy as np
import pytest

from data_gen.scenarios.catalogue import SCENARIOS, scenario_named
from data_gen.simulation.demand import draw_departures, routes_xml

MINUTE_US = 60_000_000


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_shares_of_a_scenario_sum_to_one(name: str) -> None:
    assert sum(kind.share for kind in scenario_named(name).kinds) == pytest.approx(1.0)


def test_departures_come_in_order_and_with_the_rate_asked_for() -> None:
    scenario = scenario_named("rural_overtaking")
    departures = draw_departures(scenario, until_us=60 * MINUTE_US, rng=np.random.default_rng(1))
    times_us = [item.depart_us for item in departures]
    assert times_us == sorted(times_us)
    assert len(departures) == pytest.approx(3600 * sum(flow.rate_hz for flow in scenario.flows), rel=0.15)


def test_a_longer_demand_begins_with_the_shorter_one() -> None:
    scenario = scenario_named("rural_overtaking")
    short = draw_departures(scenario, until_us=2 * MINUTE_US, rng=np.random.default_rng(1))
    long = draw_departures(scenario, until_us=9 * MINUTE_US, rng=np.random.default_rng(1))
    assert long[: len(short)] == short


def test_routes_hold_each_vehicle_with_its_own_size() -> None:
    scenario = scenario_named("rural_overtaking")
    departures = draw_departures(scenario, until_us=MINUTE_US, rng=np.random.default_rng(1))
    root = ElementTree.fromstring(routes_xml(departures))
    lengths_m = {kind.attrib["id"]: float(kind.attrib["length"]) for kind in root.iter("vType")}
    trips = {trip.attrib["id"]: lengths_m[trip.attrib["type"]] for trip in root.iter("trip")}
    assert trips == {item.id: item.length_m for item in departures}
