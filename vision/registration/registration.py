"""From where was this picture of a moving camera taken? Its map to the ground, by comparison with key frames.

The camera's map is known for the first frame. Later frames are compared with the *key frame* that shows most of the
same ground: its corners are followed by pyramidal Lucas-Kanade from where the last map puts them, and a robust
homography of the pairs gives the new map. The key frame is first redrawn as seen from near the present view, since
Lucas-Kanade looks for shifted surroundings and not for turned ones. When no key frame shows enough of the view, the
present frame becomes one; where vehicles are it has no corners.

The *guard* calls the view lost when too few corners agree, when they lie on too small a part of the picture, when the
picture around them looks different, or when the view would have jumped. A lost view is looked for from the last map at
every frame, and by the looks of the corners (ORB: Rublee and others 2011) among all key frames a few times a second.
"""

from collections.abc import Sequence
from typing import Protocol, TypeVar

import cv2
import numpy as np

from vision.objects import ByteArray, FloatArray, Tensor
from vision.registration.key_frames import KeyFrame, Landmarks, corners_of, half_size, to_half
from vision.registration.plane_fit import transform
from vision.registration.settings import RegistrationSettings
from vision.video.frame import Frame

# Around so many corners the looks are compared.
LIKENESS_CORNERS = 40

InstantT_contra = TypeVar("InstantT_contra", contravariant=True)


