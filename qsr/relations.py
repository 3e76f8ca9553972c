"""Which relations are there, what do they mean, and of which threshold crossings are they made?

Every relation is a conjunction of *switches*: quantities with a threshold (see `qsr.changes`). A pair of objects has
nine switches, computed once for both orders; the relations of the two orders follow by the converse.
"""

from dataclasses import dataclass
from enum import IntEnum


class Switch(IntEnum):
    """Name the nine switches of a pair (a, b); each is on while its quantity is above zero."""

    PAST_REAR = 0  # a is not behind b: gap + h
    PAST_FRONT = 1  # a is ahead of b: gap - h
    LATERAL_NEAR = 2  # the lateral distance is small enough for beside
    SAME_DIRECTION = 3
    CLOSE = 4
    A_LEFT_OF_B = 5  # in b's frame
    A_RIGHT_OF_B = 6
    B_LEFT_OF_A = 7  # in a's frame
    B_RIGHT_OF_A = 8


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


_TRAVEL = "along the common road in the direction of travel; else the mean heading of the two"
_REFERENCE = "along the common road in the reference object's direction of travel; else its body"

RELATIONS: tuple[Relation, ...] = (
    Relation("behind", 2, "ahead", _TRAVEL, "same direction, and a's nose is behind b's tail (gap < -h)"),
    Relation("beside", 2, "beside", _TRAVEL, "same direction, |gap| <= h, less than beside_lateral_m apart sideways"),
    Relation("ahead", 2, "behind", _TRAVEL, "same direction, and a's tail is ahead of b's nose (gap > h)"),
    Relation("close", 2, "close", "free space", "the bodies are less than close_m apart"),
    Relation("left", 2, "", _REFERENCE, "a is to the left of b by more than half the sum of widths"),
    Relation("right", 2, "", _REFERENCE, "a is to the right of b by more than half the sum of widths"),
    Relation("same_direction", 2, "same_direction", "road, else free space", "both travel the same way"),
    Relation("on", 2, "", "map", "the centre of the car is on the road"),
    Relation("in_crossing", 2, "", "map", "the centre of the car is in the junction"),
    Relation("moving", 1, "", "ground", "the car is faster than moving_mps"),
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

    switches: tuple[Switch, ...]
    but_not: tuple[Switch, ...]
    of_ab: str
    of_ba: str


PAIR_RELATIONS: tuple[PairRelation, ...] = (
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
