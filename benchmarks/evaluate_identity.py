"""Does a car keep its symbol while nobody sees it? Tracks with gaps and covered places, and who is known again.

No pixels: traffic is simulated, seen from above at 10 rows a second, and its truth is turned into tracks that get lost
(`lost_tracks.py`). Run with ``python -m benchmarks.evaluate_identity [--scenes rural motorway junction]
[--cases plain "gap 4" "hidden 60" ...] [--seeds 1 2 3 4 5] [--swaps SHARE]``. A row pools the seeds. Nothing may be
tuned on other seeds than 1 to 5.
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

from benchmarks.kept_identity import Followed, Returns, count_returns, follow, idf1, revise
from benchmarks.lost_tracks import STEP_US, Case, Place, lose_tracks, read_case
from data_gen.track_scene import TrackScene, make_track_scene
from service.runs.inputs.site import load_site


@dataclass(frozen=True, slots=True)
class Kind:
    """Say which traffic it is, for how long, and where something may cover the road."""

    scenario: str
    seconds: int
    place: Place
    cases: tuple[str, ...]


_GAPS = ("plain", "gap 1", "gap 2", "gap 4", "gap 8")
# In the middle of what the camera sees.
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "rural": Kind("rural_overtaking", 120, Place(500.0, 0.0, False), (*_GAPS, "hidden 60", "hidden 100")),
        "motorway": Kind("motorway", 60, Place(900.0, 148.0, False), (*_GAPS, "hidden 60", "hidden 100")),
        "junction": Kind("junction", 60, Place(0.0, 0.0, True), (*_GAPS, "hidden 30", "hidden 60")),
    }
)
TITLES = (
    *("scene", "case", "absences", "right", "wrong", "new", "IDF1 told", "IDF1 revised"),
    *("links", "wrong links", "of them validated", "median ms", "worst ms"),
)


@dataclass(frozen=True, slots=True)
class Row:
    """Hold the figures of one case in one kind of scene.

    Attributes
    ----------
    returns : of cars that were not seen for a while.
    idf1_told, idf1_revised : of the symbols given at the time, and of those that tracks have at their end.
    links, wrong_links, wrong_validated : how often a lost car was found again, in another vehicle, and believed.
    median_ms, worst_ms : processor time of anchoring a frame.
    """

    scene: str
    case: str
    returns: Returns
    idf1_told: float
    idf1_revised: float
    links: int
    wrong_links: int
    wrong_validated: int
    median_ms: float
    worst_ms: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    options = _parse(arguments)
    print(f"| {' | '.join(TITLES)} |\n|{'---|' * len(TITLES)}")
    rows = []
    for name in options.scenes:
        for row in score_scene(name, options.cases, options.seeds, seconds=options.seconds, swap_share=options.swaps):
            print(row_text(row), flush=True)
            rows.append(row)
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1), encoding="utf-8")


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=tuple(KINDS), default=tuple(KINDS))
    parser.add_argument("--cases", nargs="+", type=read_case, help="default: those of each kind of scene")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--seconds", type=int, help="default: 120 rural, else 60")
    parser.add_argument("--swaps", type=float, default=0.0, help="share of the encounters at which names are exchanged")
    parser.add_argument("--json", type=Path, help="write the figures to a file as well")
    return parser.parse_args(arguments)


def score_scene(
    name: str,
    cases: Sequence[Case] | None,
    seeds: Sequence[int],
    *,
    seconds: int | None = None,
    swap_share: float = 0.0,
) -> Iterator[Row]:
    """Score every case of one kind of scene; each seed is simulated once.

    Parameters
    ----------
    name : of `KINDS`. cases : those of the kind if None. seeds : pooled. seconds : that of the kind if None.
    swap_share : part of the encounters at which two tracks exchange their names.

    Yields
    ------
    A row a case.
    """
    kind = KINDS[name]
    cases = [read_case(text) for text in kind.cases] if cases is None else cases
    with tempfile.TemporaryDirectory(prefix="identity_") as folder:
        scenes = [_scene(kind, seed, seconds or kind.seconds, Path(folder)) for seed in seeds]
        for case in cases:
            yield _pool(name, case, [_follow(scene, case, kind.place, swap_share) for scene in scenes])


def _scene(kind: Kind, seed: int, seconds: int, folder: Path) -> TrackScene:
    return make_track_scene(
        kind.scenario,
        seed=seed,
        duration_us=seconds * 1_000_000,
        out_dir=folder / str(seed),
        rate_hz=1_000_000 // STEP_US,
        in_view=True,
    )


def _follow(scene: TrackScene, case: Case, place: Place, swap_share: float) -> Followed:
    site = load_site(scene.folder / "site.toml")
    tracks = lose_tracks(scene.rows, case, place, seed=scene.seed, swap_share=swap_share)
    return follow(tracks, site.network, site.anchoring)


def _pool(name: str, case: Case, followed: Sequence[Followed]) -> Row:
    wrong = [link for one in followed for link in one.wrong_links]
    frame_ms = [ms for one in followed for ms in one.frame_ms]
    return Row(
        scene=name,
        case=case.name,
        returns=sum((count_returns(one) for one in followed), Returns()),
        idf1_told=idf1([(one, one.symbols) for one in followed]),
        idf1_revised=idf1([(one, revise(one)) for one in followed]),
        links=sum(one.links for one in followed),
        wrong_links=len(wrong),
        wrong_validated=sum(link.is_validated for link in wrong),
        median_ms=statistics.median(frame_ms),
        worst_ms=max(frame_ms),
    )


def row_text(row: Row) -> str:
    """Write one row of the Markdown table."""
    one = row.returns
    shares = (f"{part / one.count:.3f}" if one.count else "-" for part in (one.right, one.wrong, one.new))
    cells = (
        *(row.scene, row.case, str(one.count), *shares),
        *(f"{row.idf1_told:.3f}", f"{row.idf1_revised:.3f}"),
        *(str(row.links), str(row.wrong_links), str(row.wrong_validated)),
        *(f"{row.median_ms:.2f}", f"{row.worst_ms:.1f}"),
    )
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
