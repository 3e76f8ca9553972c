"""When is it noticed that a camera moves, and is it ever said of one that stands? The watch alone, so it is quick.

``python -m benchmarks.watch_cameras SCENE... [CLIP=SITE.toml ...]`` looks at every frame of the videos of scene folders
(`dyknow generate`), and of clips with or without a site file, as the first seconds of `dyknow process` do and as vision
does from then on.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from gis.cameras.camera import GroundCamera
from service.runs.inputs.sites.site import load_site
from vision.registration.watch import MovementWatch, noticed_px
from vision.settings import VisionSettings
from vision.video.frames import VideoSource, open_video


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each video."""
    print("| video | seconds | a shift counts from | noticed at |\n|---|---|---|---|")
    for named in sys.argv[1:] if arguments is None else arguments:
        video, camera = _opened(named)
        print(_row(Path(named.split("=")[0]).name, video, camera), flush=True)


def _opened(named: str) -> tuple[VideoSource, GroundCamera | None]:
    clip, _, site = named.partition("=")
    if Path(clip).is_dir():
        clip, site = f"{clip}/video.mp4", f"{clip}/site.toml"
    return open_video(Path(clip)), load_site(site).camera if site else None


def _row(name: str, video: VideoSource, camera: GroundCamera | None) -> str:
    settings, size_px = VisionSettings(), (video.width_px, video.height_px)
    least_px = settings.registration.moved_px
    if camera is not None:
        least_px = noticed_px(camera.pixel_from_ground, size_px, settings)
    watch, noticed, t_us = MovementWatch(size_px, settings.registration, least_px=least_px), "never", 0
    for frame in video:
        t_us = frame.t_us
        if watch.look(frame):
            noticed = f"{t_us / 1e6:.2f} s"
            break
    return f"| {name} | {t_us / 1e6:.1f} | {least_px:.1f} px | {noticed} |"


if __name__ == "__main__":
    main()
