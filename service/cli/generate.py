"""`dyknow generate`: where do test videos come from? A synthetic scene with exact truth."""

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager


def generate(
    scenario: Annotated[str, typer.Argument(help="What to simulate, such as rural_overtaking.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for the scene; made if missing.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="The same seed gives the same scene to the byte.")] = 1,
    seconds: Annotated[float, typer.Option("--seconds", min=1.0, max=86_400.0, help="Length of the video.")] = 60.0,
) -> None:
    """Simulate traffic and draw it: video, site file, road network and truth."""
    from data_gen.generate import generate as make_scene

    with drawing_bar(f"{scenario} seed {seed}") as on_frame:
        make_scene(scenario, seed=seed, duration_us=round(seconds * 1e6), out_dir=out, progress=on_frame)
    for path in sorted(out.iterdir()):
        print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")


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
