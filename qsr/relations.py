"""Which relations are there, what do they mean, and of which threshold crossings are they made?

Every relation of two cars is a conjunction of *switches*: quantities with a threshold (see `qsr.changes.crossings`).
They are computed once for both orders of a pair; the relations of the two orders follow by the converse. Pairs come in
three kinds: near ones; those near in time, from further away the faster they are; and those that drive towards each
other on one road.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from enum import IntEnum


class Switch(IntEnum):
    """Name the switches of a pair (a, b) that is near, or near in time; each is on while its quantity is above zero.

    They stand in the order of what they cost: those beyond the last one that is asked for are not measured.
    """

    PAST_REAR = 0  # a is not behind b: gap + h
    PAST_FRONT = 1  # a is ahead of b: gap - h
    LATERAL_NEAR = 2  # the lateral distance is small enough for beside
    SAME_DIRECTION = 3
    CLOSE = 4
    A_LEFT_OF_B = 5  # in b's frame
    A_RIGHT_OF_B = 6
    B_LEFT_OF_A = 7  # in a's frame
    B_RIGHT_OF_A = 8
    IN_PATH = 9  # the bodies overlap sideways
    A_FOLLOWS_B = 10  # nobody in between, and the time gap is small enough for following
    B_FOLLOWS_A = 11
    A_AT_SHORT_HEADWAY = 12
    B_AT_SHORT_HEADWAY = 13
    SHORT_TTC = 14  # contact is near if both go on as they do
    HARD_BRAKING = 15  # and only hard braking would prevent it
    IN_COURSE = 16  # across the way in which they approach, along the road on one, the bodies overlap: they do not miss


class FacingSwitch(IntEnum):
    """Name the switches of two cars that drive in opposite directions on one road."""

    MEET_SOON = 0


@dataclass(frozen=True, slots=True)
class Relation:
    """Describe one relation.

    Attributes
    ----------
    name : as it stands in change events.
    arity : number of arguments; the first is the primary object, the second the reference object (or the place).
    converse : the relation that holds of the exchanged arguments, always and only then; "" where none is fixed.
    frame : where it is measured.
    meaning : when it is true.
    """

    name: str
    arity: int
    converse: str
    frame: str
    meaning: str


_TRAVEL = "along the common road in the direction of travel; else the route between the two, else their mean heading"
_REFERENCE = "along the common road in the reference object's direction of travel; else its body"

RELATIONS: tuple[Relation, ...] = (
    Relation("behind", 2, "ahead", _TRAVEL, "same direction, and a's nose is behind b's tail (gap < -h)"),
    Relation(
        "beside",
        2,
        "beside",
        _TRAVEL,
        "same direction, |gap| <= h, on one road or less than beside_lateral_m aside",
    ),
    Relation("ahead", 2, "behind", _TRAVEL, "same direction, and a's tail is ahead of b's nose (gap > h)"),
    Relation("close", 2, "close", "free space", "the bodies are less than close_m apart"),
    Relation("left", 2, "", _REFERENCE, "a is to the left of b by more than half the sum of widths"),
    Relation("right", 2, "", _REFERENCE, "a is to the right of b by more than half the sum of widths"),
    Relation("same_direction", 2, "same_direction", "road or route, else free space", "both travel the same way"),
    Relation("on", 2, "", "map", "the centre of the car is on the road"),
    Relation("in_crossing", 2, "", "map", "the centre of the car is in the junction"),
    Relation("moving", 1, "", "ground", "the car is faster than moving_mps"),
    Relation("in_lane", 2, "", "map", "the centre of the car is in the lane"),
    Relation("forward", 1, "", "map", "the car drives the way its road's reference line runs, not against it"),
    Relation("against_traffic", 1, "", "map", "the car drives against the direction of the lane it is in"),
    Relation("following", 2, "", _TRAVEL, "b is the next car in a's path, at a time gap below following_s"),
    Relation("short_headway", 2, "", _TRAVEL, "b is the next car in a's path, at a time gap below short_headway_s"),
    Relation("conflict", 2, "", _TRAVEL, "contact in less than conflict_ttc_s but for hard braking; b was seen later"),
    Relation("oncoming", 2, "oncoming", "road, else route", "both drive towards each other, to meet within oncoming_s"),
    Relation("turn", 3, "", "map", "a way from road to road over a junction: left, right, straight or uturn; static"),
)

RANK: dict[str, int] = {relation.name: rank for rank, relation in enumerate(RELATIONS)}


@dataclass(frozen=True, slots=True)
class PairRelation:
    """Describe how one relation of a pair (a, b) follows from the switches, and under which names it is given out.

    Attributes
    ----------
    switches : the switches that must all be on; those in ``but_not`` must be off.
    of_ab, of_ba : the name for arguments (a, b) and for (b, a); "" for none.
    """

    switches: tuple[IntEnum, ...]
    but_not: tuple[IntEnum, ...]
    of_ab: str
    of_ba: str


_IN_ONE_PATH = (Switch.SAME_DIRECTION, Switch.IN_PATH)

NEAR_RELATIONS: tuple[PairRelation, ...] = (
    PairRelation((Switch.SAME_DIRECTION,), (Switch.PAST_REAR,), "behind", "ahead"),
    PairRelation((Switch.SAME_DIRECTION, Switch.PAST_FRONT), (), "ahead", "behind"),
    PairRelation(
        (Switch.SAME_DIRECTION, Switch.PAST_REAR, Switch.LATERAL_NEAR), (Switch.PAST_FRONT,), "beside", "beside"
    ),
    PairRelation((Switch.CLOSE,), (), "close", "close"),
    PairRelation((Switch.SAME_DIRECTION,), (), "same_direction", "same_direction"),
    PairRelation((Switch.A_LEFT_OF_B,), (), "left", ""),
    PairRelation((Switch.A_RIGHT_OF_B,), (), "right", ""),
    PairRelation((Switch.B_LEFT_OF_A,), (), "", "left"),
    PairRelation((Switch.B_RIGHT_OF_A,), (), "", "right"),
)

NEAR_IN_TIME_RELATIONS: tuple[PairRelation, ...] = (
    PairRelation((*_IN_ONE_PATH, Switch.A_FOLLOWS_B), (Switch.PAST_REAR,), "following", ""),
    PairRelation((*_IN_ONE_PATH, Switch.B_FOLLOWS_A, Switch.PAST_FRONT), (), "", "following"),
    PairRelation((*_IN_ONE_PATH, Switch.A_AT_SHORT_HEADWAY), (Switch.PAST_REAR,), "short_headway", ""),
    PairRelation((*_IN_ONE_PATH, Switch.B_AT_SHORT_HEADWAY, Switch.PAST_FRONT), (), "", "short_headway"),
    # Neither car is the one that runs into the other, so the pair is named once, lest each conflict count twice.
    PairRelation((Switch.SHORT_TTC, Switch.HARD_BRAKING, Switch.IN_COURSE), (), "conflict", ""),
)

FACING_RELATIONS: tuple[PairRelation, ...] = (PairRelation((FacingSwitch.MEET_SOON,), (), "oncoming", "oncoming"),)


def asked_for(relations: Iterable[PairRelation], names: Collection[str]) -> tuple[PairRelation, ...]:
    """Pick the relations that are given out under one of some names, without their other names.

    Examples
    --------
    >>> [(relation.of_ab, relation.of_ba) for relation in asked_for(NEAR_RELATIONS, ["ahead"])]
    [('', 'ahead'), ('ahead', '')]
    """
    named = (
        replace(
            relation,
            of_ab=relation.of_ab if relation.of_ab in names else "",
            of_ba=relation.of_ba if relation.of_ba in names else "",
        )
        for relation in relations
    )
    return tuple(relation for relation in named if relation.of_ab or relation.of_ba)


def switches_of(relations: Iterable[PairRelation]) -> set[IntEnum]:
    """Name the switches that some relations are made of."""
    return {switch for relation in relations for switch in (*relation.switches, *relation.but_not)}
