"""What does the road look like without vehicles, where a moving camera has been? A background that grows with the view.

Cells of ground come into view and leave it. Each one collects a few samples, spread over some seconds, and is *unknown*
until it has enough: an unknown cell is no road yet, so nothing is found there and nothing false either. The median of
the samples is then its background, and their spread its noise, as for a fixed camera. What is left of the camera's
motion after registration, a part of a cell, moves the edges of markings: a cell whose neighbours look different from
it needs a larger difference.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.background.background import AT_THRESHOLD, GAIN_CELLS, Background
from vision.objects import BoolArray
from vision.registration.moving_raster import MovingRaster
from vision.road.boxes import Boxes
from vision.road.rectify import RoadImage
from vision.settings import VisionSettings
from vision.video.frames import ByteArray

# At the end of the start-up so many held frames are read at a time, and always so many cells become known at a time:
# to do it all at once would keep a frame waiting. But frames are held meanwhile, so it takes no more slices than these.
READ_FRAMES, SETTLED_CELLS, MOST_SLICES = 4, 2_000, 50
FILL = 255


class MosaicBackground(Background):
    """The background under a moving camera.

    Parameters
    ----------
    raster : of ground; told which cells are known.
    settings : as for a fixed camera.
    """

    def __init__(self, raster: MovingRaster, settings: VisionSettings) -> None:
        car_cells = settings.car_width_m / raster.grid.side
        super().__init__(raster, settings, car_cells=car_cells, finds_standing=False)
        self._moving = raster
        self._mosaic = settings.registration
        self._is_road = self._road
        self._is_known = np.zeros(raster.packed_size, np.bool_)
        self._count = np.zeros(raster.packed_size, np.int16)
        most_samples = max(self._settings.startup_samples, self._mosaic.later_samples)
        self._collected = np.zeros((most_samples, 3, raster.packed_size), np.uint8)
        self._base_threshold = np.full(raster.packed_size, self._settings.most_difference_levels, np.float32)
        self._held_until_us = 0
        self._unread: list[RoadImage] = []
        self._least = 0  # samples of a cell that are enough; 0 before the held frames have been read

    def start(self) -> None:
        """End the start-up with what is held; without any frame there is no background."""
        while self._held:
            self._end_startup(is_full=True)

    def _end_startup(self, *, is_full: bool) -> None:
        """Read some of the held frames, then settle some of the cells, with every frame; more are held meanwhile."""
        if self._least == 0:
            self._unread = self._samples()
            self._least = min(self._mosaic.startup_samples, len(self._unread))
            self._learned_us, self._held_until_us = self._held[0].t_us, self._held[-1].t_us
        read, self._unread = self._unread[:READ_FRAMES], self._unread[READ_FRAMES:]
        for image in read:
            self._look(image)
            self._collect(image.planes, self._is_seen)
        self.is_ready = not read and not self._settle(self._least)
        if self.is_ready:
            self._held, self._least = [], self._mosaic.later_samples

    def compare(self, image: RoadImage) -> ByteArray:
        """Measure how much every known cell in view differs; see `Background.compare`.

        Parameters
        ----------
        image : the present frame.

        Returns
        -------
        (packed_size,) as for a fixed camera; 0 where nothing is known or seen.
        """
        self._is_seen = self._moving.is_seen
        self._road = self._is_known & self._is_seen
        cells = np.flatnonzero(self._road)
        self._gain_cells = cells[:: max(1, len(cells) // GAIN_CELLS)]
        packed = super().compare(image)
        packed[~self._is_seen] = 0
        share = np.count_nonzero(packed > AT_THRESHOLD) / max(len(cells), 1)
        self.is_overwhelmed = bool(share > self._settings.lost_fraction)
        return packed

    def learn(self, image: RoadImage, foreground: ByteArray, objects: Boxes, is_real: BoolArray) -> None:
        """Bring the background up to date, and collect samples of cells that are new; see `Background.learn`.

        Parameters
        ----------
        image, foreground, objects, is_real : as for a fixed camera.
        """
        before_us = self._learned_us
        super().learn(image, foreground, objects, is_real)
        if self._learned_us == before_us or image.t_us <= self._held_until_us:
            return
        is_new = self._is_seen & ~self._is_known & self._is_road & (self._count < self._least)
        if is_new.any():
            is_new &= ~self._covered(objects, 2 * self._moving.grid.side)
            self._collect(np.clip(np.rint(self._in_reference_light(image.planes)), 0, 255).astype(np.uint8), is_new)
        self._settle(self._least)

    def _look(self, image: RoadImage) -> None:
        assert image.pixel_from_ground is not None
        self._moving.look(image.pixel_from_ground)
        self._is_seen = self._moving.is_seen & self._is_road

    def _collect(self, planes: ByteArray, where: BoolArray) -> None:
        cells = np.flatnonzero(where & (self._count < len(self._collected)))
        self._collected[self._count[cells], :, cells] = planes[:, cells].T
        self._count[cells] += 1

    def _settle(self, least: int) -> bool:
        """Make known what has enough samples, a slice of it at a time; tell whether there is more."""
        ready = np.flatnonzero(~self._is_known & (self._count >= least))
        cells = ready[: max(SETTLED_CELLS, len(self._count) // MOST_SLICES)]
        if len(cells) == 0:
            return False
        count = self._count[cells]
        samples = self._collected[: int(count.max()), :, cells]
        is_empty = np.arange(samples.shape[0])[:, None] >= count
        median = _middle(samples, is_empty, count)
        difference = np.abs(samples.astype(np.int16) - median)
        chroma = np.minimum(difference[:, 1:].max(axis=1) * self._settings.chroma_weight, FILL)
        noise = _middle(np.maximum(difference[:, 0], chroma).astype(np.uint8)[:, None], is_empty, count)
        self._planes[:, cells] = median
        self._base_threshold[cells] = self._threshold(noise[0].astype(np.float32))
        self._is_known[cells] = True
        is_more = len(ready) > len(cells)
        if self.is_ready or not is_more:  # else nothing is compared yet, and what follows is of all cells
            self._show()
            self._set_thresholds()
            self._moving.set_known(self._is_known)
        return is_more

    def _set_thresholds(self) -> None:
        """Raise the threshold where the background has edges: by how much a shift of part of a cell would change it."""
        luma = self._moving.unpack(self._shown[0])
        known = self._moving.unpack(self._is_known)
        kernel = np.ones((3, 3), np.uint8)
        highest = cv2.dilate(np.where(known, luma, 0).astype(np.uint8), kernel)
        lowest = cv2.erode(np.where(known, luma, FILL).astype(np.uint8), kernel)
        contrast = self._moving.pack(np.asarray(cv2.subtract(highest, lowest), np.uint8)).astype(np.float32)
        raised = self._base_threshold + self._mosaic.residual_cells * contrast
        threshold = np.minimum(raised, self._settings.most_difference_levels)
        self._sensitivity[...] = np.where(self._is_known, AT_THRESHOLD / threshold, 0.0)


def _middle(samples: ByteArray, is_empty: BoolArray, count: NDArray[np.int16]) -> NDArray[np.int16]:
    """Take the median of each cell's samples, those that are empty left out: (planes, cells)."""
    filled = np.where(is_empty[:, None], np.uint8(FILL), samples)
    filled.sort(axis=0)
    place = np.broadcast_to((count // 2)[None, None], (1, *filled.shape[1:]))
    return np.asarray(np.take_along_axis(filled, place.astype(np.intp), axis=0)[0], np.int16)