class CameraMotion(Protocol[InstantT_contra]):
    """Anything that knows the map to the ground at every instant of a moving camera: of frames, or of poses alone."""

    @property
    def refusal(self) -> str:
        """Why the view of the latest instant is lost; empty where it is known."""
        ...

    def locate(self, frame: InstantT_contra, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        """Tell from where a frame was taken.

        Parameters
        ----------
        frame : the next one.
        vehicles_m : outlines (k, 2) on the ground of what is known to move.

        Returns
        -------
        (3, 3) pixel_from_ground, third coordinate positive in front of the camera; None where the view is lost.
        """
        ...


class Registration:
    """Maps to the ground by comparison with key frames.

    Parameters
    ----------
    pixel_from_ground : (3, 3) of the first frame.
    image_size_px : (width, height).
    settings : of this room.

    Attributes
    ----------
    inliers : how many corners agreed in the latest frame.
    refusal : which guard called the view lost, and by what; empty where it is known.
    """

    def __init__(
        self, pixel_from_ground: FloatArray, image_size_px: tuple[int, int], settings: RegistrationSettings
    ) -> None:
        self._settings = settings
        self.inliers = 0
        self.refusal = ""
        self._matrix = np.asarray(pixel_from_ground, np.float64)
        width, height = image_size_px
        self._corners_px = np.array([[0.0, 0.0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]])
        self._lattice_px = _lattice(self._corners_px)
        self._diagonal_px = float(np.hypot(width, height))
        self._known_us = 0
        self._keys: list[KeyFrame] = []
        self._landmarks = Landmarks(settings)
        # A key frame, and how it is drawn as seen from near the present view.
        self._key: KeyFrame | None = None
        self._drawn: KeyFrame | None = None
        self._searched_us: int | None = None
        self._search_from = 0

    @property
    def key_count(self) -> int:
        """Number of key frames kept."""
        return len(self._keys)

    def locate(self, frame: Frame, vehicles_m: Sequence[FloatArray]) -> FloatArray | None:
        """Register a frame.

        Parameters
        ----------
        frame : the next one; the first has the map given at construction.
        vehicles_m : outlines (k, 2) on the ground of what is known to move.

        Returns
        -------
        (3, 3) pixel_from_ground; None where the view is lost.
        """
        luma = half_size(frame.luma)
        if self._drawn is None:
            self._add_key(luma, vehicles_m)
            self._known_us = frame.t_us
            return self._matrix
        share_per_s, unknown_s = self._settings.jump_share_per_s, (frame.t_us - self._known_us) / 1e6
        reach_px = (self._settings.jump_share + share_per_s * unknown_s) * self._diagonal_px
        matrix = self._follow(luma, self._drawn, self._matrix, reach_px=reach_px)
        if matrix is None:
            refusal = self.refusal
            matrix = self._search(luma, frame.t_us, reach_px=reach_px)
            if matrix is None:
                self.refusal = refusal
                return None
        self._searched_us, self.refusal = None, ""
        self._matrix, self._known_us = matrix, frame.t_us
        self._choose_key(luma, vehicles_m)
        return matrix

    def _follow(self, luma: ByteArray, drawn: KeyFrame, guess: FloatArray, *, reach_px: float) -> FloatArray | None:
        """Register against one key frame, from a guess; None where the guard refuses."""
        settings = self._settings
        fit, expected = drawn.follow(luma, guess, settings)
        if fit is None:
            self.refusal = f"expected {settings.least_pairs} corners or more that move alike, got fewer"
            return None
        found_px = transform(fit.matrix, fit.source_px)[fit.is_inlier]
        self.inliers = len(found_px)
        spread = np.ptp(found_px, axis=0) / np.array(luma.shape[::-1]) / 2
        least_inliers = max(settings.least_inliers, settings.least_share * expected)
        if self.inliers < least_inliers:
            self.refusal = f"expected {least_inliers:.0f} corners or more that agree, got {self.inliers}"
            return None
        if spread.min() < settings.least_spread:
            self.refusal = f"expected corners over {settings.least_spread:.2f} of the picture, got {spread.min():.2f}"
            return None
        some = slice(None, None, max(1, self.inliers // LIKENESS_CORNERS))
        likeness = np.median(likenesses(drawn.luma, fit.source_px[fit.is_inlier][some], luma, found_px[some]))
        if likeness < settings.least_likeness:
            expected_likeness = f"{settings.least_likeness:.2f} or more like what is known"
            self.refusal = f"expected a picture around the corners that is {expected_likeness}, got {likeness:.2f}"
            return None
        matrix = np.asarray(fit.matrix @ drawn.pixel_from_ground)
        moved_px = np.hypot(*self._shift_px(self._matrix, matrix).T).max()
        if moved_px > reach_px:
            self.refusal = f"expected a view within {reach_px:.0f} px of the last one, got one {moved_px:.0f} px away"
            return None
        return matrix

    def _search(self, luma: ByteArray, t_us: int, *, reach_px: float) -> FloatArray | None:
        """Look for a lost view among the key frames, now and then."""
        if self._searched_us is not None and t_us - self._searched_us < self._settings.search_us:
            return None
        self._searched_us = t_us
        ranked = sorted(self._keys, key=lambda key: -self._shared(key, self._matrix))
        count = min(self._settings.search_keys, len(ranked))
        candidates = [ranked[(self._search_from + k) % len(ranked)] for k in range(count)]
        self._search_from = (self._search_from + count) % len(ranked)
        for key, guess in self._landmarks.guess(luma, candidates):
            drawn = _redrawn(key, guess)
            matrix = self._follow(luma, drawn, guess, reach_px=reach_px)
            if matrix is not None:
                self._key, self._drawn, self._search_from = key, drawn, 0
                return matrix
        return None

    def _choose_key(self, luma: ByteArray, vehicles_m: Sequence[FloatArray]) -> None:
        """Go on with the key frame that shows most of the view; make one where none shows enough."""
        assert self._key is not None
        assert self._drawn is not None
        key = self._key
        if self._shared(key, self._matrix) < self._settings.key_share:
            key = max(self._keys, key=lambda one: self._shared(one, self._matrix))
            if self._shared(key, self._matrix) < self._settings.key_share:
                if self.inliers >= self._settings.key_inliers:
                    self._add_key(luma, vehicles_m)
                return
        shift = self._shift_px(self._drawn.pixel_from_ground, self._matrix)
        bend_px = np.hypot(*(shift - shift.mean(axis=0)).T).max()
        if key is not self._key or bend_px > self._settings.redraw_px:
            self._key, self._drawn = key, _redrawn(key, self._matrix)

    def _add_key(self, luma: ByteArray, vehicles_m: Sequence[FloatArray]) -> None:
        outlines = [transform(self._matrix, outline) for outline in vehicles_m]
        self._key = self._drawn = KeyFrame(luma, self._matrix, corners_of(luma, outlines, self._settings))
        self._keys.append(self._key)
        if len(self._keys) > self._settings.most_keys:
            # The first one stays for ever: its map is exact.
            self._landmarks.forget(self._keys.pop(1))

    def _shared(self, key: KeyFrame, matrix: FloatArray) -> float:
        """Tell which part of a view a key frame shows, by a lattice of points; 0 where it is turned or zoomed a lot."""
        back = key.pixel_from_ground @ np.linalg.inv(matrix)
        seen = transform(back, self._lattice_px)
        zoom = np.sqrt(abs(np.linalg.det(back / back[2, 2])))
        if max(zoom, 1 / zoom) >= self._settings.key_zoom:
            return 0.0
        return float(np.mean(np.all((seen >= 0) & (seen <= self._corners_px[2]), axis=1)))

    def _shift_px(self, one: FloatArray, two: FloatArray) -> FloatArray:
        """Tell how each corner of the picture moves between two views, (4, 2)."""
        return np.asarray(transform(two @ np.linalg.inv(one), self._corners_px) - self._corners_px)


# Around a corner, in full-size pixels.
SURROUNDINGS_PX = np.stack(np.meshgrid(np.arange(-4, 5, 2), np.arange(-4, 5, 2)), axis=-1).reshape(-1, 2)
HALF_FROM_FULL = np.array([[0.5, 0.0, -0.25], [0.0, 0.5, -0.25], [0.0, 0.0, 1.0]])


def _redrawn(key: KeyFrame, matrix: FloatArray) -> KeyFrame:
    """Redraw a key frame as seen from another view."""
    moved = matrix @ np.linalg.inv(key.pixel_from_ground)
    half = HALF_FROM_FULL @ moved @ np.linalg.inv(HALF_FROM_FULL)
    drawn = cv2.warpPerspective(key.luma, half, key.luma.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
    return KeyFrame(np.asarray(drawn, np.uint8), matrix, transform(moved, key.corners_px))


def _lattice(corners_px: FloatArray) -> FloatArray:
    x, y = np.linspace(0.0, corners_px[2, 0], 9), np.linspace(0.0, corners_px[2, 1], 6)
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def likenesses(luma: ByteArray, points_px: FloatArray, other: ByteArray, other_px: FloatArray) -> FloatArray:
    """Correlate the surroundings of corners in two pictures at half size, corner by corner.

    Parameters
    ----------
    luma, other : the pictures. points_px, other_px : (n, 2) full-size positions in them.

    Returns
    -------
    (n,) from -1 to 1.
    """
    return likeness(patches(luma, surroundings(points_px)), patches(other, surroundings(other_px)))


def surroundings(points_px: FloatArray) -> Tensor:
    """List the places in a half-size picture, (..., 25, 2), that are around full-size positions, (..., 2)."""
    return (to_half(points_px[..., None, :]) + SURROUNDINGS_PX).astype(np.float32)


def patches(luma: ByteArray, places: Tensor) -> Tensor:
    """Cut out what is at `surroundings`, (..., 25, 2), of a half-size picture.

    Returns
    -------
    (..., 25), 5 x 5 pixels, of mean 0 and length 1.
    """
    if places.size == 0:
        return np.zeros(places.shape[:-1], np.float32)
    columns, rows = places.reshape(-1, *SURROUNDINGS_PX.shape).transpose(2, 0, 1)
    seen = np.asarray(cv2.remap(luma, columns, rows, cv2.INTER_LINEAR), np.float32)
    seen -= seen.mean(axis=1, keepdims=True)
    seen /= np.maximum(np.sqrt(np.einsum("np,np->n", seen, seen)), 1e-3)[:, None]
    return seen.reshape(places.shape[:-1])


def likeness(one: Tensor, other: Tensor) -> FloatArray:
    """Correlate `patches`, (..., 25) each; from -1 to 1."""
    return np.asarray(np.einsum("...p,...p->...", one, other), np.float64)
