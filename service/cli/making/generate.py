"""`dyknow generate` and `dyknow trajectories`: where do test videos and tracks come from? Scenes with exact truth."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

from service.cli.options import AsJson, ScenarioOptions, Seed, read_pairs
from service.cli.printing import show

SCENE_FILES = ("truth.csv", "camera.csv")

# The words are those of `data_gen.drawing`, which loads more than help needs.
CameraChoice = Literal["vertical", "oblique", "uav", "mast"]
WeatherChoice = Literal["sunny", "clouds", "overcast"]


def generate(
    scenario: Annotated[str, typer.Argument(help="What to simulate, such as rural_overtaking.")],
    out: Annotated[Path, typer.Option(help="Folder for the scene; made if missing.")],
    seed: Seed = 1,
    seconds: Annotated[float, typer.Option(min=1.0, max=86_400.0, help="Length of the video.")] = 60.0,
    camera: Annotated[
        CameraChoice, typer.Option(help="Straight above, slantwise from high up, a drone that drifts, or a low mast.")
    ] = "vertical",
    poses: Annotated[bool, typer.Option("--poses", help="Tell the site file of the poses, with --camera uav.")] = False,
    thermal: Annotated[bool, typer.Option("--thermal", help="Add the video of a thermal camera.")] = False,
    weather: Annotated[WeatherChoice, typer.Option(help="Sun, drifting clouds, or a closed layer of cloud.")] = "sunny",
    occluders: Annotated[
        str, typer.Option(help="What hides the traffic: none, all, or some of trees, bridge, gantry.")
    ] = "none",
    degrade: Annotated[
        str, typer.Option(help="Faults of the video, as noise=2,drop=0.05,duplicate=0.02,gap=10+2.")
    ] = "",
    size: Annotated[str, typer.Option(help="Width and height of the image in pixels.")] = "1280x720",
    fps: Annotated[int, typer.Option(min=1, help="Frames per second, a divisor of 1000 from 10 up.")] = 25,
    option: ScenarioOptions = None,
    as_json: AsJson = False,
) -> None:
    """Simulate traffic and draw it: video, site file, road network and truth."""
    from data_gen.drawing.degrade import parse_degradation
    from data_gen.outputs.scene import generate as make_scene

    width_px, height_px = _size(size)
    with drawing_bar(f"{scenario} seed {seed}") as on_frame:
        make_scene(
            scenario,
            seed=seed,
            duration_us=round(seconds * 1e6),
            out_dir=out,
            width_px=width_px,
            height_px=height_px,
            rate_hz=fps,
            camera=camera,
            poses=poses,
            thermal=thermal,
            weather=weather,
            occluders=[name.strip() for name in occluders.split(",")],
            degradation=parse_degradation(degrade),
            options=dict(read_pairs(option or [], "--option", "NAME=VALUE")),
            progress=on_frame,
        )
    sizes = {str(path): path.stat().st_size for path in sorted(out.iterdir())}
    record = {"out": str(out), "files": [{"path": path, "bytes": size} for path, size in sizes.items()]}
    show(record, "\n".join(f"{path}  {size / 1e6:.1f} MB" for path, size in sizes.items()), as_json=as_json)


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise typer.BadParameter(f"expected WIDTHxHEIGHT in pixels, as 1280x720, got {text!r}", param_hint="--size")
    return int(width), int(height)


@contextmanager
def drawing_bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many frames are drawn, on a terminal only; yields the callback."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def trajectories(
    source: Annotated[
        str, typer.Argument(metavar="SCENARIO|FOLDER", help="A scenario, or the folder of a generated scene.")
    ],
    out: Annotated[Path, typer.Option(help="Trajectory file (.csv); site and truth are written beside it.")],
    seed: Seed = 1,
    seconds: Annotated[float, typer.Option(min=0.1, max=86_400.0, help="Length of the clip, of a scenario.")] = 300.0,
    rate_hz: Annotated[
        int | None, typer.Option(min=1, help="Rows a second of each vehicle; 10, or those of the folder.")
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Only what the scenario's camera sees.")] = False,
    position_noise_m: Annotated[float, typer.Option(help="Of x and y, one sigma.")] = 0.0,
    heading_noise_rad: Annotated[float, typer.Option(help="One sigma.")] = 0.0,
    speed_noise_mps: Annotated[float, typer.Option(help="One sigma.")] = 0.0,
    miss: Annotated[float, typer.Option(help="Part of the rows that is missing, 0 to 1.")] = 0.0,
    gap: Annotated[str, typer.Option(help="RATE:SECONDS: gaps a minute of each vehicle, and their length.")] = "",
    swap: Annotated[float, typer.Option(help="Part of the encounters that exchange ids, 0 to 1.")] = 0.0,
    same_id: Annotated[bool, typer.Option("--same-id", help="After a gap the old id comes back.")] = False,
    option: ScenarioOptions = None,
    as_json: AsJson = False,
) -> None:
    """Write tracks of simulated traffic, with noise, gaps and swapped ids."""
    from data_gen.outputs.track_scene import make_track_scene, write_folder_tracks, write_scenario_tracks
    from data_gen.outputs.trajectories import TrackFaults

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
        tracks = write_folder_tracks(Path(source), out, seed=seed, rate_hz=rate_hz, faults=faults)
    else:
        scene = make_track_scene(
            source,
            seed=seed,
            duration_us=round(seconds * 1e6),
            out_dir=out.parent,
            rate_hz=10 if rate_hz is None else rate_hz,
            in_view=view,
            options=dict(read_pairs(option or [], "--option", "NAME=VALUE")),
        )
        tracks = write_scenario_tracks(scene, out, faults)
    vehicles, names = len(set(tracks.rows.vehicles)), len(set(tracks.ids))
    counts = {"rows": len(tracks.ids), "vehicles": vehicles, "tracks": names}
    counts |= {"gaps": len(tracks.gaps), "swaps": len(tracks.swaps)}
    site = out.parent / "site.toml"
    told = f"{out}: {', '.join(f'{count} {name}' for name, count in counts.items())}"
    told += f"\nprocess them:   dyknow process {out} --site {site} --log LOG.db"
    show({"out": str(out), "site": str(site), **counts}, told, as_json=as_json)


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
