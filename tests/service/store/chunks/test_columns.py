"""A chunk gives back what was packed, to the parts that it keeps, or says that it is damaged."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.store.chunks.columns import DamagedChunkError, pack, unpack

Value = int | float | bool | str | tuple[str, ...] | None
WHOLE = st.integers(-(2**63) + 1, 2**63 - 1)
NUMBERS = st.none() | st.floats(-1e12, 1e12) | st.integers(-1000, 1000)
OTHERS = st.none() | st.booleans() | st.text(max_size=3) | st.lists(st.text(max_size=2), max_size=3).map(tuple)


def unpacked(chunk: bytes) -> dict[str, list[Value]]:
    return {name: column.values(np.arange(len(column.codes))) for name, column in unpack(chunk).items()}


def rounded(values: Sequence[float | None], parts: int) -> list[float | None]:
    return [None if value is None else round(value * parts) / parts for value in values]


@given(st.lists(st.tuples(WHOLE, NUMBERS, NUMBERS, OTHERS), min_size=1, max_size=40))
def test_values_come_back(rows: list[tuple[int, float | None, float | None, Value]]) -> None:
    t_us, x_m, heading_rad, word = (list(column) for column in zip(*rows, strict=True))
    came = unpacked(pack({"t_us": t_us, "x_m": [*x_m], "heading_rad": [*heading_rad], "word": word}))
    assert came["t_us"] == t_us
    assert came["x_m"] == rounded(x_m, 100)
    assert came["heading_rad"] == rounded(heading_rad, 1000)
    # True is 1 among words, but the words of one column are of one type in every record.
    assert came["word"] == word


def test_what_no_parts_can_hold_is_kept_as_it_is() -> None:
    assert unpacked(pack({"x_m": [1e300, 2.345], "nothing": [None, None]})) == {
        "x_m": [1e300, 2.345],
        "nothing": [None, None],
    }


def test_a_minute_of_a_car_takes_few_bytes() -> None:
    t_s = np.arange(750) * 0.08
    noise_m = np.random.default_rng(1).normal(0.0, 0.02, (2, 750))
    chunk = pack(
        {
            "t_us": (t_s * 1e6).astype(int).tolist(),
            "car": ["car7"] * 750,
            "x_m": (13.0 * t_s + noise_m[0]).tolist(),
            "y_m": noise_m[1].tolist(),
        }
    )
    assert len(chunk) < 750 * 2.5


@pytest.mark.parametrize("place", [0, 1, 20, -5, -1])
def test_any_other_byte_is_noticed(place: int) -> None:
    chunk = bytearray(pack({"t_us": list(range(0, 9_000_000, 80_000)), "car": ["car1"] * 113}))
    chunk[place] ^= 4
    with pytest.raises(DamagedChunkError, match="damaged: expected the bytes that were written, got "):
        unpack(bytes(chunk))


@pytest.mark.parametrize("kept", [0, 1, 30])
def test_missing_bytes_are_noticed(kept: int) -> None:
    with pytest.raises(DamagedChunkError, match="damaged: expected the bytes"):
        unpack(pack({"t_us": list(range(0, 9_000_000, 80_000))})[:kept])
