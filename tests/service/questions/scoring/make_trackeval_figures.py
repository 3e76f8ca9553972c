"""What does TrackEval say of our random sequences? Writes the figures that `test_trackeval_agreement.py` reads.

TrackEval brings a build of OpenCV that does not go together with ours, so it runs in an environment of its own::

    python -m venv trackeval && trackeval/bin/python -m pip install trackeval
    trackeval/bin/python -m tests.service.questions.scoring.make_trackeval_figures > trackeval_figures.json
    mv trackeval_figures.json tests/service/questions/scoring
"""

import contextlib
import json
import sys
from importlib.metadata import version
from typing import Any  # TrackEval is not typed, and not in the environment of the type checker

import numpy as np

from tests.service.questions.scoring.sequences import FRAMES, SEEDS, BoxTracks, make_sequence

THRESHOLD = {"PRINT_CONFIG": False, "THRESHOLD": 0.5}


def main() -> None:
    """Print the figures of all seeds as JSON."""
    with contextlib.redirect_stdout(sys.stderr):
        figures = {str(seed): _figures(*make_sequence(seed)) for seed in SEEDS}
    json.dump({"trackeval": version("trackeval"), "figures": figures}, sys.stdout, indent=1)
    print()


def _figures(true: BoxTracks, found: BoxTracks) -> dict[str, float]:
    from trackeval.metrics import CLEAR, HOTA, Identity

    data = _as_data(true, found)
    hota, clear, identity = (metric.eval_sequence(data) for metric in (HOTA(), CLEAR(THRESHOLD), Identity(THRESHOLD)))
    averages = {ours: float(np.mean(hota[theirs])) for ours, theirs in _HOTA.items()}
    return (
        averages
        | {ours: float(identity[theirs]) for ours, theirs in _IDENTITY.items()}
        | {ours: float(clear[theirs]) for ours, theirs in _CLEAR.items()}
    )


_HOTA = {"hota": "HOTA", "det_a": "DetA", "ass_a": "AssA", "loc_a": "LocA"}
_IDENTITY = {"idf1": "IDF1", "idp": "IDP", "idr": "IDR"}
_CLEAR = {"mota": "MOTA", "id_switches": "IDSW", "fragmentations": "Frag"}


def _as_data(true: BoxTracks, found: BoxTracks) -> dict[str, Any]:
    from trackeval.datasets._base_dataset import _BaseDataset

    sides = [[(one.track[one.frame == k], one.box_px[one.frame == k]) for k in range(FRAMES)] for one in (true, found)]
    return {
        "num_timesteps": FRAMES,
        "num_gt_ids": int(true.track.max()) + 1,
        "num_tracker_ids": int(found.track.max()) + 1,
        "num_gt_dets": len(true.frame),
        "num_tracker_dets": len(found.frame),
        "gt_ids": [ids for ids, _ in sides[0]],
        "tracker_ids": [ids for ids, _ in sides[1]],
        "similarity_scores": [
            _BaseDataset._calculate_box_ious(boxes, others, box_format="xywh")
            for (_, boxes), (_, others) in zip(*sides, strict=True)
        ],
    }


if __name__ == "__main__":
    main()
