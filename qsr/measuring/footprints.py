"""Where does every car stand, at one time? The input of the relations, and the table that pairs are measured from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar  # columns are arrays of several types

import numpy as np
from numpy.typing import NDArray

from gis.roads.road_network import RoadPositions
from qsr.errors import QsrError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
LongArray = NDArray[np.int64]
Rows = NDArray[np.void]

_PLACES = ("road", "along_m", "across_m", "tangent_rad", "junction", "lane")
_NUMBERS = ("heading_rad", "speed_mps", "length_m", "width_m", "along_m", "across_m", "tangent_rad", "sigma_m")
BODY = np.dtype(
    [
        ("centre_m", np.float64, 2),
        *((name, np.float64) for name in (*_NUMBERS, "confidence")),
        *((name, np.int32) for name in ("road", "junction", "lane")),
        *((name, np.bool_) for name in ("observed", "has_moved")),
    ],
    align=True,
)
"""A row of footprints: all that is known of one object at one time."""
_NAMES = BODY.names or ()
_BYTES = np.dtype((np.void, BODY.itemsize))
_USUAL = np.array(((np.nan, np.nan), *(np.nan for _ in _NUMBERS), 1.0, -1, -1, -1, True, True), BODY)

Array = TypeVar("Array")


class _Column(Generic[Array]):
    """A column of the rows that footprints hold."""

    def __set_name__(self, _: type, name: str) -> None:
        self._name = name

    def __get__(self, footprints: "Footprints", _: type) -> Array:
        return footprints.rows[self._name]  # type: ignore[return-value]  # of the type that BODY says


@dataclass(frozen=True, slots=True)
class Footprints:
    """Hold the bodies of all objects at one time; row k is that of ``ids[k]``. Made by `Footprints.of`.

    Attributes
    ----------
    t_us : time of the frame, microseconds.
    ids : n identifiers, all different, in any order.
    rows : (n,) of `BODY`, whose columns are attributes too.
    centre_m : (n, 2) centres of the bodies, local east/north frame.
    heading_rad : (n,) direction of the nose; 0 east, counter-clockwise.
    speed_mps, length_m, width_m : (n,).
    road : (n,) int32, index of the road under the centre; -1 for none.
    along_m, across_m : (n,) position on that road's reference line, across positive to the left; nan off the roads.
    tangent_rad : (n,) direction of that line there; nan off the roads.
    junction : (n,) int32, index of the junction under the centre; -1 for none.
    lane : (n,) int32, index of the lane under the centre; -1 for none.
    observed : (n,) bool, whether the object was seen in this frame, else it is only predicted.
    has_moved : (n,) bool, False of what has stood since it was seen first: it may be no vehicle, takes part in no pair,
        and neither moves nor faces any way.
    sigma_m : (n,) standard deviation of each coordinate of the centre; nan where that is not known.
    confidence : (n,) how sure it is that the object is one vehicle.
    """

    t_us: int
    ids: tuple[str, ...]
    rows: Rows

    centre_m = _Column[FloatArray]()
    heading_rad = _Column[FloatArray]()
    speed_mps = _Column[FloatArray]()
    length_m = _Column[FloatArray]()
    width_m = _Column[FloatArray]()
    road = _Column[IntArray]()
    along_m = _Column[FloatArray]()
    across_m = _Column[FloatArray]()
    tangent_rad = _Column[FloatArray]()
    junction = _Column[IntArray]()
    lane = _Column[IntArray]()
    observed = _Column[BoolArray]()
    has_moved = _Column[BoolArray]()
    sigma_m = _Column[FloatArray]()
    confidence = _Column[FloatArray]()

    @staticmethod
    def of(t_us: int, ids: Sequence[str], **columns: Any) -> "Footprints":
        """Lay out objects by columns.

        Parameters
        ----------
        columns : arrays of n entries by the names of `BODY`. What is left out is as usual: off the roads, seen, moved,
            one vehicle for sure; numbers are not known.

        Raises
        ------
        QsrError
            If an array has another length than ``ids``, there is no such column, or an identifier comes twice.

        Examples
        --------
        >>> shown = Footprints.of(0, ("a", "b"), centre_m=np.zeros((2, 2)), speed_mps=np.full(2, 20.0))
        >>> shown.speed_mps.tolist(), shown.road.tolist()
        ([20.0, 20.0], [-1, -1])
        """
        if len(set(ids)) != len(ids):
            raise QsrError(f"footprints at {t_us} us: expected different ids, got {tuple(ids)!r}")
        return Footprints(t_us, tuple(ids), bodies(len(ids), **columns))

    def having(self, **columns: Any) -> "Footprints":
        """Give the same objects with other values in some columns; see `of`."""
        return Footprints(self.t_us, self.ids, _filled(self.rows.copy(), columns))

    def select(self, rows: Sequence[int]) -> "Footprints":
        """Keep some of the objects.

        Parameters
        ----------
        rows : which, in the order in which they are to stand.
        """
        return Footprints(self.t_us, tuple(self.ids[row] for row in rows), self.rows[list(rows)])

    def __deepcopy__(self, memo: object) -> "Footprints":
        """Copy nothing: nobody writes into footprints."""
        return self


def bodies(count: int, **columns: Any) -> Rows:
    """Lay out the rows of footprints by columns; see `Footprints.of`."""
    return _filled(np.full(count, _USUAL), columns)


def _filled(rows: Rows, columns: Mapping[str, Any]) -> Rows:
    for name, column in columns.items():
        if name not in _NAMES:
            raise QsrError(f"footprints: expected columns of {_NAMES!r}, got {name!r}")
        if column.shape != rows[name].shape:
            raise QsrError(f"footprints: {name} must have shape {rows[name].shape!r}, got {column.shape!r}")
        rows[name] = column
    return rows


def joined(parts: Sequence[Rows]) -> Rows:
    """Put rows behind each other, as plain bytes: field by field, as NumPy would, takes twenty times as long."""
    return np.concatenate([part.view(_BYTES) for part in parts]).view(BODY)


def on_roads(places: RoadPositions) -> dict[str, Any]:
    """Give the columns of footprints that say where their centres are on a road network."""
    return {name: getattr(places, name) for name in _PLACES}


def pick_rows(t_us: int, ids: Sequence[str], sources: Sequence[Footprints]) -> Footprints:
    """Lay out objects at one time, each as the first source that has it shows it.

    Parameters
    ----------
    t_us : the time.
    ids : each is in some source.
    sources : the first goes before the others.

    Examples
    --------
    >>> def at(x_m, *ids):
    ...     return Footprints.of(0, ids, centre_m=np.full((len(ids), 2), x_m))
    >>> pick_rows(9, ("c", "a"), (at(1.0, "a", "b"), at(2.0, "a", "c"))).centre_m[:, 0].tolist()
    [2.0, 1.0]
    """
    names = [one for source in sources for one in source.ids]
    row_of = {one: len(names) - 1 - k for k, one in enumerate(reversed(names))}
    rows = joined([source.rows for source in sources])
    return Footprints(t_us, tuple(ids), rows[[row_of[one] for one in ids]])


def stacked(frames: Sequence[Footprints]) -> Footprints:
    """Lay the objects of one or more frames behind each other, as if they were those of one, with numbers for names."""
    if len(frames) == 1:
        return frames[0]
    rows = joined([one.rows for one in frames])
    return Footprints(frames[0].t_us, tuple(map(str, range(len(rows)))), rows)


# Rows of the object table.
X, Y, COS, SIN, HALF_LENGTH, HALF_WIDTH, HALF_PATH, SPEED, ALONG, ACROSS, TRAVEL, ROAD, OBSERVED = range(13)


def object_table(footprints: Footprints, *, widest_m: float) -> FloatArray:
    """Lay out what pairs are measured from.

    Parameters
    ----------
    footprints : of one frame.
    widest_m : no vehicle needs a wider path.

    Returns
    -------
    (13, n): x, y, cosine and sine of the heading, half length, half width, half the width of the path, speed, along,
    across, cosine between heading and road (0 off the roads), road, 1 where the object was seen (0: only predicted).
    """
    heading_rad = footprints.heading_rad
    table = np.empty((13, len(footprints.ids)))
    table[X], table[Y] = footprints.centre_m.T
    table[COS], table[SIN] = np.cos(heading_rad), np.sin(heading_rad)
    table[HALF_LENGTH], table[HALF_WIDTH] = 0.5 * footprints.length_m, 0.5 * footprints.width_m
    table[HALF_PATH] = np.minimum(table[HALF_WIDTH], 0.5 * widest_m)
    table[SPEED] = footprints.speed_mps
    table[ALONG], table[ACROSS] = footprints.along_m, footprints.across_m
    table[TRAVEL] = np.cos(heading_rad - footprints.tangent_rad)
    table[ROAD] = footprints.road
    table[OBSERVED] = footprints.observed
    off_road = footprints.road < 0
    if off_road.any():
        table[ALONG : TRAVEL + 1, off_road] = 0.0
    return table


def shares_road(roads: FloatArray) -> BoolArray:
    """Tell of which pairs, given as (2, pairs) roads, both are on the same one."""
    one, other = roads
    return np.asarray((one == other) & (one >= 0), dtype=np.bool_)
