"""Where does every car stand, at one time? The input of the relations, and the table that pairs are measured from."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any  # columns are arrays of several types

import numpy as np
from numpy.typing import NDArray

from gis.road_network import RoadPositions
from qsr.errors import QsrError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
LongArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Footprints:
    """Hold the bodies of all objects at one time; entry k of every array belongs to ``ids[k]``.

    Attributes
    ----------
    t_us : time of the frame, microseconds.
    ids : n identifiers, all different, in any order.
    centre_m : (n, 2) centres of the bodies, local east/north frame.
    heading_rad : (n,) direction of the nose; 0 east, counter-clockwise.
    speed_mps, length_m, width_m : (n,).
    road : (n,) int32, index of the road under the centre; -1 for none.
    along_m, across_m : (n,) position on that road's reference line, across positive to the left; nan off the roads.
    tangent_rad : (n,) direction of that line there; nan off the roads.
    junction : (n,) int32, index of the junction under the centre; -1 for none.
    lane : (n,) int32, index of the lane under the centre; -1 for none, and everywhere if left out.
    observed : (n,) bool, whether the object was seen in this frame, else it is only predicted; True if left out.
    has_moved : (n,) bool, False of what has stood since it was seen first: it may be no vehicle, and takes part in no
        pair; True if left out.
    sigma_m : (n,) standard deviation of each coordinate of the centre; nan where that is not known, or if left out.
    confidence : (n,) how sure it is that the object is one vehicle; 1 if left out.

    Raises
    ------
    QsrError
        If an array has another length than ``ids``, or an identifier comes twice.
    """

    t_us: int
    ids: tuple[str, ...]
    centre_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    road: IntArray
    along_m: FloatArray
    across_m: FloatArray
    tangent_rad: FloatArray
    junction: IntArray
    lane: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    observed: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    has_moved: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    sigma_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    confidence: FloatArray = field(default_factory=lambda: np.zeros(0))

    def select(self, rows: Sequence[int]) -> "Footprints":
        """Keep some of the objects.

        Parameters
        ----------
        rows : which, in the order in which they are to stand.
        """
        arrays = {name: getattr(self, name)[list(rows)] for name in _COLUMNS}
        return Footprints(t_us=self.t_us, ids=tuple(self.ids[row] for row in rows), **arrays)

    def __deepcopy__(self, memo: object) -> "Footprints":
        """Copy nothing: nobody writes into footprints."""
        return self

    def __post_init__(self) -> None:
        """Check the sizes once, at the border."""
        count = len(self.ids)
        usual = {"observed": np.True_, "has_moved": np.True_, "sigma_m": np.nan, "confidence": 1.0}
        for name, value in ({"lane": np.int32(-1)} | usual).items():
            if not len(getattr(self, name)):
                object.__setattr__(self, name, np.full(count, value))
        if len(set(self.ids)) != count:
            raise QsrError(f"footprints at {self.t_us} us: expected different ids, got {self.ids!r}")
        if self.centre_m.shape != (count, 2):
            raise QsrError(
                f"footprints at {self.t_us} us: centre_m must have shape {(count, 2)!r}, got {self.centre_m.shape!r}"
            )
        rows = (self.heading_rad, self.speed_mps, self.length_m, self.width_m)
        places = (self.road, self.along_m, self.across_m, self.tangent_rad, self.junction, self.lane)
        for row in (*rows, *places, self.observed, self.has_moved, self.sigma_m, self.confidence):
            if row.shape != (count,):
                raise QsrError(
                    f"footprints at {self.t_us} us: every array must have {count} entries, got {row.shape!r}"
                )


_COLUMNS = tuple(one.name for one in fields(Footprints) if one.name not in ("t_us", "ids"))


def on_roads(places: RoadPositions) -> dict[str, Any]:
    """Give the columns of footprints that say where their centres are on a road network."""
    return {name: getattr(places, name) for name in ("road", "along_m", "across_m", "tangent_rad", "junction", "lane")}


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
    ...     none, off = np.full(len(ids), np.nan), np.full(len(ids), -1, np.int32)
    ...     return Footprints(0, ids, np.full((len(ids), 2), x_m), none, none, none, none, off, none, none, none, off)
    >>> pick_rows(9, ("c", "a"), (at(1.0, "a", "b"), at(2.0, "a", "c"))).centre_m[:, 0].tolist()
    [2.0, 1.0]
    """
    names = [one for source in sources for one in source.ids]
    row_of = {one: len(names) - 1 - k for k, one in enumerate(reversed(names))}
    rows = [row_of[one] for one in ids]
    arrays = {name: np.concatenate([getattr(source, name) for source in sources])[rows] for name in _COLUMNS}
    return Footprints(t_us=t_us, ids=tuple(ids), **arrays)


def stacked(frames: Sequence[Footprints]) -> Footprints:
    """Lay the objects of one or more frames behind each other, as if they were those of one, with numbers for names."""
    if len(frames) == 1:
        return frames[0]
    arrays = {name: np.concatenate([getattr(one, name) for one in frames]) for name in _COLUMNS}
    return Footprints(frames[0].t_us, tuple(map(str, range(len(arrays["centre_m"])))), **arrays)


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
