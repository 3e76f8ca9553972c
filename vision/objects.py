"""What does vision say about one instant? All tracked objects of one frame, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
VerdictArray = NDArray[np.int8]
Tensor = NDArray[np.float32]
Int64Array = NDArray[np.int64]
ByteArray = NDArray[np.uint8]


class Table:
    """Columns with a row for each thing: a base for dataclasses of arrays, other tables, and None for no column."""

    __slots__ = ()
    __match_args__: ClassVar[tuple[str, ...]] = ()

    def select(self, which: BoolArray | IntArray | slice) -> Self:
        """Take some of the rows.

        Parameters
        ----------
        which : mask, row numbers, or slice.

        Returns
        -------
        Those rows, in that order.
        """
        columns = [getattr(self, name) for name in self.__match_args__]
        return type(self)(*[None if column is None else column[which] for column in columns])

    __getitem__ = select

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Put the rows of several tables into one; a column that one of them lacks is left out."""
        columns = ([getattr(part, name) for part in parts] for name in cls.__match_args__)
        return cls(*[None if any(part is None for part in one) else _joined_column(one) for one in columns])


# Any: an array, or another table
def _joined_column(parts: Sequence[Any]) -> Any:
    return type(parts[0]).joined(parts) if isinstance(parts[0], Table) else np.concatenate(parts)


@dataclass(frozen=True, slots=True)
class VisionObjects:
    """All confirmed tracks at one frame, one row each.

    Attributes
    ----------
    t_us : the frame's time stamp.
    ids : track names; a name dies with its track and is never used again in a run.
    centre_m : (n, 2) centre of the footprint, x east, y north.
    velocity_mps : (n, 2).
    heading_rad : (n,) direction the front points to; kept while the object stands.
    length_m, width_m : (n,) of the footprint.
    observed : (n,) False where no detection was assigned in this frame and the position is predicted.
    clipped : (n,) True where the object reaches over the edge of the view: centre and length are then guesses.
    classes : none: what a detector takes an object for is not carried along its track.
    sigma_m : (n,) standard deviation of each coordinate of the centre, as tracking knows it.
    is_lost : True where nothing can be said about any object: a moving camera does not know where it looks, or the
        picture is another one than the road that is known.
    why_lost : which guard said so, and by what; may be empty.
    pixel_from_ground : (3, 3) map of the frame, where the camera moves and knows it; else None.
    """

    t_us: int
    ids: tuple[str, ...]
    centre_m: FloatArray
    velocity_mps: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray
    observed: BoolArray
    clipped: BoolArray
    is_lost: bool = False
    pixel_from_ground: FloatArray | None = None
    why_lost: str = ""
    classes: tuple[()] = field(default=(), repr=False)
    sigma_m: FloatArray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def lost(cls, t_us: int, why: str = "") -> VisionObjects:
        """Make what is said of a frame whose view is lost.

        Examples
        --------
        >>> VisionObjects.lost(40_000).ids, VisionObjects.lost(40_000).is_lost
        ((), True)
        """
        nothing, falses = np.zeros(0), np.zeros(0, np.bool_)
        nowhere = np.zeros((0, 2))
        return cls(t_us, (), nowhere, nowhere, nothing, nothing, nothing, falses, falses, True, why_lost=why)
