from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from tests.cases import for_each
from tests.vision.onnx_file import FloatArray, blob_finder, constant_answer, model, node
from tests.vision.support import make_frame
from vision.errors import VisionError
from vision.networks.box_detector import CLASS_NAMES, ImageBoxes
from vision.networks.onnx.closer_look import CloserLook
from vision.networks.onnx.detector import OnnxDetector, suppress
from vision.networks.onnx.network import Network
from vision.networks.onnx.network_input import Letterbox, picture_scale
from vision.networks.onnx.settings import Layout, OnnxSettings

SIZE_PX = (128, 72)
# Scores of the test network are mean brightness: road is 100, a bright car 235.
SETTINGS = OnnxSettings("yolo", {0: "car"}, score_threshold=0.8, nms_threshold=0.1)


def weights(folder: Path, data: bytes) -> Path:
    path = folder / "net.onnx"
    path.write_bytes(data)
    return path


def picture(*cars_px: tuple[int, int], size_px: tuple[int, int] = SIZE_PX) -> FloatArray:
    """Dark road with bright cars of 16 x 8 px, given by their top left pixels."""
    luma = np.full((size_px[1], size_px[0]), 60.0, np.float32)
    for left, top in cars_px:
        luma[top : top + 8, left : left + 16] = 250.0
    return luma


def answering(folder: Path, rows: list[list[float]], layout: Layout, **changes: object) -> OnnxDetector:
    path = weights(folder, constant_answer(np.array(rows, np.float32), SIZE_PX))
    return OnnxDetector(path, replace(SETTINGS, layout=layout, **changes), SIZE_PX)  # type: ignore[arg-type]  # a test's words


def boxes(*rows: tuple[float, float, float, float, float], angle_rad: float | None = None) -> ImageBoxes:
    table = np.array(rows, np.float64).reshape(-1, 5)
    count = len(table)
    return ImageBoxes(
        table[:, :2],
        table[:, 2:4],
        np.full(count, angle_rad or 0.0),
        np.full(count, angle_rad is not None),
        table[:, 4],
        np.zeros(count, np.intp),
    )


def test_network_finds_the_bright_cars_where_they_are(tmp_path: Path) -> None:
    detector = OnnxDetector(weights(tmp_path, blob_finder(SIZE_PX)), SETTINGS, SIZE_PX)
    found = detector.detect(make_frame(picture((20, 12), (84, 48))))
    order = np.argsort(found.centre_px[:, 0])
    assert found.centre_px[order] == pytest.approx(np.array([[27.5, 15.5], [91.5, 51.5]]), abs=4.1)
    assert found.size_px.tolist() == [[16.0, 8.0]] * 2


def test_empty_road_gives_no_box(tmp_path: Path) -> None:
    detector = OnnxDetector(weights(tmp_path, blob_finder(SIZE_PX)), SETTINGS, SIZE_PX)
    assert len(detector.detect(make_frame(picture()))) == 0


def test_letterbox_brings_boxes_back_to_the_picture(tmp_path: Path) -> None:
    half = SIZE_PX[0] // 2, SIZE_PX[1]  # as wide as half the picture and as high: grey above and below
    detector = OnnxDetector(weights(tmp_path, blob_finder(half, box_px=(8.0, 4.0))), SETTINGS, SIZE_PX)
    luma = picture()
    luma[24:48, 60:100] = 250.0
    found = detector.detect(make_frame(luma))
    assert len(found) > 0
    assert (np.abs(found.centre_px - [79.5, 35.5]) <= [20.0, 12.0]).all()
    assert found.size_px[0] == pytest.approx([16.0, 8.0])


def test_letterbox_and_back_is_identity() -> None:
    box = Letterbox.of((1280, 720), (640, 640))
    inside = boxes((319.5 * 0.5 - 0.25, 140 + 100.25, 10.0, 5.0, 0.9))
    back = box.undo(inside)
    assert back.centre_px[0] == pytest.approx([(inside.centre_px[0, 0] + 0.5) * 2 - 0.5, (100.75) * 2 - 0.5])
    assert back.size_px[0] == pytest.approx([20.0, 10.0])


