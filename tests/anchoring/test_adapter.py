"""Anchoring in a stream graph, where vision says that its view is lost."""

import numpy as np

from anchoring.adapter import AnchoringUnit
from anchoring.anchorer import Anchorer
from anchoring.observations import Cars
from dyknow.sample import Sample
from vision.objects import VisionObjects


def seen(t_us: int, name: str) -> VisionObjects:
    """One car that drives 10 m/s to the east."""
    one, yes = np.ones(1), np.ones(1, np.bool_)
    centre_m, velocity_mps = np.array([[t_us * 1e-5, 0.0]]), np.array([[10.0, 0.0]])
    return VisionObjects(t_us, (name,), centre_m, velocity_mps, 0 * one, 4.5 * one, 1.8 * one, yes, ~yes)


def cars_of(unit: AnchoringUnit, objects: VisionObjects) -> Cars:
    (sample,) = unit.update(Sample(objects.t_us, objects.t_us, objects))
    return sample.value.cars


def test_a_lost_view_ends_the_cars_at_once_and_keeps_their_names() -> None:
    unit = AnchoringUnit(Anchorer(None))
    for t_us in range(0, 1_000_000, 100_000):
        cars = cars_of(unit, seen(t_us, "v1"))
    assert cars.ids == ("car1",)
    assert cars_of(unit, VisionObjects.lost(1_000_000)).ids == ()  # not even predicted
    for t_us in range(1_800_000, 2_400_000, 100_000):
        cars = cars_of(unit, seen(t_us, "v2"))
    assert (cars.ids, cars.vision_ids) == (("car1",), ("v2",))


def test_an_unseen_car_is_predicted_while_the_view_is_not_lost() -> None:
    unit = AnchoringUnit(Anchorer(None))
    for t_us in range(0, 1_000_000, 100_000):
        cars_of(unit, seen(t_us, "v1"))
    nobody = VisionObjects.lost(1_000_000)
    empty = VisionObjects(1_000_000, *[getattr(nobody, name) for name in VisionObjects.__slots__[1:9]])
    assert cars_of(unit, empty).ids == ("car1",)
