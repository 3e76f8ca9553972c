"""How do scores of detections and tracks look on a terminal?"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from service.scoring.detection import DetectionScore
    from service.scoring.tracks import TrackScore

NONE = "-"


def detection_table(score: "DetectionScore", seen_by: str) -> str:
    """Lay out how well vehicles are seen; a row of the counts is one vehicle in one frame.

    Parameters
    ----------
    score : the figures. seen_by : what was compared with the truth, such as "vision objects".
    """
    from service.cli.tables import format_table
    from service.scoring.detection import REACH_M

    standing = score.standing_right + score.standing_missed
    rows = [
        _share_row("precision", score.right, score.right + score.wrong),
        _share_row("recall", score.right, score.right + score.missed),
        _share_row("standing recall", score.standing_right, standing),
        *(_share_row(f"recall of {kind}", *_of_both(counts)) for kind, counts in score.by_kind.items() if kind),
    ]
    error = f"mean {score.mean_error_m:.3f} m, 95 % below {score.most_error_m:.3f} m" if score.right else NONE
    return (
        format_table([f"detection: {seen_by}", "share", "95 %", "rows"], rows)
        + f"found within {REACH_M:g} m; centre error: {error}; {score.border} found rows at the border\n"
    )


def tracks_table(scores: Mapping[str, "TrackScore"]) -> str:
    """Lay out how well vehicles are followed, a line for each level at which names are given."""
    from service.cli.tables import format_table

    titles = ["tracks", "HOTA", "DetA", "AssA", "LocA", "IDF1", "IDP", "IDR", "MOTA"]
    counts = ["switches", "fragmentations", "found", "true"]
    rows = []
    for level, one in scores.items():
        shares = (one.hota, one.det_a, one.ass_a, one.loc_a, one.idf1, one.idp, one.idr, one.mota)
        numbers = (one.id_switches, one.fragmentations, one.found_tracks, one.true_tracks)
        rows.append([level, *(f"{share:.3f}" for share in shares), *map(str, numbers)])
    return format_table([*titles, *counts], rows)


def _share_row(name: str, part: int, whole: int) -> list[str]:
    from service.scoring.proportions import wilson_interval

    if not whole:
        return [name, NONE, NONE, NONE]
    low, high = wilson_interval(part, whole)
    return [name, f"{part / whole:.3f}", f"{low:.3f} to {high:.3f}", f"{part} of {whole}"]


def _of_both(counts: tuple[int, int]) -> tuple[int, int]:
    right, missed = counts
    return right, right + missed
