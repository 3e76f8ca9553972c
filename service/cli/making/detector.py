"""`dyknow detector`: how does somebody else's network become a detector, and what does it find?"""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.making.site import At, frame_of
from service.cli.options import AsJson
from service.cli.printing import check_target, counted, format_table, show, tell, write_picture
from service.errors import InputError, SiteError

if TYPE_CHECKING:
    from service.runs.inputs.detectors import OnnxChoice

TRIAL_SIZE_PX = 1280, 720  # of the grey picture that a new network is run on
LOOKS = 5  # whose median time is told


def add(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Weights (.onnx), with their recipe (.toml) beside.")],
    sha256: Annotated[str | None, typer.Option(metavar="HEX", help="SHA-256 that the weights must have.")] = None,
    name: Annotated[str | None, typer.Option(help="What to call it. Default: as the file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the detector of this name.")] = False,
    as_json: AsJson = False,
) -> None:
    """Install a network: check digest and recipe, run it once, and copy both to where --detector onnx:NAME looks."""
    from service.runs.inputs.detectors import NAME, detectors_folder, read_recipe, recipe_path

    came = digest_of(file)
    if sha256 is not None and came != sha256.strip().lower():
        raise InputError(f"{file}: expected SHA-256 {sha256}, got {came}; fetch it again, or ask whose digest it is")
    called = file.stem if name is None else name
    if not NAME.fullmatch(called):
        raise InputError(f"{file}: expected --name of letters, digits, - and _, got {called!r}")
    installed = detectors_folder() / f"{called}.onnx"
    if installed.exists() and not force:
        raise InputError(f"{installed}: expected a new --name, or --force to replace it; got one that is there")
    choice = read_recipe(file)
    opened = choice.open(TRIAL_SIZE_PX)
    tell("warning", opened.warnings)
    tell("note", (f"{title}: {text}" for title, text in _origin(choice)))
    installed.parent.mkdir(parents=True, exist_ok=True)
    # The weights last: with them it is there.
    for source, target in ((recipe_path(file), recipe_path(installed)), (file, installed)):
        draft = target.with_suffix(".part")
        draft.write_bytes(source.read_bytes())
        draft.replace(target)
    text = f"{installed}: installed; try it with\n    dyknow detector try CLIP --detector onnx:{called} --out boxes.png"
    show(_record(read_recipe(installed)) | {"runtime": opened.runtime}, text, as_json=as_json)


def list_installed(as_json: AsJson = False) -> None:
    """List the detectors that have a name, the shipped and the installed ones, with what their recipes say."""
    from service.runs.inputs.detectors import detectors_folder, named_detectors, read_recipe

    folder, records = detectors_folder(), []
    for weights in named_detectors().values():
        try:
            records.append(_record(read_recipe(weights)))
        except SiteError as error:  # one that was edited since must not hide the others
            tell("warning", [str(error)])
    table = format_table(list(records[0]), [[_cell(value) for value in record.values()] for record in records])
    show({"folder": str(folder), "detectors": records}, table, as_json=as_json)


def _cell(value: object) -> str:
    """Write a value of a record for a table."""
    if isinstance(value, Mapping):
        return " ".join(f"{number}={word}" for number, word in value.items())
    if isinstance(value, tuple):
        return " x ".join(map(str, value))
    return "as the weights" if value is None else str(value)


def try_on_clip(
    clip: Annotated[Path, typer.Argument(metavar="CLIP", help="A video.")],
    detector: Annotated[str, typer.Option(help="onnx:NAME of an installed detector, or onnx:PATH.")],
    out: Annotated[Path, typer.Option(help="The picture to write (.png, .jpg).")],
    at: At = "0",
    as_json: AsJson = False,
) -> None:
    """Draw what a network finds in a frame of a clip, and tell how long it looked."""
    import numpy as np

    from service.export.drawing import draw_boxes
    from service.runs.inputs.detectors import OnnxChoice, choose_detector, describe
    from vision.networks.box_detector import CLASS_NAMES

    choice = choose_detector(detector, folder=Path())
    if not isinstance(choice, OnnxChoice):
        raise InputError(f"--detector: expected onnx:NAME or onnx:PATH, which looks at one frame; got {detector!r}")
    check_target(out, clip, *choice.files)
    frame = frame_of(clip, at)
    opened = choice.open((frame.luma.shape[1], frame.luma.shape[0]))
    tell("warning", opened.warnings)
    times_s = []
    for _ in range(LOOKS):
        start_s = time.perf_counter()
        boxes = opened.detect(frame)
        times_s.append(time.perf_counter() - start_s)
    boxes = boxes.select(boxes.evidence() > 0)
    look_ms = float(np.median(times_s)) * 1e3
    write_picture(out, draw_boxes(frame.to_bgr(), boxes))
    columns = boxes.class_number, boxes.score.tolist(), boxes.bounds_px().tolist()
    found = [
        {"class": CLASS_NAMES[number], "score": score, "bounds_px": bounds}
        for number, score, bounds in zip(*columns, strict=True)
    ]
    named = describe(choice, opened)
    text = f"{out}: {counted(len(found), 'vehicle')} at {frame.t_us / 1e6:.2f} s, {look_ms:.0f} ms a look, by {named}"
    record = {"out": str(out), "detector": named, "t_us": frame.t_us, "look_ms": round(look_ms, 1), "boxes": found}
    show(record, text, as_json=as_json)


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal digits."""
    from hashlib import file_digest

    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _record(choice: "OnnxChoice") -> dict[str, object]:
    """Say what is known of an installed detector."""
    return {
        "name": choice.weights.stem,
        "layout": choice.settings.layout,
        "classes": choice.settings.classes,
        "input_size_px": choice.settings.input_size_px,
        **dict(_origin(choice)),
        "sha256": digest_of(choice.weights),
    }


def _origin(choice: "OnnxChoice") -> tuple[tuple[str, str], ...]:
    """Say whose a network is; what its recipe is silent about is said too."""
    settings = choice.settings
    return ("licence", settings.licence or "none stated"), ("source", settings.source or "not stated")
