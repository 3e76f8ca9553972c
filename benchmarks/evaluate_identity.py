"""Does a car keep its symbol while nobody sees it? Tracks with gaps and covered places, and who is known again.

No pixels: traffic is simulated, seen from above at 10 rows a second, and its truth is turned into tracks that get lost
(`lost_tracks.py`); anchoring sees these and nothing of the truth. Run with ``python -m benchmarks.evaluate_identity
[--scenes rural motorway junction] [--cases plain "gap 4" "hidden 60" ...] [--seeds 1 2 3 4 5] [--overtakes]
[--peer-python ENVIRONMENT/bin/python ...] [--crowd 50 200 500]``. A row pools the seeds. ``--overtakes`` runs the whole
product on the same tracks; ``--peer-python`` names environments with trackers of other people, as for
`benchmarks.bench_trackers`; ``--crowd`` hides many cars at once and tells what the worst frame costs;
``--sensors`` gives cars two tracks, of sensors that lose them at different times, and scores nothing else. Nothing may
be tuned on other seeds than 1 to 5.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType

from benchmarks.hidden_crowd import crowd_network, crowd_tracks
from benchmarks.kept_identity import NamedRows, Returns, count_returns, follow, idf1, revise
from benchmarks.lost_tracks import STEP_US, Case, Place, lose_tracks, read_case
from benchmarks.peer_identity import SWEEPS, best_of_peer
from benchmarks.pooled_scores import merge_evaluations, share_text
from benchmarks.recognised_tracks import score_recognition
from benchmarks.sensor_identity import SENSOR_TITLES, score_sensors
from benchmarks.tracker_runners import Runner, find_runners
from data_gen.outputs.track_scene import TrackScene, make_track_scene
from data_gen.outputs.trajectories import NoisyTracks, write_tracks
from service.questions.scoring.evaluate import Evaluation
from service.runs.inputs.sites.site import load_site

EVENT_TYPE = "overtake"


@dataclass(frozen=True, slots=True)
class Kind:
    """Say which traffic it is, for how long, where something may cover the road, and whether anybody overtakes."""

    scenario: str
    seconds: int
    place: Place
    cases: tuple[str, ...]
    has_overtakes: bool = True


_GAPS = ("plain", "gap 1", "gap 2", "gap 4", "gap 8")
# The places lie in the middle of what the camera sees.
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "rural": Kind("rural_overtaking", 120, Place(500.0, 0.0, False), (*_GAPS, "hidden 60", "hidden 100")),
        "motorway": Kind("motorway", 60, Place(900.0, 148.0, False), (*_GAPS, "hidden 60", "hidden 100")),
        "junction": Kind("junction", 60, Place(0.0, 0.0, True), (*_GAPS, "hidden 30", "hidden 60"), False),
    }
)


@dataclass(frozen=True, slots=True)
class Row:
    """Hold the figures of one case in one kind of scene.

    Attributes
    ----------
    returns : of cars that were not seen for a while.
    idf1_told, idf1_revised : of the symbols given at the time, and of those that tracks have at their end.
    links, wrong_links, wrong_validated : cars found again; in another vehicle; of these, validated.
    right_undecided : cars found again in the right vehicle whose link ended undecided.
    median_ms : processor time of anchoring a frame.
    overtakes : of the whole product; None if nobody asked.
    """

    scene: str
    case: str
    returns: Returns
    idf1_told: float
    idf1_revised: float
    links: int
    wrong_links: int
    wrong_validated: int
    right_undecided: int
    median_ms: float
    overtakes: Evaluation | None = None


@dataclass(frozen=True, slots=True)
class PeerRow:
    """Hold the figures of another tracker with its best settings for the case."""

    scene: str
    case: str
    peer: str
    returns: Returns
    idf1: float
    settings: Mapping[str, float | int]


@dataclass(frozen=True, slots=True)
class CrowdRow:
    """Hold what it costs to find a crowd again; processor time of anchoring a frame."""

    cars: int
    returns: Returns
    median_ms: float
    worst_ms: float


ROW_TITLES = (
    *("scene", "case", "right", "wrong", "new", "share right", "share wrong", "IDF1 told", "IDF1 revised"),
    *("links", "wrong links", "of them validated", "right undecided", "ms a frame"),
)
OVERTAKE_TITLES = ("scene", "case", "overtakes right", "wrong", "missed", "border", "precision", "recall")
PEER_TITLES = ("scene", "case", "tracker", "right", "wrong", "new", "share right", "share wrong", "IDF1", "settings")
CROWD_TITLES = ("cars", "right", "wrong", "new", "ms a frame", "ms of the worst frame")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    options = _parse(arguments)
    if options.sensors:
        print(_header(SENSOR_TITLES), flush=True)
        for name in options.scenes:
            with tempfile.TemporaryDirectory(prefix="identity_") as folder:
                scenes = make_scenes(name, options.seeds, Path(folder), seconds=options.seconds)
                print(_line(score_sensors(name, scenes, KINDS[name].place).cells()), flush=True)
        return
    peers = find_runners(options.peer_python) if options.peer_python else {}
    rows: list[Row] = []
    peer_rows: list[PeerRow] = []
    print(_header(ROW_TITLES), flush=True)
    for name in options.scenes:
        with tempfile.TemporaryDirectory(prefix="identity_") as folder:
            scenes = make_scenes(name, options.seeds, Path(folder), seconds=options.seconds)
            for case in options.cases or [read_case(text) for text in KINDS[name].cases]:
                tracks = lose_all(name, case, scenes, swap_share=options.swaps)
                rows.append(score_case(name, case, scenes, tracks, with_overtakes=options.overtakes))
                print(row_text(rows[-1]), flush=True)
                peer_rows += score_peers(name, case, tracks, peers)
    print(f"\n{wrong_link_text(rows)}")
    _print_table(OVERTAKE_TITLES, [overtake_text(row, row.overtakes) for row in rows if row.overtakes])
    _print_table(PEER_TITLES, [peer_text(row) for row in peer_rows])
    crowds = [score_crowd(cars, options.seeds[0]) for cars in options.crowd]
    _print_table(CROWD_TITLES, [crowd_text(row) for row in crowds])
    if options.json:
        records = {
            "cases": [
                {**asdict(row), "overtakes": row.overtakes.as_record() if row.overtakes else None} for row in rows
            ],
            "peers": [asdict(row) for row in peer_rows],
            "crowds": [asdict(row) for row in crowds],
        }
        options.json.write_text(json.dumps(records, indent=1), encoding="utf-8")


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="*", choices=tuple(KINDS), default=tuple(KINDS))
    parser.add_argument("--cases", nargs="+", type=read_case, help="default: those of each kind of scene")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, help="default: 120 rural, else 60")
    parser.add_argument("--swaps", type=float, default=0.0, help="share of the encounters at which names are exchanged")
    parser.add_argument("--overtakes", action="store_true", help="score the overtakes that the whole product tells")
    parser.add_argument("--peer-python", type=Path, nargs="*", default=[], help="environments that hold peers")
    parser.add_argument("--crowd", type=int, nargs="*", default=[], help="numbers of cars to hide at once")
    parser.add_argument("--sensors", action="store_true", help="two sensors on one view, and nothing else")
    parser.add_argument("--json", type=Path, help="write the figures to a file as well")
    return parser.parse_args(arguments)


def make_scenes(name: str, seeds: Sequence[int], folder: Path, *, seconds: int | None = None) -> list[TrackScene]:
    """Simulate one kind of scene, once a seed.

    Parameters
    ----------
    name : of `KINDS`. seeds : one a scene. folder : to write to. seconds : that of the kind if None.
    """
    kind = KINDS[name]
    return [
        make_track_scene(
            kind.scenario,
            seed=seed,
            duration_us=(seconds or kind.seconds) * 1_000_000,
            out_dir=folder / str(seed),
            rate_hz=1_000_000 // STEP_US,
            in_view=True,
        )
        for seed in seeds
    ]


def lose_all(name: str, case: Case, scenes: Sequence[TrackScene], *, swap_share: float = 0.0) -> list[NoisyTracks]:
    """Make the tracks of all scenes of a kind get lost; see `lose_tracks`."""
    place = KINDS[name].place
    return [lose_tracks(scene.rows, case, place, seed=scene.seed, swap_share=swap_share) for scene in scenes]


def score_case(
    name: str,
    case: Case,
    scenes: Sequence[TrackScene],
    tracks: Sequence[NoisyTracks],
    *,
    with_overtakes: bool = False,
) -> Row:
    """Let anchoring follow lost tracks, and score what it says of all scenes together.

    Parameters
    ----------
    name : of `KINDS`. case, tracks : as of `lose_all`. scenes : whose truth and roads they are.
    with_overtakes : run the whole product as well, where anybody overtakes.
    """
    named = [_follow(scene, one) for scene, one in zip(scenes, tracks, strict=True)]
    wrong = [link for one in named for link in one.wrong_links]
    frame_ms = [ms for one in named for ms in one.frame_ms]
    overtakes = None
    if with_overtakes and KINDS[name].has_overtakes:
        overtakes = merge_evaluations([_score_overtakes(*both) for both in zip(scenes, tracks, strict=True)])
    return Row(
        scene=name,
        case=case.name,
        returns=sum((count_returns(one) for one in named), Returns()),
        idf1_told=idf1([(one, one.symbols) for one in named]),
        idf1_revised=idf1([(one, revise(one)) for one in named]),
        links=sum(one.links for one in named),
        wrong_links=len(wrong),
        wrong_validated=sum(link.is_validated for link in wrong),
        right_undecided=sum(one.right_undecided for one in named),
        median_ms=statistics.median(frame_ms),
        overtakes=overtakes,
    )


def _follow(scene: TrackScene, tracks: NoisyTracks) -> NamedRows:
    site = load_site(scene.folder / "site.toml")
    return follow(tracks, site.network, site.anchoring)


def _score_overtakes(scene: TrackScene, tracks: NoisyTracks) -> Evaluation:
    file = scene.folder / "tracks.csv"
    write_tracks(file, tracks)
    return score_recognition(scene, file, EVENT_TYPE)


def score_peers(name: str, case: Case, tracks: Sequence[NoisyTracks], peers: Mapping[str, Runner]) -> Iterator[PeerRow]:
    """Let other trackers follow the same, each with its best settings; peers that are not in `SWEEPS` are left out."""
    for peer in (peer for peer in SWEEPS if peer in peers):
        settings, named = best_of_peer(peer, peers[peer], tracks)
        returns = sum((count_returns(one) for one in named), Returns())
        yield PeerRow(name, case.name, peer, returns, idf1([(one, one.symbols) for one in named]), settings)


def score_crowd(cars: int, seed: int) -> CrowdRow:
    """Hide a crowd at once, and find it again."""
    named = follow(crowd_tracks(cars, seed=seed), crowd_network(cars))
    return CrowdRow(cars, count_returns(named), statistics.median(named.frame_ms), max(named.frame_ms))


def row_text(row: Row) -> str:
    """Write one row of the Markdown table."""
    cells = (
        *(row.scene, row.case, *_return_cells(row.returns)),
        *(f"{row.idf1_told:.3f}", f"{row.idf1_revised:.3f}"),
        *(str(row.links), str(row.wrong_links), str(row.wrong_validated), str(row.right_undecided)),
        f"{row.median_ms:.2f}",
    )
    return _line(cells)


def overtake_text(row: Row, score: Evaluation) -> str:
    """Write one row of the table of overtakes."""
    right, wrong, missed = len(score.right), len(score.wrong), len(score.missed)
    counts = (str(count) for count in (right, wrong, missed, len(score.border)))
    return _line((row.scene, row.case, *counts, share_text(right, right + wrong), share_text(right, right + missed)))


def peer_text(row: PeerRow) -> str:
    """Write one row of the table of peers."""
    settings = ", ".join(f"{name} {value:g}" for name, value in row.settings.items())
    return _line([row.scene, row.case, row.peer, *_return_cells(row.returns), f"{row.idf1:.3f}", settings])


def crowd_text(row: CrowdRow) -> str:
    """Write one row of the table of crowds."""
    counts = (row.cars, row.returns.right, row.returns.wrong, row.returns.new)
    return _line([*(str(count) for count in counts), f"{row.median_ms:.2f}", f"{row.worst_ms:.1f}"])


def wrong_link_text(rows: Sequence[Row]) -> str:
    """Say how many wrong links of all cases together were believed in the end, and how many right ones were not."""
    wrong, validated = sum(row.wrong_links for row in rows), sum(row.wrong_validated for row in rows)
    right, undecided = sum(row.links for row in rows) - wrong, sum(row.right_undecided for row in rows)
    return (
        f"wrong links of all cases: {wrong}, validated in the end: {validated}, {share_text(validated, wrong)}\n"
        f"right links of all cases: {right}, undecided in the end: {undecided}, {share_text(undecided, right)}"
    )


def _return_cells(returns: Returns) -> list[str]:
    counts = [str(count) for count in (returns.right, returns.wrong, returns.new)]
    return [*counts, share_text(returns.right, returns.count), share_text(returns.wrong, returns.count)]


def _print_table(titles: Sequence[str], lines: Sequence[str]) -> None:
    if lines:
        print("", _header(titles), *lines, sep="\n", flush=True)


def _header(titles: Sequence[str]) -> str:
    return f"{_line(titles)}\n|{'---|' * len(titles)}"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
