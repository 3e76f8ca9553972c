"""How good is a set of weights? `python -m training.score above.onnx FOLDER [--still FOLDER] [--draw PICTURE ...]`.

FOLDER holds worlds of seeds 1 to 5; the threshold is chosen on them, and the still of real traffic is only told.
"""

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
import shapely
from numpy.typing import NDArray
from scipy.optimize import minimize

from training.centre_net import DEEPEST
from training.crops import LEAST_SHOWN, LOOKS
from training.worlds import CLASSES
from vision.networks.box_detector import ImageBoxes
from vision.networks.onnx.detector import suppress
from vision.networks.onnx.output import decode
from vision.networks.onnx.settings import OnnxSettings

SHIPPED = 0.4
"""The score that both recipes take for evidence."""
THRESHOLDS = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6)
LEAST_IOU = 0.4
WRONG, SPARED = -1, -2
"""Instead of a row of the truth: found where nothing is, or where nothing is asked for."""
STILL_SCALE = 0.09 / 0.2
"""The still has 0.09 m a pixel, and the weights from above are meant for 0.2."""
STILL_ROADS = ((0, 0.47, 1, 0.58), (0.49, 0, 0.57, 0.58))
"""Left, top, right, bottom as shares: the street and the bridge. The rest of the boxes are those of parked cars."""


class Scored:
    """Weights, one thread of the processor, and the time that looks took.

    Parameters
    ----------
    path : of the ONNX file; "above" in its name means oriented boxes.
    """

    def __init__(self, path: Path) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self._session = onnxruntime.InferenceSession(str(path), options)
        self.kind = "above" if self._session.get_outputs()[0].shape[1] == 7 else "low"
        layout = "rows-oriented" if self.kind == "above" else "rows"
        classes = dict(enumerate(CLASSES))
        self._settings = OnnxSettings(layout, classes, score_threshold=THRESHOLDS[0], nms_threshold=0.4)

    def look(self, picture: NDArray[np.uint8]) -> ImageBoxes:
        """Find vehicles in a picture (h, w, 3), blue first."""
        padding = [(0, -size % DEEPEST) for size in picture.shape[:2]]
        planes = np.pad(picture, [*padding, (0, 0)], constant_values=114)[:, :, ::-1].transpose(2, 0, 1)[None]
        [rows] = self._session.run(None, {"pictures": planes.astype(np.float32) / np.float32(255)})
        settings = self._settings
        return suppress(decode(rows, settings.layout, settings.classes, settings.score_threshold), settings)

    def milliseconds(self) -> tuple[float, float]:
        """Measure processor time: half a 720p picture, and a product of two matrices of 1,024 rows (1.07 GMAC)."""
        picture, planes = np.zeros((352, 1280, 3), np.uint8), np.ones((1024, 1024), np.float32)

        def once(is_look: bool) -> float:
            start = time.process_time()
            _ = self.look(picture) if is_look else planes @ planes
            return 1000 * (time.process_time() - start)

        return min(once(True) for _ in range(20)), min(once(False) for _ in range(20))


def outlines(boxes: NDArray[np.float64]) -> NDArray[np.object_]:
    """Give boxes as polygons: rows of x, y, length, width, angle."""
    corners = [cv2.boxPoints(((x, y), (length, width), math.degrees(angle))) for x, y, length, width, angle in boxes]
    return np.array([shapely.Polygon(one) for one in corners], object)


def shapes_of(found: ImageBoxes) -> NDArray[np.object_]:
    """Give what was found as polygons."""
    return outlines(np.column_stack([found.centre_px, found.size_px, found.angle_rad]))


