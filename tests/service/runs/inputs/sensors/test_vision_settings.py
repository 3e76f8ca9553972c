"""Numbers of vision in the site file: they reach the vision of every kind of input; mistakes are told with place."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest

from service.cli.app import run
from service.errors import SiteError
from service.runs.inputs.input_kind import Asked
from service.runs.inputs.opening import open_input
from service.runs.inputs.sites.site import SiteFile, load_site
from service.store.log import open_log
from service.texts.toml_tables import tables_of
from tests.contracts.tables import page
from tests.service.runs.inputs.test_detectors import (
    FRAMES,
    METRES_PER_PIXEL,
    NORTH_M,
    SIZE_PX,
    THERMAL,
    east_m,
    make_ground_csv,
    make_mot,
    make_network,
    make_site,
    make_video,
)
from tests.vision.support import draw_boxes, make_boxes, top_view, write_video
from vision.errors import VisionError
from vision.settings import VisionSettings

LOOKED_AT = FRAMES // 3
NO_CAR = "[vision.tracking]\nmin_length_m = 29\n"  # no vehicle is as long as that
NO_VIEW = "[vision.registration]\nleast_inliers = 1000\n"  # there are not so many corners


def make_textured_video(path: Path, *, cars: int = 1) -> Path:
    """Bright cars that drive east, 12 m apart, over a ground to be known again."""
    rng, camera, pictures = np.random.default_rng(0), top_view(SIZE_PX, METRES_PER_PIXEL), []
    size_px = (SIZE_PX[0], 3 * SIZE_PX[1])  # corners at the border are not followed
    ground = np.clip(70 + cv2.GaussianBlur(rng.normal(0, 120, size_px[::-1]), (0, 0), 2.0), 20, 120)
    for frame in range(FRAMES):
        rows = [(east_m(frame) + 12.0 * car, NORTH_M, 0.0, 4.5, 2.25) for car in range(cars)]
        luma = draw_boxes(size_px, make_boxes(rows), [250.0] * cars, camera, ground=ground)
        pictures.append(np.rint(luma).astype(np.uint8))
    write_video(path, pictures)
    return path


def seen(path: Path, site: Path, detector: str | None) -> int:
    """Count what vision sees in the first frames."""
    feed = open_input(Asked(path, load_site(site), detector=detector)).feed()
    assert feed.vision is not None
    results = [found for sample in islice(feed.samples, LOOKED_AT) for found in feed.vision.observe(sample.value)]
    return sum(len(found.ids) for found in (*results, *feed.vision.finish()))


@pytest.mark.long
def test_numbers_of_the_site_reach_the_vision_of_every_kind_of_input(tmp_path: Path) -> None:
    video, thermal = make_video(tmp_path / "video.mp4"), make_video(tmp_path / "thermal.mp4")
    textured = make_textured_video(tmp_path / "textured.mp4")
    network, mot, metres = make_network(tmp_path), make_mot(tmp_path), make_ground_csv(tmp_path)
    moving, alone = "moving = true\n", "[detector]\nfile_rate_hz = 25\nsize_px = [256, 64]\n"
    kinds = {
        "fixed": (video, "", None),
        "moving": (textured, moving, None),
        "fused": (video, THERMAL, "motion:both"),
        "thermal": (video, THERMAL, "motion:thermal"),
        "network": (video, "", f"onnx:{network}"),
        "boxes with a video": (video, "", f"file:{mot}"),
        "boxes alone": (mot, alone, f"file:{mot}"),
        "metres alone": (metres, "", f"file:{metres}"),
    }
    assert thermal.is_file()
    for kind, (path, extra, detector) in kinds.items():
        counts = [seen(path, make_site(tmp_path, extra + more), detector) for more in ("", NO_CAR)]
        assert counts[0] > LOOKED_AT // 3, kind
        assert counts[1] == 0, kind
    assert seen(textured, make_site(tmp_path, moving + NO_VIEW), None) == 0


@pytest.mark.long
def test_numbers_of_rooms_change_the_run_and_its_identifier(tmp_path: Path) -> None:
    video, told = make_video(tmp_path / "video.mp4", level=95.0), []
    for number, table in enumerate(("", "[vision.background]\nleast_difference_levels = 35\n")):
        url = str(tmp_path / f"{number}.db")
        site = make_site(tmp_path, table)
        assert run(["process", str(video), "--site", str(site), "--log", url]) == 0
        with open_log(url) as log:
            identifier = log.run(None).id
            told.append((identifier, len(list(log.states(identifier)))))
    assert told[0][0] != told[1][0]
    assert told[0][1] > FRAMES // 3
    assert told[1][1] == 0


def test_scale_of_a_site_without_a_camera_follows_its_usual_length(tmp_path: Path) -> None:
    video, site = make_textured_video(tmp_path / "video.mp4", cars=3), tmp_path / "site.toml"
    scales = []
    for length in (4.5, 9.0):
        site.write_text(f'name = "road"\n[vision]\nusual_length_m = {length}\n', encoding="utf-8")
        [warning] = open_input(Asked(video, load_site(site))).warnings
        scales.append(float(re.findall(r"([\d.]+) m a pixel", warning)[0]))
    assert scales[1] == pytest.approx(2 * scales[0], rel=0.01)


def test_mistakes_are_told_with_their_place(tmp_path: Path) -> None:
    for table, message in (
        ("[vision]\nheal_us = 3\n", r"vision.heal_us: .* unknown field; heal_us belongs in \[vision.background\]"),
        ("[vision.road]\nplain_level = 3\n", r"vision.road.plain_level: .*; did you mean plain_levels\?"),
        ("[vision.background]\nheal_us = 0.5\n", r"vision.background.heal_us: expected a whole number, got 0.5"),
        ("[vision.background]\nheal_us = '3 s'\n", r"vision.background.heal_us: expected a whole number, got '3 s'"),
        ("[vision.background]\nheal_us = 0\n", r"vision: .*background.heal_us must be a number above 0, got 0"),
        ("[vision.background]\nperiod_us = -1\n", r"vision: .*background.period_us must be a number >= 0, got -1"),
        ("[vision]\nusual_length_m = inf\n", r"vision: .*usual_length_m must be a number above 0, got inf"),
        ("[vision.tracking]\ncoast_us = true\n", r"vision.tracking.coast_us: expected a whole number, got True"),
        ("[vision]\nroad = 3\n", r"vision.road: expected a table \[vision.road\], got 3"),
    ):
        with pytest.raises(SiteError, match=message):
            load_site(make_site(tmp_path, table))
    video = make_video(tmp_path / "video.mp4")
    for table in ("[vision]\nx = 1\n", "[anchoring]\nx = 1\n"):
        site = make_site(tmp_path, table)
        assert run(["process", str(video), "--site", str(site), "--log", str(tmp_path / "log.db")]) == 3
    assert not (tmp_path / "log.db").exists()


def test_no_number_of_any_room_may_be_nan_or_negative(tmp_path: Path) -> None:
    usual = VisionSettings()
    rooms = [(place, names) for place, names in tables_of(SiteFile) if place in ("vision.background", "vision.road")]
    assert len(rooms) == 2
    for place, names in rooms:
        room = place.removeprefix("vision.")
        for name in names:
            for value in (-1, np.nan):
                with pytest.raises(VisionError, match=f"{room}.{name} must be a number"):
                    replace(usual, **{room: replace(getattr(usual, room), **{name: value})})


def test_one_number_of_a_table_leaves_the_others_as_they_are(tmp_path: Path) -> None:
    sizes = load_site(
        make_site(tmp_path, "[vision.networks.usual_sizes.van]\nlength_m = 6.5\n")
    ).vision.networks.usual_sizes
    usual = VisionSettings().networks.usual_sizes
    assert sizes == replace(usual, van=replace(usual.van, length_m=6.5))


def test_the_page_names_the_rooms_and_its_example_loads(tmp_path: Path) -> None:
    text = page("site_file.md")
    assert all(f"[{place}]" in text for place, _ in tables_of(SiteFile) if place.startswith("vision"))
    [example] = re.findall(r"```toml\n(\[vision.*?)```", text, re.DOTALL)
    assert load_site(make_site(tmp_path, example)).vision != VisionSettings()
