"""`dyknow site`: how does a camera get its site file, and how good is it?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import AsJson
from service.cli.printing import check_target, print_json, show, tell, write_picture
from service.errors import InputError, SiteError
from service.records.times import parse_media_us

if TYPE_CHECKING:
    from service.runs.inputs.sites.site_review import Review
    from vision.objects import ByteArray
    from vision.video.frame import Frame

At = Annotated[str, typer.Option(help="Media time of the frame: 12.5s, 01:23 or 12500000 (us).")]


def new(
    clip: Annotated[Path, typer.Argument(metavar="CLIP", help="A video of the camera.")],
    points: Annotated[
        Path | None, typer.Option(help="CSV: u_px,v_px and x_m,y_m | east_m,north_m,epsg | lat,lon.")
    ] = None,
    lanes: Annotated[Path | None, typer.Option(help="CSV: lane,u_px,v_px, a row for each point of a lane.")] = None,
    out: Annotated[Path, typer.Option(help="The site file to write.")] = Path("site.toml"),
    still: Annotated[Path | None, typer.Option(help="Write a frame as PNG or JPEG too, to read pixels from.")] = None,
    at: At = "0",
    force: Annotated[bool, typer.Option("--force", help="Write over a file that is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Make a site file from points known in the picture and on the ground; tell how well a camera fits them."""
    if points is None and (still is None or lanes is not None):
        raise typer.BadParameter("expected --points FILE, or --still PNG alone to read pixels from; got neither")
    frame = frame_of(clip, at)
    picture = frame.to_bgr()
    for target in (one for one in (still, out if points else None) if one is not None):
        check_target(target, clip, points, lanes)
        if target.exists() and not force:
            raise InputError(f"{target}: expected a new file, or --force to write over it; got one that is there")
    if still is not None:
        write_picture(still, picture)
    if points is not None:
        _write_site(clip, points, lanes, out, frame, as_json=as_json)
    else:
        told = f"{still}: note pixels and places of 8 or more marks as u_px,v_px,x_m,y_m; then"
        show({"still": str(still)}, f"{told}\n    dyknow site new {clip} --points points.csv", as_json=as_json)


def _write_site(clip: Path, points: Path, lanes: Path | None, out: Path, frame: "Frame", *, as_json: bool) -> None:
    import tempfile

    from service.runs.inputs.sites.new_site import read_marks, site_text
    from service.runs.inputs.sites.site import load_site
    from service.runs.inputs.sites.site_review import review

    height_px, width_px = frame.luma.shape
    size_px = width_px, height_px
    marks = read_marks(points, size_px)
    text = site_text(clip.stem, marks, size_px, frame.t_us, lanes)
    # What is wrong is found before anything is written, in a file of the same name elsewhere.
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / out.name
        draft.write_text(text, encoding="utf-8")
        try:
            site = load_site(draft)
        except SiteError as error:
            raise SiteError(str(error).replace(str(draft), str(out))) from error
    assert site.camera is not None
    found = review(site, site.camera, size_px)
    out.write_text(text, encoding="utf-8")
    errors = [*zip(marks.names, found.errors_px.tolist(), found.errors_m.tolist(), strict=True)]
    if as_json:
        told = [{"name": name, "error_px": error_px, "error_m": error_m} for name, error_px, error_m in errors]
        facts = {"facts": found.facts(), "warnings": found.warnings()}
        print_json({"out": str(out), "points": told, **facts})
        return
    print("point        u_px    v_px      x_m      y_m   error px     cm")
    for (name, error_px, error_m), row in zip(errors, marks.points.tolist(), strict=True):
        pixel, ground = f"{row[0]:6.1f}  {row[1]:6.1f}", f"{row[2]:8.2f} {row[3]:8.2f}"
        print(f"{name:10.10} {pixel} {ground} {error_px:10.1f} {100 * error_m:6.0f}")
    _tell_review(found)
    print(f"site file:      {out}")
    if site.network is None:
        print("next:           draw lanes as lane,u_px,v_px and add --lanes FILE; without lanes all ground is road")
    print(f"look at it:     dyknow site check {out} --clip {clip} --out check.png")
    print(f"then:           dyknow process {clip} --site {out} --log {out.stem}.db")


def check(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="Site file.")],
    out: Annotated[Path, typer.Option(help="The picture to write (.png, .jpg).")],
    image: Annotated[Path | None, typer.Option(help="A frame of the camera as a picture.")] = None,
    clip: Annotated[Path | None, typer.Option(help="A video of the camera.")] = None,
    at: Annotated[str | None, typer.Option(help="Media time of the frame; default: that of the points.")] = None,
    as_json: AsJson = False,
) -> None:
    """Draw a site's lanes, points and metre grid on a frame, and warn of what is wrong with them."""
    from service.export.site_picture import draw_site
    from service.runs.inputs.sensors.moving_camera import first_camera
    from service.runs.inputs.sites.site import check_picture, load_site
    from service.runs.inputs.sites.site_review import review
    from service.texts.toml_tables import told

    source = image or clip
    if source is None or (image and clip):
        raise typer.BadParameter("expected one of --image and --clip")
    check_target(out, source, site)
    known = load_site(site)
    if known.camera is None and known.motion is None:
        raise InputError(f"{site}: expected a [camera] to look at, got none")
    at = f"{known.measured_at_us / 1e6}s" if at is None else at
    picture = read_picture(source) if image else frame_of(source, at).to_bgr()
    size_px = (picture.shape[1], picture.shape[0])
    check_picture(known, source, size_px)
    with told(InputError, site):
        camera = first_camera(known.camera, known.motion, size_px)
        found = review(known, camera, size_px)
    write_picture(out, draw_site(picture, known, camera, found))
    if not as_json:
        _tell_review(found)
    show({"out": str(out), "facts": found.facts(), "warnings": found.warnings()}, str(out), as_json=as_json)


def _tell_review(found: "Review") -> None:
    tell("warning", found.warnings())
    for line in found.facts():
        print(line)


def frame_of(clip: Path, at: str) -> "Frame":
    """Read the first frame of a clip at or after a time.

    Raises
    ------
    InputError, QueryError, VisionError
        If the time is none or past the end, or the clip cannot be read.
    """
    from vision.video.frames import open_video

    at_us = parse_media_us(at, parameter="--at")
    for frame in open_video(clip):
        if frame.t_us >= at_us:
            return frame
    raise InputError(f"{clip}: expected a frame at or after --at {at}, got the end of the video")


def read_picture(path: Path) -> "ByteArray":
    """Read a picture.

    Raises
    ------
    InputError
        If it is none.
    """
    import cv2
    import numpy as np

    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise InputError(f"{path}: expected a picture that OpenCV can read, got another file or none")
    return np.asarray(picture, np.uint8)