def judged(found: ImageBoxes, truth: NDArray[np.object_], is_asked: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Match what was found, the best first, with a truth each.

    Parameters
    ----------
    found : by score, the best first.
    truth : polygons.
    is_asked : (n,) of the truth; what is found on the others is neither right nor wrong.

    Returns
    -------
    Rows of the truth, (k,), or `WRONG` or `SPARED`.
    """
    free, rows = is_asked.copy(), np.full(len(found), WRONG)
    for nth, shape in enumerate(shapes_of(found)):
        shared = shapely.area(shapely.intersection(truth, shape))
        overlap = shared / (shapely.area(truth) + shape.area - shared) if len(truth) else np.zeros(0)
        if (free & (overlap >= LEAST_IOU)).any():
            rows[nth] = np.argmax(free * overlap)
            free[rows[nth]] = False
        elif (~is_asked & (shared > 0.4 * shape.area)).any():
            rows[nth] = SPARED
    return rows


def edge_errors(found: ImageBoxes, truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Say how far off the ends of boxes are along the axes of their truths, (n, 5 or more), in parts of the sizes.

    Returns
    -------
    (n, 4).
    """
    ahead = np.column_stack([np.cos(truth[:, 4]), np.sin(truth[:, 4])])
    away = found.centre_px - truth[:, :2]
    along, across = (away * ahead).sum(axis=1), away[:, 1] * ahead[:, 0] - away[:, 0] * ahead[:, 1]
    moved, grown = np.column_stack([along, across]), (found.size_px - truth[:, 2:4]) / 2
    return np.hstack([moved + grown, moved - grown]) / np.hstack([truth[:, 2:4]] * 2)


def edge_noise(scores: NDArray[np.float64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit how far edges, (n, 4), are off at score 0 and at 1: the scales of Student's t with four degrees of freedom.

    Boxes half beside a vehicle are rare and far off. Whoever took them for usual would believe no other box.
    """

    def unlikely(ends: NDArray[np.float64]) -> float:
        deviation = np.maximum(np.interp(scores, (0.0, 1.0), ends), 1e-3)[:, None]
        return float((np.log(deviation) + 2.5 * np.log1p((errors / deviation) ** 2 / 4)).mean())

    return np.asarray(minimize(unlikely, (0.1, 0.1), method="Nelder-Mead").x)


def still(folder: Path) -> tuple[NDArray[np.uint8], NDArray[np.object_], NDArray[np.bool_]]:
    """Load the real still, its boxes as polygons, and which of them are on the road."""
    whole = cv2.imread(str(folder / "drone_still_4k.jpg"))
    picture = cv2.resize(whole, None, fx=STILL_SCALE, fy=STILL_SCALE, interpolation=cv2.INTER_AREA)
    corners = np.loadtxt(folder / "drone_still_4k_boxes.txt")[:, 1:].reshape(-1, 4, 2)
    roads = shapely.union_all([shapely.box(*road) for road in STILL_ROADS])
    is_road = shapely.contains_xy(roads, *corners.mean(axis=1).T)
    return picture, np.array([shapely.Polygon(one * picture.shape[1::-1]) for one in corners], object), is_road


def table(title: str, scores: NDArray[np.float64], rows: NDArray[np.intp], asked: int) -> float:
    """Print precision and recall at each threshold; return the one with the best harmonic mean."""
    best, hits, misses = (0.0, THRESHOLDS[0]), scores[rows >= 0], scores[rows == WRONG]
    print(f"{title}: {asked} vehicles")
    for threshold in THRESHOLDS:
        hit, miss = int((hits >= threshold).sum()), int((misses >= threshold).sum())
        precision, recall = hit / max(1, hit + miss), hit / asked
        best = max(best, (2 * precision * recall / max(1e-9, precision + recall), threshold))
        print(f"  score >= {threshold:.2f}: precision {precision:.3f}, recall {recall:.3f}")
    return best[1]


def score(weights: Path, worlds: Path, *, still_folder: Path | None = None, drawn: Sequence[Path] = ()) -> None:
    """Print scores on rendered worlds and, if there is one, the real still; draw what is found into pictures."""
    network = Scored(weights)
    frames, boxes = np.load(worlds / "frames.npy", mmap_mode="r"), np.load(worlds / "boxes.npz")
    scores, rows, errors, kinds, seen_kinds = [], [], [], [], []
    for nth, frame in enumerate(frames):
        truth = boxes[str(nth)]
        is_asked = (truth[:, 6] >= LEAST_SHOWN) & (truth[:, 2:4].min(axis=1) >= LOOKS[network.kind].least_px)
        found = network.look(frame)
        row = judged(found, outlines(truth[:, :5]), is_asked)
        scores.append(found.score)
        rows.append(row)
        errors.append(edge_errors(found.select(row >= 0), truth[row[row >= 0]]))
        kinds += truth[is_asked, 5].tolist()
        seen_kinds += truth[row[(row >= 0) & (found.score >= SHIPPED)], 5].tolist()
    score_of, row_of = np.concatenate(scores), np.concatenate(rows)
    threshold = table("synthetic, seeds 1 to 5", score_of, row_of, len(kinds))
    counts = (f"{seen_kinds.count(number)} of {kinds.count(number)} {name}" for number, name in enumerate(CLASSES))
    print(f"found at {SHIPPED:.2f}: {', '.join(counts)}")
    print("edge_noise_share = [{:.2f}, {:.2f}]".format(*edge_noise(score_of[row_of >= 0], np.concatenate(errors))))
    look_ms, product_ms = network.milliseconds()
    print(f"best at {threshold:.2f}; half a 720p picture {look_ms:.0f} ms, a product of matrices {product_ms:.0f} ms")
    if still_folder is not None:
        _score_still(network, still_folder)
    for path in drawn:
        draw(network, path, threshold)


def _score_still(network: Scored, folder: Path) -> None:
    picture, shapes, is_road = still(folder)
    found = network.look(picture)
    table("real still, all", found.score, judged(found, shapes, np.ones(len(shapes), np.bool_)), len(shapes))
    roads = shapely.union_all([shapely.box(*(np.tile(picture.shape[1::-1], 2) * road)) for road in STILL_ROADS])
    on_road = found.select(shapely.contains_xy(roads, *found.centre_px.T))
    table("real still, on the road", on_road.score, judged(on_road, shapes, is_road), int(is_road.sum()))


def draw(network: Scored, path: Path, threshold: float) -> None:
    """Draw what is found into a copy of a picture beside it."""
    picture = cv2.imread(str(path))
    found = network.look(picture)
    for shape in shapes_of(found.select(found.score >= threshold)):
        corners = np.array(shape.exterior.coords).round().astype(np.int32)
        cv2.polylines(picture, [corners], True, (0, 0, 255), 1)
    cv2.imwrite(str(path.with_suffix(f".{network.kind}.png")), picture)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("worlds", type=Path)
    parser.add_argument("--still", type=Path)
    parser.add_argument("--draw", type=Path, nargs="*", default=[])
    given = parser.parse_args()
    score(given.weights, given.worlds, still_folder=given.still, drawn=given.draw)
