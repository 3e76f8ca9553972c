"""What does the road look like without vehicles? A background that is learned causally and kept up to date.

Start-up holds some seconds of rectified frames and reads the bare road off a spread sample (`startup.py`): results come
late by a constant time, but no second pass over the video is needed.
As long as something like a standing vehicle is left in it, more frames are held.
Later the background learns slowly where nothing is seen, is frozen under tracked objects, and heals: a patch that
keeps differing while no object claims it is taken over from the present picture. Brightness of the whole scene is
followed by one gain per frame, so that the background itself can stay in the light of the start-up.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.background.standing import StandingVehicles
from vision.background.startup import BLACK_LEVEL, FirstSight, first_sight, noise_of, plain_sight
from vision.objects import BoolArray
from vision.road.boxes import Boxes
from vision.road.rectify import RoadCells, RoadImage, Window
from vision.road.road_colour import RoadColour
from vision.settings import VisionSettings
from vision.video.frames import ByteArray

# Cells on which the gain is measured.
GAIN_CELLS = 2_000
# Differences are handed on as multiples of a cell's threshold, this being 1.
AT_THRESHOLD = 20
NO_COLOUR = 128.0


class Background:
    """The road without vehicles, as packed planes.

    Life: `hold` frames until it is ready, then per frame `compare`, and `learn` after the objects are known.

    Parameters
    ----------
    raster : the cells.
    settings : constants.
    car_cells : width of a car in cells, about.
    finds_standing : look for vehicles that stand all the time during the start-up, and prolong it for them.
    borders : (rows, columns) cells on the borders of lanes; None if not known.

    Attributes
    ----------
    is_ready : whether the start-up is over.
    is_overwhelmed : whether the frame last compared differs so much that nothing can be read off it.
    """

    def __init__(
        self,
        raster: RoadCells,
        settings: VisionSettings,
        *,
        car_cells: float,
        finds_standing: bool = True,
        borders: BoolArray | None = None,
    ) -> None:
        self._raster = raster
        self._settings = settings.background
        self._colour = RoadColour(raster, settings.road, car_cells=car_cells)
        self._standing: StandingVehicles | None = None
        if finds_standing:
            margin_cells = round(settings.road_margin_m / raster.grid.side) + 1
            self._standing = StandingVehicles(self._colour, self._settings, margin_cells=margin_cells, borders=borders)
        self._startup_us = self._settings.startup_us
        self._held: list[RoadImage] = []
        # Pictures in which it is known where vehicles are, and the cells that these cover.
        self._looks: list[tuple[RoadImage, BoolArray]] = []
        self._max_held = max(2, self._settings.startup_bytes // (3 * raster.packed_size))
        self._planes = np.zeros((3, raster.packed_size), np.float32)
        self._shown = np.zeros((3, raster.packed_size), np.uint8)
        self._sensitivity = np.zeros((1, raster.packed_size), np.float32)
        # The cells that can be compared now, and those that may learn now: a moving camera changes both.
        self._road = self._colour.road
        self._is_seen = np.ones(raster.packed_size, np.bool_)
        road_cells = np.flatnonzero(self._road)
        self._gain_cells = road_cells[:: max(1, len(road_cells) // GAIN_CELLS)]
        self._gain = 1.0
        self._unclaimed_us = np.zeros(raster.packed_size, np.int32)
        self._learned_us: int | None = None
        self._lost_since_us: int | None = None
        self.is_ready = False
        self.is_overwhelmed = False

    def hold(self, image: RoadImage, covered: Boxes | None = None) -> bool:
        """Take a frame of the start-up.

        Parameters
        ----------
        image : the next frame.
        covered : where vehicles cover the raster's plane; None where nobody has looked.

        Returns
        -------
        Whether the background exists now.
        """
        self._held.append(image)
        if covered is not None:
            self._looks.append((image, self._covered(covered, 2 * self._raster.grid.side)))
        held_us = image.t_us - self._held[0].t_us
        is_full = len(self._held) >= self._max_held or held_us >= self._settings.startup_most_us
        if held_us >= self._startup_us or is_full:
            self._end_startup(is_full=is_full)
        return self.is_ready

    def start(self) -> None:
        """End the start-up with what is held; without any frame there is no background."""
        if self._held:
            self._end_startup(is_full=True)

    def _end_startup(self, *, is_full: bool) -> None:
        """Make the first background, unless a vehicle seems to stand all the time and more frames can be held."""
        sight, is_vehicle = self._first_sight()
        if is_vehicle.any() and not is_full and not self._looks:
            self._startup_us *= 2
            return
        self._planes[...] = sight.planes
        if is_vehicle.any():
            # Under vehicles that stand there all the time, the road is what it is around.
            self._planes[:, is_vehicle] = self._colour.around(sight.planes)[:, is_vehicle]
        self._show()
        self._set_sensitivity(sight, is_vehicle)
        self._learned_us = self._held[0].t_us
        self._held, self._looks = [], []
        self.is_ready = True

    def _first_sight(self) -> tuple[FirstSight, BoolArray]:
        """Read the road off what is held, and tell which cells were hidden by vehicles all the time, (packed_size,)."""
        if self._looks:
            is_bare = np.stack([~is_covered for _, is_covered in self._looks])
            sight = plain_sight([image.planes for image, _ in self._looks], is_bare)
            return sight, self._road & (is_bare.mean(axis=0) < self._settings.least_bare_share)
        samples = [image.planes for image in self._samples()]
        if self._standing is None:
            return plain_sight(samples), np.zeros_like(self._road)
        # Vehicles are looked for only where they keep their size: elsewhere no place is calm for a car's width either.
        sight = first_sight(samples, self._colour, self._settings)
        return sight, self._standing.find(sight)

    def _samples(self) -> list[RoadImage]:
        last = len(self._held) - 1
        places = np.linspace(0, last, min(last + 1, self._settings.startup_samples)).round().astype(np.intp)
        return [self._held[i] for i in np.unique(places)]

    def compare(self, image: RoadImage) -> ByteArray:
        """Measure how much every cell differs from the background, for what is usual there.

        Parameters
        ----------
        image : the present frame.

        Returns
        -------
        (packed_size,) difference as a multiple of the cell's threshold, in units of 1 / `AT_THRESHOLD`; 0 off the road.
        """
        self._follow_light(image.planes[0])
        offset = BLACK_LEVEL * (1.0 - self._gain)
        self._shown[:1] = cv2.convertScaleAbs(self._planes[:1], alpha=self._gain, beta=offset)
        difference = self._difference(image.planes)
        return np.asarray(cv2.multiply(difference, self._sensitivity, dtype=cv2.CV_8U), np.uint8).ravel()

    def _difference(self, planes: ByteArray) -> ByteArray:
        """Compare with the shown background: (1, packed_size) grey levels, the largest over the weighted planes."""
        difference = cv2.absdiff(planes, self._shown)
        chroma = cv2.max(difference[1:2], difference[2:3])
        weighted = cv2.convertScaleAbs(chroma, alpha=self._settings.chroma_weight)
        return np.asarray(cv2.max(difference[:1], weighted), np.uint8)

    def _set_sensitivity(self, sight: FirstSight, is_vehicle: BoolArray) -> None:
        """Learn each cell's noise: leaves, compression and shaking edges differ more than bare road does."""
        differences = [self._difference(planes) for planes in sight.samples]
        noise = noise_of(differences, sight.is_calm, self._settings.most_noise_levels)
        if is_vehicle.any():
            # The road under a vehicle that stands there all the time was never seen: it is taken for a usual one.
            noise[:, is_vehicle] = np.median(noise[:, self._road])
        threshold = self._threshold(noise)
        self._sensitivity[...] = np.where(self._road, AT_THRESHOLD / threshold, 0.0)

    def _threshold(self, noise: NDArray[np.float32]) -> NDArray[np.float32]:
        least, most = self._settings.least_difference_levels, self._settings.most_difference_levels
        return np.asarray(np.clip(least + self._settings.noise_factor * (noise - 1.0), least, most), np.float32)

    def shaded(self, image: RoadImage, points: NDArray[np.float64]) -> ByteArray:
        """Find cells that look like the known road with less light on it.

        Parameters
        ----------
        image : the frame last compared.
        points : (n, 2) centres of road cells.

        Returns
        -------
        (n,) how many per cent of the light are left, where that is plausible for a shadow and the colour is
        the same; else 0.
        """
        places = self._raster.places(points)
        shown, present = (planes.take(places, axis=1).astype(np.float32) for planes in (self._shown, image.planes))
        lit, seen = shown[0] - np.float32(BLACK_LEVEL), present[0] - np.float32(BLACK_LEVEL)
        light = seen / np.maximum(lit, 1.0)
        # Less light takes colour away in proportion, seen best on grass.
        colour = shown[1:] - NO_COLOUR
        difference = np.abs(present[1:] - NO_COLOUR - light * colour).max(axis=0)
        is_darker = (light > self._settings.shade_deepest) & (light < self._settings.shade_lightest)
        is_shade = is_darker & (difference <= self._settings.shade_chroma_levels)
        return np.asarray(np.where(is_shade, 100 * light, 0.0), np.uint8)

    def is_due(self, t_us: int) -> bool:
        """Tell whether it is time to learn; until then `learn` does nothing."""
        return self._learned_us is not None and t_us - self._learned_us >= self._settings.period_us

    def learn(self, image: RoadImage, foreground: ByteArray, objects: Boxes, is_real: BoolArray) -> None:
        """Bring the background up to date, every `period_us`.

        Parameters
        ----------
        image : the present frame.
        foreground : (packed_size,) non-zero where the frame differs.
        objects : the tracked objects, as seen on the raster's plane.
        is_real : (n,) which of them are known to be objects and no ghosts; the background is frozen under these.
        """
        assert self._learned_us is not None
        if not self.is_due(image.t_us):
            return
        elapsed_us = image.t_us - self._learned_us
        self._learned_us = image.t_us
        is_foreground = foreground > 0
        is_claimed = self._covered(objects.select(is_real), self._raster.grid.side)
        present = self._in_reference_light(image.planes)
        # After a gap nothing is claimed yet: a long one must not count as time in which nobody claimed it.
        self._unclaimed_us += min(elapsed_us, self._settings.heal_us // 3)
        self._unclaimed_us[~is_foreground | is_claimed] = 0
        is_healing = self._unclaimed_us >= self._settings.heal_us
        if self._is_view_lost(image.t_us, is_foreground):
            is_healing = self._road
        self._unclaimed_us[is_healing] = 0
        is_quiet = np.asarray(self._is_seen & ~(is_foreground | is_claimed), np.uint8)[None]
        rate = min(1.0, elapsed_us / self._settings.tau_us)
        for plane, seen in zip(self._planes, present, strict=True):
            cv2.accumulateWeighted(seen[None], plane[None], rate, mask=is_quiet)
            plane[is_healing] = seen[is_healing]
        self._show()

    def heal(self, image: RoadImage, boxes: Boxes) -> None:
        """Take over the present picture under some boxes: they hold ghosts.

        Parameters
        ----------
        image : the present frame.
        boxes : where, on the raster's plane.
        """
        where = self._covered(boxes, 2 * self._raster.grid.side) & self._is_seen
        self._planes[:, where] = self._in_reference_light(image.planes)[:, where]
        self._show()

    def judge(self, image: RoadImage, boxes: Boxes) -> NDArray[np.int8]:
        """Tell standing objects from ghosts: whose outline is it, the picture's or the background's?

        Where a car that was learned as background drives away, the bare road stands out just like a parked car
        would; but then it is the picture that has the usual colour of the road, and the edges around it are in the
        background and not in the picture.

        Parameters
        ----------
        image : the present frame.
        boxes : of unmoved objects, on the raster's plane.

        Returns
        -------
        (n,) 1 object, -1 ghost, 0 undecided.
        """
        verdicts = np.zeros(len(boxes), np.int8)
        usual = self._colour.usual(self._planes)
        for i, corners in enumerate(boxes.corners()):
            window, ring, inside = self._outline(corners)
            reveals, hides = self._plain_road(image, window, usual)
            verdicts[i] = self._verdict_by_colour(reveals[inside], hides[inside])
            if verdicts[i] == 0:
                lumas = (self._raster.window(planes[0], window) for planes in (image.planes, self._shown))
                seen, known = (_edge_strength(luma, ring) for luma in lumas)
                is_object = seen > self._settings.object_ratio * known
                verdicts[i] = int(is_object) - int(known > self._settings.ghost_ratio * seen)
        return verdicts

    def _plain_road(self, image: RoadImage, window: Window, usual: NDArray[np.float32]) -> tuple[BoolArray, BoolArray]:
        """Mark cells in which only the picture has the usual colour of the road, and in which only the background has.

        In a window of the raster, since all of it would cost more than the rest of the frame.
        """
        around = self._colour.around_in(self._planes, window, usual)
        present = self._in_reference_light(self._raster.window(image.planes, window))
        learned, is_road = self._raster.window(self._planes, window), self._raster.window(self._road, window)
        is_plain, was_plain = (
            np.abs(one - around).max(axis=0) <= self._settings.strange_levels for one in (present, learned)
        )
        differs = is_road & (np.abs(present - learned).max(axis=0) > self._settings.least_difference_levels)
        return differs & is_plain & ~was_plain, differs & was_plain & ~is_plain

    def _verdict_by_colour(self, reveals: BoolArray, hides: BoolArray) -> int:
        """Say 1 for an object, -1 for a ghost, 0 for undecided, by the cells inside a box."""
        revealed, hidden = int(reveals.sum()), int(hides.sum())
        if max(revealed, hidden) < self._settings.plain_share * len(reveals):
            return 0
        ratio = self._settings.plain_ratio
        return int(hidden > ratio * revealed) - int(revealed > ratio * hidden)

    def _outline(self, corners: NDArray[np.float64]) -> tuple[Window, BoolArray, BoolArray]:
        """Mark the border and the inside of a box, in a window around it."""
        cells = np.rint(self._raster.grid.to_cells(corners)).astype(np.int32)
        rows, columns = self._raster.grid.shape
        left, top = np.clip(cells.min(axis=0) - 3, 0, [columns - 1, rows - 1])
        right, bottom = np.clip(cells.max(axis=0) + 4, 1, [columns, rows])
        ring, inside = np.zeros((2, max(bottom - top, 1), max(right - left, 1)), np.uint8)
        shape = [cells - np.array([left, top], np.int32)]
        cv2.polylines(ring, shape, True, (1,), thickness=3)
        cv2.fillPoly(inside, shape, (1,))
        window = slice(top, top + ring.shape[0]), slice(left, left + ring.shape[1])
        return window, (ring > 0) & self._raster.road[window], (inside > 0) & self._raster.road[window]

    def _covered(self, boxes: Boxes, margin: float) -> BoolArray:
        """Mark the cells under boxes and a margin around them: (packed_size,)."""
        return self._raster.pack(self._raster.grid.paint(boxes.corners(margin))) > 0

    def _follow_light(self, luma: ByteArray) -> None:
        """Measure the gain on a fixed sample of cells; a median does not mind the vehicles among them."""
        learned = self._planes[0].take(self._gain_cells) - np.float32(BLACK_LEVEL)
        seen = luma.take(self._gain_cells) - np.float32(BLACK_LEVEL)
        is_bright = learned > self._settings.gain_least_level - BLACK_LEVEL
        ratios = seen[is_bright] / learned[is_bright]
        if len(ratios) >= 10:
            middle = (len(ratios) - 1) // 2, len(ratios) // 2
            ratios.partition(middle)
            least = self._settings.least_gain
            self._gain = min(max(float(ratios.take(middle).mean()), least), 1 / least)

    def _in_reference_light(self, planes: ByteArray) -> NDArray[np.float32]:
        present = planes.astype(np.float32)
        present[0] = (present[0] - np.float32(BLACK_LEVEL)) / np.float32(self._gain) + np.float32(BLACK_LEVEL)
        return present

    def _is_view_lost(self, t_us: int, is_foreground: BoolArray) -> bool:
        """Notice when most of the road keeps differing: the camera moved, or the light jumped unevenly."""
        road_cells = int(np.count_nonzero(self._road))
        if np.count_nonzero(is_foreground & self._road) <= self._settings.lost_fraction * road_cells:
            self._lost_since_us = None
            return False
        if self._lost_since_us is None:
            self._lost_since_us = t_us
        return t_us - self._lost_since_us >= self._settings.lost_us

    def _show(self) -> None:
        np.rint(self._planes, out=self._shown, casting="unsafe")


def _edge_strength(luma: ByteArray, ring: BoolArray) -> float:
    if not ring.any():
        return 0.0
    horizontal = cv2.Sobel(luma, cv2.CV_32F, 1, 0, borderType=cv2.BORDER_REPLICATE)
    vertical = cv2.Sobel(luma, cv2.CV_32F, 0, 1, borderType=cv2.BORDER_REPLICATE)
    return float(np.mean(np.hypot(horizontal, vertical)[ring]))
