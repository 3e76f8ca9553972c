"""Our figures against those of TrackEval, the reference program, on the same random sequences."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from service.questions.scoring.pairs import box_pairs
from service.questions.scoring.tracks import TrackRows, score_tracks
from tests.service.questions.scoring.sequences import SEEDS, make_sequence

STORED = json.loads((Path(__file__).parent / "trackeval_figures.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("seed", SEEDS)
def test_every_figure_agrees_with_trackeval(seed: int) -> None:
    true, found = make_sequence(seed)
    pairs = box_pairs(true.frame, true.box_px, found.frame, found.box_px)
    ours = asdict(score_tracks(TrackRows(true.frame, true.track), TrackRows(found.frame, found.track), pairs))
    theirs = STORED["figures"][str(seed)]
    assert {name: ours[name] for name in theirs} == pytest.approx(theirs, abs=1e-6)


def test_the_sequences_have_every_fault() -> None:
    """Figures that agree on perfect tracks would say nothing."""
    worst = STORED["figures"][str(max(SEEDS))]
    assert worst["id_switches"] > 30
    assert worst["fragmentations"] > 30
    assert worst["hota"] < 0.5
