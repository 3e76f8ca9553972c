"""Is this the truth of the scene that the run saw? Doubts, in words, before anybody believes a score.

A log knows the name of its site and where its cars were. Against the truth of another scene every score is a row of
digits without meaning: the cars of one are not where the vehicles of the other are.
"""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.records import RunRecord
from service.scoring.evaluate import Positions, load_truth, positions_from_rows
from service.store.log import open_log

NEAR_M, LEAST_SHARE = 2.0, 0.7
"""Where a car was seen the truth has a vehicle so near; in so many cases at least, even if vision is poor."""
_LEAST_ROWS, _MOST_ROWS = 50, 2000


def scene_doubts(url: str, truth_folder: Path, *, run: str | None = None) -> tuple[str, ...]:
    """Say what speaks against a folder being the truth of what a run saw.

    Parameters
    ----------
    url : the event log.
    truth_folder : where `truth.csv` is.
    run : which run of the log; may be left out when there is only one.

    Returns
    -------
    A message for each doubt; none if the two belong together as far as they tell.

    Raises
    ------
    LogError, TruthError
        If the log, the run or the truth cannot be read.
    """
    _, vehicles = load_truth(truth_folder)
    with open_log(url) as log:
        record = log.run(run)
        seen = [state for state in log.states(record.id) if state.linked]
    cars = positions_from_rows(
        [state.t_us for state in seen], [state.car for state in seen], [(state.x_m, state.y_m) for state in seen]
    )
    return (*_doubts_by_name(record, truth_folder), *_doubts_by_place(record, cars, vehicles, truth_folder))


def _doubts_by_name(record: RunRecord, folder: Path) -> Iterator[str]:
    try:
        name = tomllib.loads((folder / "site.toml").read_text(encoding="utf-8-sig")).get("name", "")
    except (OSError, ValueError):
        return  # The truth may come without its scene.
    if record.site and name and name != record.site:
        yield f"{folder}: expected the truth of the site that the run was given, {record.site!r}, got that of {name!r}"


def _doubts_by_place(record: RunRecord, cars: Positions, vehicles: Positions, folder: Path) -> Iterator[str]:
    if len(cars.ids) < _LEAST_ROWS:
        return
    rows = np.unique(np.linspace(0, len(cars.ids) - 1, _MOST_ROWS).astype(np.int64))
    known, near = _nearness(cars.t_us[rows], cars.centre_m[rows], vehicles)
    if known.mean() < LEAST_SHARE:
        span = f"{vehicles.t_us[0] / 1e6:.2f} s to {vehicles.t_us[-1] / 1e6:.2f} s"
        came = f"{cars.t_us[0] / 1e6:.2f} s to {cars.t_us[-1] / 1e6:.2f} s"
        yield f"{folder}: expected a truth for the times at which run {record.id} saw cars, {came}, got one for {span}"
    elif near[known].mean() < LEAST_SHARE:
        yield (
            f"{folder}: expected a vehicle of the truth within {NEAR_M:g} m of most cars that run {record.id} saw, "
            f"got one at {near[known].mean():.0%} of them: is it the truth of this scene?"
        )


def _nearness(
    t_us: NDArray[np.int64], centre_m: NDArray[np.float64], vehicles: Positions
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell of each row whether the truth knows its time, and whether it has a vehicle near it then."""
    times_us, starts = np.unique(vehicles.t_us, return_index=True)
    ends = np.append(starts[1:], len(vehicles.t_us))
    step_us = float(np.median(np.diff(times_us))) if len(times_us) > 1 else 0.0
    known, near = np.zeros(len(t_us), np.bool_), np.zeros(len(t_us), np.bool_)
    for row, at_us in enumerate(t_us.tolist()):
        place = min(int(np.searchsorted(times_us, at_us)), len(times_us) - 1)
        if place and at_us - times_us[place - 1] < abs(int(times_us[place]) - at_us):
            place -= 1
        known[row] = abs(int(times_us[place]) - at_us) <= step_us
        if known[row]:
            tree = cKDTree(vehicles.centre_m[starts[place] : ends[place]])
            near[row] = tree.query(centre_m[row])[0] <= NEAR_M
    return known, near
