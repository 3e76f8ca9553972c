"""Switches with hysteresis that date their changes back."""

import numpy as np

from qsr.changes.crossings import SwitchBank


def times_of(values: list[float], *, margin: float = 0.5, backdate_us: int = 10_000) -> list[tuple[int, int]]:
    """Feed one quantity a value each millisecond; list when it turned, as (decided, dated back to)."""
    bank = SwitchBank(np.array([margin]), backdate_us=backdate_us)
    bank.keep(np.array([-1]))
    turns = []
    for k, value in enumerate(values):
        if bank.update(k * 1000, np.array([[value]]))[0, 0]:
            turns.append((k * 1000, int(bank.since_us[0, 0])))
    return turns


def test_crossing_is_interpolated_between_frames() -> None:
    assert times_of([-1.0, 3.0]) == [(1000, 250)]


def test_last_of_several_raw_crossings_counts() -> None:
    assert times_of([-1.0, 0.4, -0.4, 0.4, 1.0]) == [(4000, 2500)]


def test_noise_within_the_margin_says_nothing() -> None:
    assert times_of([1.0, -0.4, 0.4, -0.4, -0.5]) == []


def test_change_is_dated_back_at_most_so_far() -> None:
    assert times_of([-0.1, 0.1, 0.2, 0.3, 0.4, 0.6], backdate_us=2000) == [(5000, 3000)]


def test_new_column_starts_where_it_is_without_a_margin() -> None:
    bank = SwitchBank(np.array([0.5]), backdate_us=0)
    bank.keep(np.array([-1, -1]))
    bank.update(7, np.array([[0.1, -0.1]]))
    assert bank.is_on.tolist() == [[True, False]]
    assert bank.since_us.tolist() == [[7, 7]]


def test_columns_keep_their_state_when_rearranged() -> None:
    bank = SwitchBank(np.array([0.5]), backdate_us=1000)
    bank.keep(np.array([-1, -1]))
    bank.update(0, np.array([[1.0, -1.0]]))
    bank.keep(np.array([1, -1, 0]))
    assert bank.update(100, np.array([[-0.2, -0.2, 0.2]])).tolist() == [[False, False, False]]
    assert bank.is_on.tolist() == [[False, False, True]]
