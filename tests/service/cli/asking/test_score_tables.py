"""Tables of scores: every figure in its place, and a dash where there is nothing to divide by."""

from service.cli.asking.evaluate import detection_table, tracks_table
from service.questions.scoring.detection import DetectionScore
from service.questions.scoring.tracks import TrackScore


def detection(*, right: int = 9, wrong: int = 1, missed: int = 3, standing: tuple[int, int] = (0, 0)) -> DetectionScore:
    return DetectionScore(
        right=right,
        wrong=wrong,
        missed=missed,
        border=2,
        mean_error_m=0.25,
        most_error_m=0.75,
        standing_right=standing[0],
        standing_missed=standing[1],
        by_kind={"car": (right, missed)},
    )


def test_shares_stand_with_their_interval_and_counts() -> None:
    assert detection_table(detection(standing=(3, 1)), "vision objects").splitlines() == [
        "detection: vision objects  share  95 %            rows",
        "precision                  0.900  0.596 to 0.982  9 of 10",
        "recall                     0.750  0.468 to 0.911  9 of 12",
        "standing recall            0.750  0.301 to 0.954  3 of 4",
        "recall of car              0.750  0.468 to 0.911  9 of 12",
        "found within 2 m; centre error: mean 0.250 m, 95 % below 0.750 m; 2 found rows at the border",
    ]


def test_share_of_nothing_is_a_dash() -> None:
    lines = detection_table(detection(right=0, wrong=0, missed=0), "cars").splitlines()
    assert [line.split()[-3:] for line in lines[1:4]] == [["-", "-", "-"]] * 3
    assert "centre error: -;" in lines[-1]


def test_each_level_has_a_line() -> None:
    score = TrackScore(0.5, 0.6, 0.7, 0.8, 0.9, 0.91, 0.92, -1.5, 3, 4, 100, 90, 5, 6)
    title, first, second = tracks_table({"vision objects": score, "cars": score}).splitlines()
    assert " ".join(title.split()) == (
        "tracks HOTA DetA AssA LocA IDF1 IDP IDR MOTA switches fragmentations found true"
    )
    assert " ".join(first.split()[2:]) == "0.500 0.600 0.700 0.800 0.900 0.910 0.920 -1.500 3 4 6 5"
    assert second.split()[0] == "cars"
