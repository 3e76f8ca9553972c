"""`dyknow trajectories`: tracks without a video, as bad as one asks for."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from data_gen.trajectories import NoisyTracks, TrackFaults


SCENE_FILES = ("truth.csv", "camera.csv")


def trajectories(
    source: Annotated[
        str, typer.Argument(metavar="SCENARIO|FOLDER", help="A scenario, or the folder of a generated scene.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Trajectory file (.csv); site and truth are written beside it.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="The same seed gives the same files.")] = 1,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.1, max=86_400.0, help="Length of the clip, of a scenario.")
    ] = 300.0,
    rate_hz: Annotated[
        int | None, typer.Option("--rate-hz", min=1, help="Rows a second of each vehicle; 10, or those of the folder.")
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Only what the scenario's camera sees.")] = False,
    position_noise_m: Annotated[float, typer.Option("--position-noise-m", help="Of x and y, one sigma.")] = 0.0,
    heading_noise_rad: Annotated[float, typer.Option("--heading-noise-rad", help="One sigma.")] = 0.0,
    speed_noise_mps: Annotated[float, typer.Option("--speed-noise-mps", help="One sigma.")] = 0.0,
    miss: Annotated[float, typer.Option("--miss", help="Part of the rows that is missing, 0 to 1.")] = 0.0,
    gap: Annotated[
        str, typer.Option("--gap", help="RATE:SECONDS: gaps a minute of each vehicle, and their length.")
    ] = "",
    swap: Annotated[float, typer.Option("--swap", help="Part of the encounters that exchange ids, 0 to 1.")] = 0.0,
    same_id: Annotated[bool, typer.Option("--same-id", help="After a gap the old id comes back.")] = False,
    option: Annotated[
        list[str] | None, typer.Option("--option", help="Option of the scenario, NAME=VALUE; may come several times.")
    ] = None,
) -> None:
    """Write tracks of simulated traffic, with noise, gaps and swapped ids."""
    from data_gen.trajectories import TrackFaults
    from service.cli.making.generate import read_scenario_options

    _check_out(out)
    gaps_per_minute, gap_us = parse_gap(gap)
    faults = TrackFaults(
        position_sigma_m=position_noise_m,
        heading_sigma_rad=heading_noise_rad,
        speed_sigma_mps=speed_noise_mps,
        miss_share=miss,
        gaps_per_minute=gaps_per_minute,
        gap_us=gap_us,
        swap_share=swap,
        keeps_ids=same_id,
    )
    if Path(source).is_dir():
        if view or option:
            raise typer.BadParameter(f"expected a scenario for --view and --option, got the folder {source!r}")
        tracks = _of_folder(Path(source), out, seed, rate_hz, faults)
    else:
        tracks = _of_scenario(
            source,
            out,
            faults,
            seed=seed,
            duration_us=round(seconds * 1e6),
            rate_hz=10 if rate_hz is None else rate_hz,
            in_view=view,
            options=read_scenario_options(option or []),
        )
    print(
        f"{out}: {len(tracks.ids)} rows, {len(set(tracks.rows.vehicles))} vehicles, {len(set(tracks.ids))} tracks, "
        f"{len(tracks.gaps)} gaps, {len(tracks.swaps)} swaps"
    )
    print(f"process them:   dyknow process {out} --site {out.parent / 'site.toml'} --log LOG.db")


def parse_gap(text: str) -> tuple[float, int]:
    """Read gaps as given on the command line: how many a minute, and how long in microseconds.

    Raises
    ------
    typer.BadParameter
        If the text is not RATE:SECONDS.

    Examples
    --------
    >>> parse_gap("0.5:2"), parse_gap("")
    ((0.5, 2000000), (0.0, 0))
    """
    if not text:
        return 0.0, 0
    rate, colon, seconds = text.partition(":")
    try:
        if colon:
            return float(rate), round(float(seconds) * 1e6)
    except (ValueError, OverflowError):
        pass
    raise typer.BadParameter(f"expected RATE:SECONDS, as 0.5:2, got {text!r}", param_hint="--gap")


def _check_out(out: Path) -> None:
    """Refuse a name that is no trajectory file's to us, or that of a file of the scene itself."""
    if out.suffix.lower() != ".csv" or out.name in SCENE_FILES:
        expected = f"expected a path that ends in .csv and none of {', '.join(SCENE_FILES)}"
        raise typer.BadParameter(f"{expected}, got {str(out)!r}", param_hint="--out")


def _of_folder(folder: Path, out: Path, seed: int, rate_hz: int | None, faults: "TrackFaults") -> "NoisyTracks":
    from data_gen.track_scene import write_folder_tracks

    return write_folder_tracks(folder, out, seed=seed, rate_hz=rate_hz, faults=faults)


def _of_scenario(
    name: str,
    out: Path,
    faults: "TrackFaults",
    *,
    seed: int,
    duration_us: int,
    rate_hz: int,
    in_view: bool,
    options: dict[str, str],
) -> "NoisyTracks":
    from data_gen.track_scene import make_track_scene, write_scenario_tracks

    scene = make_track_scene(
        name,
        seed=seed,
        duration_us=duration_us,
        out_dir=out.parent,
        rate_hz=rate_hz,
        in_view=in_view,
        options=options,
    )
    return write_scenario_tracks(scene, out, faults)
