"""How far off are the speeds of cars whose places are known so well? The number behind `speed_noise_mps`.

``python -m benchmarks.evaluate_speeds --log NAME.db SCENE ...`` compares the cars of each scene's log with its
`truth.csv`, as `benchmarks.evaluate_mast --folder` leaves both. A row counts where a vehicle is within 2.5 m. Rows are
divided into eighths by how well their place is known; deviations are robust ones, 1.48 medians, of the speed. The last
column divides them by the third root of the noise of the place in metres.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from service.questions.scoring.pairs import FloatArray, ground_pairs
from service.questions.scoring.truth_rows import NUMBERS, load_truth_table, nearest_times
from service.store.log import open_log

REACH_M, PARTS = 2.5, 8
X, SPEED = NUMBERS.index("x_m"), NUMBERS.index("speed_mps")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--log", required=True, help="name of the log in each scene's folder")
    options = parser.parse_args(arguments)
    sigma_m, off_mps = np.concatenate([_measured(scene, options.log) for scene in options.scenes], axis=1)
    print("| place known to | rows | speed off by | for a place known to 1 m |\n|---|---|---|---|")
    for part in np.array_split(np.argsort(sigma_m), PARTS):
        place_m, speed_mps = _table_row(sigma_m[part], off_mps[part])
        print(f"| {place_m:.2f} m | {len(part)} | {speed_mps:.2f} m/s | {speed_mps / np.cbrt(place_m):.2f} m/s |")


def _measured(scene: Path, log_name: str) -> FloatArray:
    """Give, (2, n), the noise that is said of the places of cars that drive, and how far off their speeds are."""
    truth = load_truth_table(scene)
    with open_log(str(scene / log_name)) as log:
        states = [one for one in log.states(log.run().id) if one.linked and one.has_moved and one.sigma_m]
    times_us = truth.times_us()
    frame = nearest_times(np.array([one.t_us for one in states]), times_us)
    places_m = np.array([(one.x_m, one.y_m) for one in states])
    true_frame = np.searchsorted(times_us, truth.t_us)
    near = ground_pairs(true_frame, truth.values[:, X : X + 2], frame, places_m, reach_m=REACH_M)
    best = near.select(np.argsort(-near.similarity, kind="stable"))
    best = best.select(np.unique(best.found_row, return_index=True)[1])
    chosen = [states[row] for row in best.found_row.tolist()]
    off_mps = [one.speed_mps for one in chosen] - truth.values[best.true_row, SPEED]
    return np.array([[one.sigma_m for one in chosen], off_mps])


def _table_row(sigma_m: FloatArray, off_mps: FloatArray) -> tuple[float, float]:
    return float(np.median(sigma_m)), 1.4826 * float(np.median(np.abs(off_mps)))


if __name__ == "__main__":
    main()
