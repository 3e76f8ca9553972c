"""What can monitors speak of? Features of the cars as the log stores them, and every relation among them.

What was not seen is not known: where a car is only predicted, all its own features but `seen` are unknown.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from anchoring.linking.classes import CLASS_NAMES
from dyknow.mtl.kinds import Kind, Signature
from qsr.relations import RELATIONS
from service.records.seen import CarState
from service.texts.idle_chronicles import ROAD_RELATIONS

CarValue = float | str | bool | None
Given = Mapping[str, tuple[str, ...]]
"""Events by name, with what stands in the places of their arguments."""

NO_EVENTS: Given = {}

# Relations to places are told only where a car has been: elsewhere they are false without a word.
PLACE_RELATIONS = frozenset(one.name for one in RELATIONS if one.frame == "map" and one.arity == 2)


@dataclass(frozen=True, slots=True)
class CarFeature:
    """Describe a feature of one car.

    Attributes
    ----------
    read : gives its value for a car that was seen; None where it has none.
    needs_roads : it has a value only where there is a road network.
    """

    kind: Kind
    read: Callable[[CarState], CarValue]
    needs_roads: bool = False


CAR_FEATURES: Mapping[str, CarFeature] = {
    "speed": CarFeature(Kind.SPEED, lambda car: car.speed_mps),
    "x": CarFeature(Kind.LENGTH, lambda car: car.x_m),
    "y": CarFeature(Kind.LENGTH, lambda car: car.y_m),
    "heading": CarFeature(Kind.ANGLE, lambda car: car.heading_rad),
    "length": CarFeature(Kind.LENGTH, lambda car: car.length_m),
    "width": CarFeature(Kind.LENGTH, lambda car: car.width_m),
    "class": CarFeature(Kind.WORD, lambda car: car.car_class),
    "seen": CarFeature(Kind.TRUTH, lambda car: car.linked),
    "on_road": CarFeature(Kind.TRUTH, lambda car: bool(car.road), needs_roads=True),
    "road": CarFeature(Kind.WORD, lambda car: car.road, needs_roads=True),
    "lane": CarFeature(Kind.WORD, lambda car: car.lane, needs_roads=True),
    "along": CarFeature(Kind.LENGTH, lambda car: car.along_m, needs_roads=True),
}

KINDS: Mapping[str, Kind] = {name: feature.kind for name, feature in CAR_FEATURES.items()} | {
    one.name: Kind.WORD if one.name == "turn" else Kind.TRUTH for one in RELATIONS
}

# Words that a feature can be, where they do not depend on the site.
WORDS: Mapping[str, tuple[str, ...]] = {
    "class": CLASS_NAMES,
    "turn": ("left", "right", "straight", "uturn"),
}

SIGNATURE = Signature(
    dict.fromkeys(CAR_FEATURES, 1) | {one.name: one.arity for one in RELATIONS},
    sorts=("Car",),
    kinds=KINDS,
    values=WORDS,
)

NEED_ROADS = ROAD_RELATIONS.union(name for name, one in CAR_FEATURES.items() if one.needs_roads)


def signature_with(given: Given) -> Signature:
    """Say what monitors can speak of where there are some events; a feature goes before an event of the same name.

    Examples
    --------
    >>> signature_with({"pass": ("?passer", "?passed"), "seen": ("?a",)}).events
    {'pass': 'pass[?passer, ?passed]'}
    """
    events = {name: arguments for name, arguments in given.items() if name not in SIGNATURE.features}
    return replace(
        SIGNATURE,
        features={**SIGNATURE.features, **{name: len(arguments) for name, arguments in events.items()}},
        kinds={**KINDS, **dict.fromkeys(events, Kind.TRUTH)},
        events={name: f"{name}[{', '.join(arguments)}]" for name, arguments in events.items()},
    )
