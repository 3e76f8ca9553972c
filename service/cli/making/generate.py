"""`dyknow generate`: where do test videos come from? A synthetic scene with exact truth."""

import sys
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager


class CameraChoice(StrEnum):
    """How the scene is filmed; the names are those of `data_gen.drawing.cameras`, which loads more than help needs."""

    VERTICAL = "vertical"
    OBLIQUE = "oblique"
    UAV = "uav"


class WeatherChoice(StrEnum):
    """The light; the names are those of `data_gen.drawing.sun`."""

    SUNNY = "sunny"
    CLOUDS = "clouds"
    OVERCAST = "overcast"


def generate(
    scenario: Annotated[str, typer.Argument(help="What to simulate, such as rural_overtaking.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for the scene; made if missing.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="The same seed gives the same scene to the byte.")] = 1,
    seconds: Annotated[float, typer.Option("--seconds", min=1.0, max=86_400.0, help="Length of the video.")] = 60.0,
    camera: Annotated[
        CameraChoice, typer.Option("--camera", help="Straight above, slantwise from a mast, or a drone that drifts.")
    ] = CameraChoice.VERTICAL,
    poses: Annotated[bool, typer.Option("--poses", help="Tell the site file of the poses, with --camera uav.")] = False,
    thermal: Annotated[bool, typer.Option("--thermal", help="Add the video of a thermal camera.")] = False,
    weather: Annotated[
        WeatherChoice, typer.Option("--weather", help="Sun, drifting clouds, or a closed layer of cloud.")
    ] = WeatherChoice.SUNNY,
    occluders: Annotated[
        str, typer.Option("--occluders", help="What hides the traffic: none, all, or some of trees, bridge, gantry.")
    ] = "none",
    degrade: Annotated[
        str, typer.Option("--degrade", help="Faults of the video, as noise=2,drop=0.05,duplicate=0.02,gap=10+2.")
    ] = "",
    size: Annotated[str, typer.Option("--size", help="Width and height of the image in pixels.")] = "1280x720",
    fps: Annotated[int, typer.Option("--fps", min=1, help="Frames per second, a divisor of 1000 from 10 up.")] = 25,
    option: Annotated[
        list[str] | None, typer.Option("--option", help="Option of the scenario, NAME=VALUE; may come several times.")
    ] = None,
) -> None:
    """Simulate traffic and draw it: video, site file, road network and truth."""
    from data_gen.degrade import parse_degradation
    from data_gen.scene import generate as make_scene

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
            camera=camera.value,
            poses=poses,
            thermal=thermal,
            weather=weather.value,
            occluders=[name.strip() for name in occluders.split(",")],
            degradation=parse_degradation(degrade),
            options=read_scenario_options(option or []),
            progress=on_frame,
        )
    for path in sorted(out.iterdir()):
        print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise typer.BadParameter(f"expected WIDTHxHEIGHT in pixels, as 1280x720, got {text!r}", param_hint="--size")
    return int(width), int(height)


def read_scenario_options(items: list[str]) -> dict[str, str]:
    """Read scenario options as given on the command line, NAME=VALUE each."""
    pairs = [item.partition("=") for item in items]
    for (name, equals, _), item in zip(pairs, items, strict=True):
        if not (name and equals):
            raise typer.BadParameter(f"expected NAME=VALUE, got {item!r}", param_hint="--option")
    return {name: value for name, _, value in pairs}


def drawing_bar(title: str) -> "AbstractContextManager[Callable[[int, int], None]]":
    """Show how many frames are drawn, on a terminal only; yields the callback."""
    if not sys.stderr.isatty():
        return nullcontext(lambda done, total: None)
    return _DrawingBar(title)


class _DrawingBar:
    def __init__(self, title: str) -> None:
        from rich.console import Console
        from rich.progress import Progress

        self._progress = Progress(console=Console(stderr=True))
        self._task = self._progress.add_task(title, total=None)

    def __enter__(self) -> "Callable[[int, int], None]":
        self._progress.start()
        return lambda done, total: self._progress.update(self._task, completed=done, total=total)

    def __exit__(self, *_: object) -> None:
        self._progress.stop()
