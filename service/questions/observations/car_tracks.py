"""Where were the cars, as columns that a program can draw at once?"""

from collections.abc import Iterable, Iterator
from itertools import islice

from msgspec import Struct

from service.errors import QueryError
from service.records.seen import CarState

MOST_STATES = 200_000
"""Of a hundred cars in a minute there are 75,000; so many are 15 MB of JSON."""


class CarColumns(Struct, frozen=True):
    """The states of cars, a column for each thing that is told of them, row k of all being one state.

    By time, then by name. `linked` is false where the place is predicted, as the tracker had lost the car.
    """

    t_us: list[int]
    car: list[str]
    car_class: list[str]
    x_m: list[float]
    y_m: list[float]
    heading_rad: list[float]
    speed_mps: list[float]
    length_m: list[float]
    width_m: list[float]
    road: list[str]
    linked: list[bool]


def car_columns(states: Iterable[CarState], *, step_us: int) -> CarColumns:
    """Lay out states as columns.

    Parameters
    ----------
    states : ordered by time.
    step_us : of each car the first state in each step is told; 1 for all.

    Raises
    ------
    QueryError
        If there are more than `MOST_STATES`.
    """
    kept = list(islice(_thinned(states, step_us), MOST_STATES + 1))
    if len(kept) > MOST_STATES:
        expected = f"step_us: expected a window and a step with at most {MOST_STATES} states"
        raise QueryError(f"{expected}, got more with {step_us} us", parameter="step_us")
    return CarColumns(*([getattr(one, name) for one in kept] for name in CarColumns.__struct_fields__))


def _thinned(states: Iterable[CarState], step_us: int) -> Iterator[CarState]:
    told: dict[str, int] = {}
    for state in states:
        step = state.t_us // step_us
        if told.get(state.car) != step:
            told[state.car] = step
            yield state