def test_tiles_find_what_one_look_finds(tmp_path: Path) -> None:
    tile = 72, 72  # two tiles of 128 px with a fifth shared
    settings = replace(SETTINGS, tiles=(2, 1))
    detector = OnnxDetector(weights(tmp_path, blob_finder(tile)), settings, SIZE_PX)
    found = detector.detect(make_frame(picture((8, 12), (56, 28), (100, 48))))
    assert sorted(found.centre_px[:, 0].tolist()) == pytest.approx([15.5, 63.5, 107.5], abs=6.0)


@pytest.fixture
def batches(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many pictures networks were given, call by call."""
    sizes, computed = list[int](), Network.run

    def counting(self: Network, planes: FloatArray) -> FloatArray:
        sizes.append(len(planes))
        return computed(self, planes)

    monkeypatch.setattr(Network, "run", counting)
    return sizes


@pytest.mark.parametrize(
    ("pictures", "tables", "sizes"),
    [(0, 0, [4, 2]), (6, 6, [6]), (1, 1, [1] * 6), (0, 1, [1] * 6)],
    ids=["any number", "as many as tiles", "one", "one, though any is said"],
)
def test_tiles_are_one_batch_where_the_network_takes_it(
    tmp_path: Path, batches: list[int], pictures: int, tables: int, sizes: list[int]
) -> None:
    settings = replace(SETTINGS, tiles=(3, 2), max_batch=4)
    frame = make_frame(picture((8, 12), (56, 28), (100, 48)))

    def found(pictures: int, tables: int) -> ImageBoxes:
        detector = OnnxDetector(
            weights(tmp_path, blob_finder((54, 40), pictures=pictures, tables=tables)), settings, SIZE_PX
        )
        batches.clear()
        return detector.detect(frame)

    one_by_one, other = found(1, 1), found(pictures, tables)
    assert batches == sizes
    assert len(other) == 3
    for column in ("centre_px", "size_px", "score", "class_number"):
        assert np.array_equal(getattr(other, column), getattr(one_by_one, column)), column


def test_batch_of_another_number_than_the_tiles_is_refused(tmp_path: Path) -> None:
    path = weights(tmp_path, blob_finder((54, 72), pictures=4))
    with pytest.raises(VisionError, match=r"expected an input of \(1 or 3, 3, height, width\) for .*, got \(4, 3, 72"):
        OnnxDetector(path, replace(SETTINGS, tiles=(3, 1)), SIZE_PX)


def test_network_that_answers_a_batch_with_one_table_is_refused(tmp_path: Path) -> None:
    nodes = [node("ReduceMean", ["images"], "out", axes=[0, 1], keepdims=0)]
    data = model(nodes, {}, image=[2, 3, 72, 72], outputs={"out": [72, 72]})
    with pytest.raises(VisionError, match=r"network output: expected 2 tables for as many tiles, got \(72, 72\)"):
        OnnxDetector(weights(tmp_path, data), replace(SETTINGS, tiles=(2, 1)), SIZE_PX)


@pytest.mark.parametrize("tiles", [(1, 1), (2, 1)])
def test_part_of_the_picture_is_looked_at_alone(tmp_path: Path, tiles: tuple[int, int]) -> None:
    """What lies in the part is found where it is in the picture, up to its border; what lies beside it is not."""
    part_px = 30, 20, 72, 40
    input_px = (72 if tiles == (1, 1) else 40), 40
    path = weights(tmp_path, blob_finder(input_px))
    detector = OnnxDetector(path, replace(SETTINGS, tiles=tiles), SIZE_PX, part_px)
    corners = [(4, 4), (30, 20), (86, 20), (58, 52), (108, 60)]  # the first and the last lie outside
    found = detector.detect(make_frame(picture(*corners)))
    order = np.argsort(found.centre_px[:, 0])
    expected = np.array([[37.5, 23.5], [65.5, 55.5], [93.5, 23.5]])
    assert found.centre_px[order] == pytest.approx(expected, abs=4.1)


def far_rows(height_px: int) -> CloserLook:
    """The upper rows of the picture, twice as large; small is what is shorter than 30 px."""
    settings = replace(SETTINGS, closer=2.0, closer_below_px=30.0)
    return CloserLook.at((0, 0, SIZE_PX[0], height_px), 1.0, SIZE_PX, settings)


def test_small_vehicles_are_those_of_the_closer_look_and_the_others_of_the_plain_one() -> None:
    plain = boxes(
        (20.0, 10.0, 12.0, 6.0, 0.5),  # small and far
        (60.0, 10.0, 24.0, 9.0, 0.5),  # nearly too large for the closer look
        (90.0, 10.0, 40.0, 9.0, 0.5),
        (20.0, 60.0, 12.0, 6.0, 0.5),  # small, but near
    )
    closer = boxes(
        (22.0, 10.0, 12.0, 6.0, 0.6),
        (61.0, 10.0, 26.0, 9.0, 0.6),
        (80.0, 10.0, 31.0, 9.0, 0.6),  # too large: a part of the one that the plain look has
        (40.0, 29.0, 12.0, 6.0, 0.6),  # cut off below
        (2.0, 3.0, 12.0, 6.0, 0.6),  # cut off by the picture itself
        (100.0, 12.0, 16.0, 4.0, 0.6),  # the boot of the one that the plain look has
    )
    found = far_rows(32).joined(plain, closer)
    assert found.centre_px[:, 0].tolist() == [60.0, 90.0, 20.0, 22.0, 61.0, 2.0]


def test_closer_look_scales_the_part_as_much_as_was_asked() -> None:
    look = far_rows(20)
    assert look.letterbox.scale == 2.0
    assert look.letterbox.input_size_px == (256, 64)  # to steps of 32
    halved = CloserLook.at((0, 0, 128, 20), 0.5, SIZE_PX, replace(SETTINGS, closer=2.0, closer_below_px=30.0))
    assert (halved.letterbox.scale, halved.small_px) == (1.0, 60.0)


def test_scale_of_a_picture_is_that_of_its_tiles() -> None:
    assert picture_scale((1280, 720), (640, 640), SETTINGS) == 0.5
    assert picture_scale((1280, 720), (640, 640), replace(SETTINGS, tiles=(2, 1), overlap=0.0)) == 640 / 720
    assert picture_scale((320, 200), (640, 640), SETTINGS) == 2.0
    assert picture_scale((320, 200), (640, 640), replace(SETTINGS, enlarge=1.0)) == 1.0
    assert picture_scale((320, 200), (640, 640), replace(SETTINGS, enlarge=1.5)) == 1.5


def test_closer_look_needs_weights_of_any_size(tmp_path: Path) -> None:
    path = weights(tmp_path, blob_finder(SIZE_PX))
    with pytest.raises(VisionError, match=r"expected closer = 1 for weights that fix their input, got 2\.0"):
        OnnxDetector(path, replace(SETTINGS, closer=2.0), SIZE_PX)


@pytest.mark.parametrize("part_px", [(-1, 0, 20, 20), (0, 0, 129, 72), (100, 60, 10, 13), (0, 0, 0, 10)])
def test_part_that_is_none_of_the_picture_is_refused(tmp_path: Path, part_px: tuple[int, int, int, int]) -> None:
    path = weights(tmp_path, blob_finder(SIZE_PX))
    with pytest.raises(VisionError, match=r"expected a left, top, width, height within \(128, 72\) px, got \("):
        OnnxDetector(path, SETTINGS, SIZE_PX, part_px)


def test_planes_come_in_the_wished_order(tmp_path: Path) -> None:
    """A blue picture is bright to a network only in the plane that it takes for blue."""
    blue = make_frame(picture(), chroma=128)
    blue = replace(blue, luma=np.full((72, 128), 80, np.uint8), chroma_u=np.full((36, 64), 240, np.uint8))
    kernel = np.zeros((5, 3, 1, 1), np.float32)
    kernel[4, 0] = 1.0  # the score is the first plane
    nodes = [
        node("Conv", ["images", "kernel"], "mean", kernel_shape=[1, 1], strides=[8, 8]),
        node("Add", ["mean", "places"], "placed"),
        node("Reshape", ["placed", "shape"], "boxes"),
    ]
    places = np.zeros((1, 5, 9, 16), np.float32)
    places[0, :4] = 30.0
    given = {"kernel": kernel, "places": places, "shape": np.array([1, 5, 144], np.int64)}
    path = weights(tmp_path, model(nodes, given, image=[1, 3, 72, 128], outputs={"boxes": [1, 5, 144]}))
    counts = [
        len(OnnxDetector(path, replace(SETTINGS, colours=colours), SIZE_PX).detect(blue)) for colours in ("bgr", "rgb")
    ]
    assert counts == [1, 0]


def test_oriented_scores_layout_is_read(tmp_path: Path) -> None:
    columns = [[40.0, 90.0], [30.0, 50.0], [20.0, 20.0], [8.0, 8.0], [0.2, 0.1], [0.9, 0.3], [0.5, 0.0]]
    found = answering(tmp_path, columns, "yolo-oriented", classes={1: "bus"}).detect(make_frame(picture()))
    assert (found.centre_px.tolist(), found.angle_rad.tolist()) == ([[40.0, 30.0]], [0.5])


def test_rows_layout_is_read(tmp_path: Path) -> None:
    found = answering(tmp_path, [[10, 20, 30, 28, 0.9, 0], [50, 20, 70, 28, 0.95, 7]], "rows").detect(
        make_frame(picture())
    )
    assert found.centre_px.tolist() == [[20.0, 24.0]]


def test_oriented_rows_keep_their_angle_and_class(tmp_path: Path) -> None:
    rows = [[40.0, 30.0, 20.0, 8.0, 0.9, 3.0, 0.5]]
    found = answering(tmp_path, rows, "rows-oriented", classes={3: "bus"}).detect(make_frame(picture()))
    assert found.angle_rad == pytest.approx([0.5])
    assert CLASS_NAMES[found.class_number[0]] == "bus"
    assert found.is_oriented.all()


def test_rows_with_nan_or_beside_the_picture_are_left_out(tmp_path: Path) -> None:
    good = [10.0, 20.0, 30.0, 28.0, 0.9, 0.0]
    rows = [
        good,
        [10, 20, 30, 28, float("nan"), 0],
        [float("inf"), 20, 30, 28, 0.9, 0],
        [500, 20, 520, 28, 0.9, 0],
        [-90, -90, -70, -80, 0.9, 0],
        [60, 40, 50, 30, 0.9, 0],  # right before left
        [60, 40, 80, 48, 0.1, 0],  # too unsure
    ]
    found = answering(tmp_path, rows, "rows").detect(make_frame(picture()))
    assert found.centre_px.tolist() == [[20.0, 24.0]]


def test_weak_boxes_are_marked_and_are_no_evidence(tmp_path: Path) -> None:
    rows = [[10, 20, 30, 28, 0.9, 0], [40, 20, 60, 28, 0.4, 0], [80, 20, 100, 28, 0.2, 0]]
    found = answering(tmp_path, rows, "rows", weak_threshold=0.3).detect(make_frame(picture()))
    assert found.evidence() == pytest.approx([0.9, 0.0])
    assert found.is_weak is not None
    assert found.is_weak.tolist() == [False, True]
    # A threshold above that of all boxes changes nothing.
    found = answering(tmp_path, rows, "rows", weak_threshold=0.95).detect(make_frame(picture()))
    assert found.evidence() == pytest.approx([0.9])


def test_edges_are_as_noisy_as_the_recipe_says_for_a_score(tmp_path: Path) -> None:
    rows = [[10, 20, 30, 28, 0.9, 0], [40, 20, 60, 28, 0.85, 0]]
    found = answering(tmp_path, rows, "rows", edge_noise_share=(0.3, 0.1)).detect(make_frame(picture()))
    assert found.edge_share == pytest.approx([0.12, 0.13])


def test_network_that_gives_nothing_but_nan_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(VisionError, match=r"net.onnx: network output: expected finite numbers, got 6 that are not"):
        answering(tmp_path, [[float("nan")] * 6], "rows")


def test_ten_thousand_boxes_are_thinned(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    centre = rng.uniform([10, 10], [118, 62], (10_000, 2))
    rows = np.column_stack([centre - 4, centre + 4, rng.uniform(0.85, 1.0, 10_000), np.zeros(10_000)])
    found = answering(tmp_path, rows.tolist(), "rows").detect(make_frame(picture()))
    assert 20 < len(found) < 200
    assert found.score.min() > 0.95  # the best were looked at


def slow_suppress(found: ImageBoxes, threshold: float) -> list[int]:
    """Go through upright boxes by score; keep those that overlap no kept one."""
    bounds, kept = found.bounds_px(), list[int]()
    for row in np.argsort(-found.score, kind="stable").tolist():
        for other in kept:
            low, high = np.maximum(bounds[row, :2], bounds[other, :2]), np.minimum(bounds[row, 2:], bounds[other, 2:])
            shared = float(np.prod(np.maximum(high - low, 0.0)))
            union = float(found.size_px[row].prod() + found.size_px[other].prod()) - shared
            if shared / union > threshold:
                break
        else:
            kept.append(row)
    return kept


@pytest.mark.parametrize("seed", range(5))
def test_suppression_agrees_with_a_slow_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = np.column_stack([rng.uniform(0, 60, (80, 2)), rng.uniform(5, 20, (80, 2)), rng.permutation(80) / 80])
    found = boxes(*map(tuple, rows.tolist()))
    kept = suppress(found, replace(SETTINGS, nms_threshold=0.4))
    assert kept.score.tolist() == found.score[slow_suppress(found, 0.4)].tolist()


def test_crossed_boxes_are_two_vehicles_and_equal_ones_are_one() -> None:
    one, same = (50.0, 50.0, 40.0, 8.0, 0.9), (51.0, 50.0, 40.0, 8.0, 0.8)
    pair = boxes(one, same, angle_rad=0.7)
    crossed = replace(pair, angle_rad=np.array([0.7, 0.7 + np.pi / 2]))
    assert [len(suppress(one, replace(SETTINGS, nms_threshold=0.5))) for one in (pair, crossed)] == [1, 2]


def test_no_more_candidates_than_the_limit_are_compared() -> None:
    count = SETTINGS.max_candidates + 500
    apart = np.column_stack([np.arange(count) * 10.0, np.zeros(count), np.full((count, 2), 5.0), np.ones(count)])
    assert len(suppress(boxes(*map(tuple, apart.tolist())), SETTINGS)) == SETTINGS.max_candidates


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", r"expected an ONNX file that ONNX Runtime can compute, got No graph was found"),
        (b"these are no weights", r"expected an ONNX file that .*, got Failed to load model"),
        (blob_finder(SIZE_PX)[:-40], r"expected an ONNX file that .*, got Failed to load model"),
        (
            model([node("NoSuchThing", ["images"], "out")], {}, image=[1, 3, 72, 128], outputs={"out": [1]}, opset=77),
            r"expected an ONNX file that .* can compute, got .*is till opset \d+",
        ),
        (
            model([node("NoSuchThing", ["images"], "out")], {}, image=[1, 3, 72, 128], outputs={"out": [1]}),
            r"expected an ONNX file that .* can compute, got .*NoSuchThing",
        ),
        (
            model([node("Relu", ["other"], "out")], {}, image=[1, 3, 72, 128], outputs={"out": [1]}),
            r"expected an ONNX file that .* can compute, got .*other",
        ),
    ],
    ids=["empty", "other file", "cut off", "later operator set", "unknown operator", "unknown input"],
)
def test_broken_weights_are_refused(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(VisionError, match=rf"net.onnx: {message}"):
        OnnxDetector(weights(tmp_path, data), SETTINGS, SIZE_PX)


def test_missing_weights_are_refused(tmp_path: Path) -> None:
    with pytest.raises(VisionError, match=r"none.onnx: expected readable weights, got No such file"):
        OnnxDetector(tmp_path / "none.onnx", SETTINGS, SIZE_PX)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"layout": "rows"}, r"network output: expected \(n, 6\) for layout 'rows', got \(1, 5, \d+\)"),
        ({"classes": {4: "car"}}, r"network output: expected \(at least 9, n\) for layout 'yolo' with class 4"),
        ({"input_size_px": (64, 64)}, r"expected input_size_px = \[128, 72\] as in the weights, got \(64, 64\)"),
        ({"colours": "grey"}, r"expected an input of \(1, 1, height, width\) for colours = 'grey', got \(1, 3, 72"),
        ({"output": "heat"}, r"net.onnx: expected an output named 'heat', got boxes"),
    ],
    ids=["layout", "class", "input size", "colours", "output"],
)
def test_settings_that_do_not_go_with_the_weights_are_refused(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    path = weights(tmp_path, blob_finder(SIZE_PX))
    with pytest.raises(VisionError, match=message):
        OnnxDetector(path, replace(SETTINGS, **changes), SIZE_PX)  # type: ignore[arg-type]  # wrong on purpose


def test_weights_of_any_size_need_one(tmp_path: Path) -> None:
    data = model([node("Relu", ["images"], "out")], {}, image=[1, 3, 0, 0], outputs={"out": [1]})
    with pytest.raises(VisionError, match=r"expected input_size_px for weights that take any size, got none"):
        OnnxDetector(weights(tmp_path, data), SETTINGS, SIZE_PX)


def test_frame_of_another_size_is_refused(tmp_path: Path) -> None:
    detector = OnnxDetector(weights(tmp_path, blob_finder(SIZE_PX)), SETTINGS, SIZE_PX)
    with pytest.raises(VisionError, match=r"frame 0: expected \(128, 72\) px, got \(64, 36\)"):
        detector.detect(make_frame(picture(size_px=(64, 36))))


def test_runtime_is_named_with_its_version(tmp_path: Path) -> None:
    detector = OnnxDetector(weights(tmp_path, blob_finder(SIZE_PX)), SETTINGS, SIZE_PX)
    assert detector.runtime == f"ONNX Runtime {onnxruntime.__version__}, cpu"
    assert detector.warnings == ()


def test_provider_that_is_not_here_is_passed_over_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: ["CPUExecutionProvider"])
    path = weights(tmp_path, blob_finder(SIZE_PX))
    detector = OnnxDetector(path, replace(SETTINGS, providers=("cuda", "openvino", "cpu")), SIZE_PX)
    version = f"ONNX Runtime {onnxruntime.__version__}"
    assert detector.runtime == f"{version}, cpu"
    assert detector.warnings == (f"net.onnx: {version} lacks cuda, openvino here: cpu computes",)
    message = (
        r"net.onnx: expected one of the providers that .* has here \(cpu\); add \"cpu\" to providers, got cuda, openv"
    )
    with pytest.raises(VisionError, match=message):
        OnnxDetector(path, replace(SETTINGS, providers=("cuda", "openvino")), SIZE_PX)


def test_provider_whose_library_is_missing_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """CUDA is announced wherever its package is installed; without a graphics card the session goes on without it."""
    there = ["CUDAExecutionProvider", "CPUExecutionProvider"]
    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: there)
    opened, asked = onnxruntime.InferenceSession, list[list[str]]()

    def open_without(data: bytes, options: object, providers: list[str], **rest: object) -> object:
        asked.append(providers)
        return opened(data, options, ["CPUExecutionProvider"], **rest)

    monkeypatch.setattr(onnxruntime, "InferenceSession", open_without)
    path = weights(tmp_path, blob_finder(SIZE_PX))
    detector = OnnxDetector(path, replace(SETTINGS, providers=("cuda", "cpu")), SIZE_PX)
    assert asked == [["CUDAExecutionProvider"], ["CPUExecutionProvider"]]
    assert (detector.runtime.split()[-1], len(detector.warnings)) == ("cpu", 1)


def test_number_of_threads_changes_nothing_that_is_found(tmp_path: Path) -> None:
    path, frame = weights(tmp_path, blob_finder(SIZE_PX)), make_frame(picture((20, 12), (84, 48)))
    one, two = (OnnxDetector(path, replace(SETTINGS, threads=count), SIZE_PX).detect(frame) for count in (1, 2))
    assert one.centre_px.tolist() == two.centre_px.tolist()
    assert len(one) == 2


@for_each("seed", range(200))
def test_damaged_weights_are_refused_or_looked_at(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = bytearray(blob_finder((16, 16)))
    for place in rng.integers(0, len(data), 3):
        data[place] = int(rng.integers(0, 256))
    cut = bytes(data[: int(rng.integers(len(data) // 2, len(data) + 1))])
    with contextlib.suppress(VisionError):
        OnnxDetector(weights(tmp_path, cut), SETTINGS, (16, 16))
