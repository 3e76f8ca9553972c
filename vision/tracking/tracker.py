"""Which objects are on the road, seen before or new? Prediction, assignment and the life of tracks.

Metres and seconds throughout, every step sized by time stamps, so that dropped frames and other frame rates change
nothing but the uncertainty. Confirmed tracks choose first; what they leave starts or confirms new ones.
"""

from collections.abc import Callable

import numpy as np

from vision.detection.detector import Detections, Expected
from vision.detection.shadow import Sun, without_shadow
from vision.objects import BoolArray, FloatArray, IntArray, VisionObjects
from vision.road.boxes import Boxes, axis, distance_to_boxes, wrap_angle
from vision.settings import VisionSettings
from vision.tracking import kalman
from vision.tracking.association import Sightings, assign, costs, doubt, measured, sight
from vision.tracking.couples import find_couples
from vision.tracking.noise_level import NoiseLevel
from vision.tracking.track import TrackTable


class Tracker:
    """Tracks over time: per frame `predict`, then `update` with what was detected.

    Parameters
    ----------
    settings : noise, gates, life times.
    is_in_view : tells for (n, 2) ground points which are road in view; tracks that coast out of it end.

    Attributes
    ----------
    cut_count : how often a track was not seen where only the speed limit kept it from being seen.
    """

    def __init__(self, settings: VisionSettings, is_in_view: Callable[[FloatArray], BoolArray]) -> None:
        self._usual_m = (settings.usual_length_m, settings.usual_width_m)
        self._settings = settings.tracking
        self._detection = settings.detection
        self._is_in_view = is_in_view
        self._tracks = TrackTable(self._settings)
        self._now_us: int | None = None
        self._updated_us: int | None = None
        self._step_us = 0
        self._seen_us = 1
        self._names_used = 0
        self.cut_count = 0
        self._sun = Sun(settings.detection)
        self._noise_level = NoiseLevel(self._settings)

    def predict(self, t_us: int) -> Expected:
        """Move all tracks on to a frame's time.

        Parameters
        ----------
        t_us : later than at the call before.

        Returns
        -------
        Boxes of confirmed tracks (rows are what `Detections.owner` means) and of tentative ones that move.
        """
        dt_s = 0.0 if self._now_us is None else (t_us - self._now_us) / 1_000_000
        self._now_us = t_us
        tracks = self._tracks
        along = np.full(len(tracks), self._settings.acceleration_along_mps2)
        across = np.full(len(tracks), self._settings.acceleration_across_mps2)
        noise = kalman.oriented_covariance(tracks.heading_rad, along, across)
        tracks.state, tracks.covariance = kalman.predict(tracks.state, tracks.covariance, noise, dt_s)
        boxes = tracks.boxes()
        has_direction = tracks.speed_mps() > self._settings.heading_speed_mps
        is_coming = ~tracks.is_confirmed & has_direction
        return Expected(
            known=boxes.select(tracks.is_confirmed),
            bodies=lambda: self._bodies().select(tracks.is_confirmed),
            is_sized=tracks.is_sized()[tracks.is_confirmed],
            tentative=boxes.select(is_coming),
            is_driving=has_direction[tracks.is_confirmed],
            course_rad=tracks.course_rad()[is_coming],
        )

    def update(self, detections: Detections) -> VisionObjects:
        """Take in what was detected at the time of the latest `predict`.

        Parameters
        ----------
        detections : of that frame.

        Returns
        -------
        All confirmed tracks.
        """
        assert self._now_us is not None
        self._step_us = 0 if self._updated_us is None else self._now_us - self._updated_us
        self._seen_us = max(1, min(self._step_us, self._settings.most_step_us))
        self._updated_us = self._now_us
        tracks = self._tracks
        known = np.flatnonzero(tracks.is_confirmed)
        sightings = sight(
            detections, known, tracks, usual_length_m=self._usual_m[0], noise_factor=self._noise_level.factor
        )
        tracks.is_observed = np.zeros(len(tracks), np.bool_)
        cost, is_too_fast = costs(tracks, sightings, self._now_us)
        is_free = np.ones(len(sightings.owner), np.bool_)
        # At the end of its gate a track is as well not seen: it pushes nobody out of its own sighting for that. Where
        # cells are given to tracks, those of another are still better than none.
        alone = self._settings.gate_sigmas**2 * (2 if (sightings.owner >= 0).any() else 1)
        for rows in (known, np.flatnonzero(~tracks.is_confirmed)):
            free = np.flatnonzero(is_free)
            taken_by, taken = assign(cost[rows[:, None], free], alone=alone)
            if len(taken) > 0:
                self._correct(rows[taken_by], free[taken], sightings, detections)
            is_free[free[taken]] = False
        # Fast ones that are seen nowhere, though what nobody else claims would be them but for the speed.
        is_fast = tracks.speed_mps() > self._settings.fast_share * self._settings.max_speed_mps
        self.cut_count += int(np.count_nonzero((is_too_fast & is_free).any(axis=1) & is_fast & ~tracks.is_observed))
        tracks.note_rest(self._now_us)
        self._confirm()
        bodies = self._end(self._bodies())
        self._start(detections, sightings, is_free, bodies)
        return self._objects(bodies)

    def between_looks(self) -> VisionObjects:
        """Tell of the tracks at the time of the latest `predict`, where nobody has looked: nothing is new of them.

        Returns
        -------
        All confirmed tracks; what was seen at the latest look, and has not driven out of view, counts as seen.
        """
        tracks = self._tracks
        # The middle of what stands at the edge may be out of view all the time.
        stands = tracks.speed_mps() < self._settings.heading_speed_mps
        tracks.is_observed &= stands | self._is_in_view(tracks.state[:, :2])
        return self._objects(self._bodies())

    def standing(self, min_us: int) -> tuple[IntArray, Boxes]:
        """List tracks that may be ghosts: seen, but standing for a while.

        Parameters
        ----------
        min_us : tracks that have stood for less are left out.

        Returns
        -------
        Rows for `prove` and `drop`, and the boxes.
        """
        assert self._now_us is not None
        tracks = self._tracks
        rows = np.flatnonzero((self._now_us - tracks.rest_us >= min_us) & tracks.is_observed)
        return rows, tracks.boxes().select(rows)

    def prove(self, rows: IntArray) -> None:
        """Accept standing tracks as objects.

        Parameters
        ----------
        rows : from `standing`.
        """
        self._tracks.is_proved[rows] = True

    def drop(self, rows: IntArray) -> None:
        """Forget tracks that turned out to be ghosts.

        Parameters
        ----------
        rows : from `standing`.
        """
        kept = np.ones(len(self._tracks), np.bool_)
        kept[rows] = False
        self._tracks = self._tracks.select(kept)

    def forget(self) -> None:
        """End all tracks; their names are not used again."""
        self._tracks = TrackTable(self._settings)

    def claims(self) -> tuple[Boxes, BoolArray]:
        """Say where objects stand, for the background.

        Returns
        -------
        Boxes of all tracks, and which of them are known to be objects.
        """
        return self._tracks.boxes(), self._tracks.is_proved

    def _correct(self, rows: IntArray, chosen: IntArray, sightings: Sightings, detections: Detections) -> None:
        """Give sighting `chosen[i]` to track `rows[i]`."""
        assert self._now_us is not None
        tracks = self._tracks
        state, covariance = tracks.state[rows], tracks.covariance[rows]
        (centre_m, room), noise = measured(tracks, sightings, rows, chosen), sightings.noise[chosen]
        squared = kalman.squared_distance(state, covariance, centre_m, noise)
        is_cut, is_alone = detections.cut[chosen] != 0, ~detections.divided[chosen]
        is_gauge = tracks.is_confirmed[rows] & tracks.is_sized()[rows] & is_alone & ~is_cut
        self._noise_level.learn(squared[is_gauge & ~room.any(axis=(1, 2))], self._seen_us)
        noise = self._worth() * noise * doubt(squared, self._settings.gate_sigmas)[:, None, None] + room
        corrected, covariance = kalman.update(state, covariance, centre_m, noise)
        corrected, tracks.covariance[rows] = self._by_speed(corrected, covariance, sightings, chosen)
        tracks.state[rows] = self._inert(rows, state, corrected)
        tracks.turn_ahead(rows, ~is_alone, self._now_us)
        is_whole, is_growing = is_alone & ~is_cut, is_alone & is_cut & (tracks.sized_us[rows] == 0)
        boxes = detections.boxes.select(chosen[is_whole])
        tracks.learn_size(rows[is_whole], boxes, self._usual_m[0], self._seen_us)
        if is_growing.any():
            parts = detections.boxes.select(chosen[is_growing])
            tracks.grow(rows[is_growing], parts.length_m, parts.width_m)
        borders_m = detections.borders_m[chosen[is_whole]]
        if not np.isnan(borders_m[:, 0]).all():  # they are measured now and then
            tracks.learn_borders(rows[is_whole], borders_m, self._seen_us)
            self._sun.learn(borders_m, boxes.heading_rad, boxes.length_m)
        tracks.evidence[rows] = np.maximum(tracks.evidence[rows] + detections.weights()[chosen], 0.0)
        tracks.seen_us[rows] = self._now_us
        tracks.seen_m[rows] = tracks.state[rows, :2]
        tracks.is_observed[rows] = True
        tracks.is_clipped[rows] = is_cut

    def _by_speed(
        self, state: FloatArray, covariance: FloatArray, sightings: Sightings, chosen: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Correct states by how fast chosen sightings, one each, were seen to move."""
        if sightings.velocities is None:
            return state, covariance
        velocities = sightings.velocities.select(chosen)
        rows = np.flatnonzero(~np.isnan(velocities.mean_mps).any(axis=1))
        seen_mps, noise = velocities.mean_mps[rows], velocities.noise[rows]
        squared = kalman.squared_distance(state[rows, 2:], covariance[rows, 2:, 2:], seen_mps, noise)
        # What moves quite otherwise is what is in front of it.
        is_own = squared <= self._settings.flow_sigmas**2
        rows, seen_mps, noise = rows[is_own], seen_mps[is_own], noise[is_own]
        state[rows], covariance[rows] = kalman.update(state[rows], covariance[rows], seen_mps, noise, kalman.VELOCITY)
        return state, covariance

    def _worth(self) -> float:
        """Give the factor on the noise of a sighting that stands for more time, or less, than it claims."""
        step_us = self._step_us
        return self._settings.claimed_us / step_us if 0 < step_us <= self._settings.most_step_us else 1.0

    def _inert(self, rows: IntArray, predicted: FloatArray, corrected: FloatArray) -> FloatArray:
        """Limit how fast driving vehicles change their speed; returns (n, 4) states."""
        assert self._now_us is not None
        tracks = self._tracks
        ahead = axis(tracks.heading_rad[rows])
        change_mps = np.einsum("ni,ni->n", corrected[:, 2:] - predicted[:, 2:], ahead)
        most_mps = self._settings.grip_mps2 * (self._now_us - tracks.seen_us[rows]) / 1_000_000
        excess_mps = change_mps - np.clip(change_mps, -most_mps, most_mps)
        excess_mps[~tracks.is_driving()[rows]] = 0.0
        return np.column_stack([corrected[:, :2], corrected[:, 2:] - excess_mps[:, None] * ahead])

    def _bodies(self) -> Boxes:
        """Box all tracks without their shadows."""
        tracks = self._tracks
        shadow_m = self._sun.shadows(tracks.heading_rad, tracks.length_m, tracks.borders_m, tracks.borders_us)
        return without_shadow(tracks.boxes(), shadow_m, self._detection)

    def _confirm(self) -> None:
        tracks, settings = self._tracks, self._settings
        assert self._now_us is not None
        # Where it was seen counts, not where a guessed velocity carries it.
        shift_m = np.hypot(*(tracks.seen_m - tracks.born_m).T)
        noise_m = np.sqrt(tracks.covariance[:, 0, 0] + tracks.covariance[:, 1, 1])
        has_moved = shift_m >= np.maximum(settings.confirm_shift_m, settings.sure_sigmas * noise_m)
        # Sightings far apart in time agree less easily by chance than those of neighbouring frames.
        age_us = tracks.seen_us - tracks.born_us
        share = np.where(age_us >= settings.long_seen_us, settings.long_seen_share, 1.0)
        is_evident = tracks.evidence >= share * settings.confirm_hits
        tracks.is_proved |= has_moved & is_evident & ~tracks.is_confirmed
        is_new = ~tracks.is_confirmed & tracks.is_proved & tracks.is_observed & is_evident
        if is_new.any():
            # Not where a known vehicle is looked for in vain: this may be it. Two would be seen together soon.
            is_new &= ~tracks.twins(self._now_us)
        tracks.number[is_new] = self._names_used + np.arange(1, is_new.sum() + 1)
        self._names_used += int(is_new.sum())
        tracks.is_confirmed |= is_new

    def _end(self, bodies: Boxes) -> Boxes:
        """Remove tracks not seen for too long, out of view, or part of another; returns the bodies of the others."""
        tracks, settings = self._tracks, self._settings
        assert self._now_us is not None
        # What was seen for a moment only is not believed in for longer than that.
        most_us = np.where(tracks.is_driving(), settings.hidden_us, settings.coast_us)
        seen_for_us = np.clip(tracks.seen_us - tracks.born_us, settings.tentative_us, most_us)
        patience_us = np.where(tracks.is_confirmed, seen_for_us, settings.tentative_us)
        is_lost = self._now_us - tracks.seen_us > patience_us
        has_left = ~tracks.is_observed & ~self._is_in_view(tracks.state[:, :2])
        is_kept = ~(is_lost | has_left | self._is_part(bodies))
        self._tracks = tracks.select(is_kept)
        return bodies.select(is_kept)

    def _is_part(self, bodies: Boxes) -> BoolArray:
        """Find fragments: tracks that stand inside an older one, take turns or ride with it."""
        tracks = self._tracks
        assert self._now_us is not None
        if not tracks.is_crowded(self._settings.couple_gap_m + self._settings.couple_across_m):
            tracks.doubled_us = tracks.twin_us = tracks.coupled_us = np.zeros(len(tracks), np.int64)
            return np.zeros(len(tracks), np.bool_)
        is_double = tracks.doubles(tracks.boxes())
        if is_double.any():
            is_double = tracks.doubles(bodies)
        tracks.doubled_us = np.where(is_double, tracks.doubled_us + self._step_us, 0)
        tracks.twin_us = np.where(tracks.twins(self._now_us), tracks.twin_us + self._step_us, 0)
        is_twin = tracks.twin_us >= self._settings.twin_us
        return np.asarray((tracks.doubled_us >= self._settings.double_us) | is_twin | self._join_couples())

    def _join_couples(self) -> BoolArray:
        """Find tracks that have long ridden with an older one as one body, which is as long as both."""
        tracks = self._tracks
        couples = find_couples(tracks.boxes(), tracks.state[:, 2:], self._settings)
        couples &= tracks.is_confirmed[:, None] & tracks.is_confirmed[None] & tracks.older()
        tracks.coupled_us = np.where(couples.any(axis=1), tracks.coupled_us + self._step_us, 0)
        is_part: BoolArray = tracks.coupled_us >= self._settings.coupled_us
        for part, whole in np.argwhere(couples & is_part[:, None]).tolist():
            tracks.lengthen(whole, part)
        return is_part

    def _start(self, detections: Detections, sightings: Sightings, is_free: BoolArray, bodies: Boxes) -> None:
        """Begin a tentative track at every detection that no track took and no confirmed track covers."""
        boxes, settings = detections.boxes, self._settings
        is_possible = (boxes.length_m <= settings.max_length_m) & (boxes.width_m <= settings.max_width_m)
        is_possible &= (boxes.length_m >= settings.min_length_m) | (detections.cut != 0)
        chosen = np.flatnonzero(is_free & is_possible)
        if len(chosen) == 0:
            return
        known = bodies.select(self._tracks.is_confirmed)
        is_covered = (distance_to_boxes(boxes.centre_m[chosen], known) < 0).any(axis=1)
        if not is_covered.all():
            self._tracks = self._tracks.append(self._newborn(detections, sightings, chosen[~is_covered]))

    def _newborn(self, detections: Detections, sightings: Sightings, chosen: IntArray) -> TrackTable:
        assert self._now_us is not None
        count, boxes, settings = len(chosen), detections.boxes.select(chosen), self._settings
        is_clear = (detections.elongation[chosen] >= settings.clear_elongation) & (detections.cut[chosen] == 0)
        centre_m, falses = sightings.centre_m[chosen], np.zeros(count, np.bool_)
        covariance = np.zeros((count, 4, 4))
        covariance[:, :2, :2] = sightings.noise[chosen]
        across_mps = np.where(is_clear, settings.new_across_mps, settings.new_along_mps)
        along_mps = np.full(count, settings.new_along_mps)
        covariance[:, 2:, 2:] = kalman.oriented_covariance(boxes.heading_rad, along_mps, across_mps)
        state = np.column_stack([centre_m, np.zeros((count, 2))])
        state, covariance = self._by_speed(state, covariance, sightings, chosen)
        is_whole = detections.cut[chosen] == 0
        return TrackTable(
            settings=settings,
            number=np.full(count, -1),
            state=state,
            covariance=covariance,
            heading_rad=boxes.heading_rad.copy(),
            length_m=np.where(is_whole, boxes.length_m, np.maximum(boxes.length_m, self._usual_m[0])),
            width_m=np.where(is_whole, boxes.width_m, np.maximum(boxes.width_m, self._usual_m[1])),
            sized_us=is_whole * self._seen_us,
            misfit_us=np.zeros(count, np.int64),
            odd_m=np.zeros((count, 4)),
            evidence=detections.weights()[chosen],
            born_us=np.full(count, self._now_us),
            seen_us=np.full(count, self._now_us),
            born_m=centre_m.copy(),
            seen_m=centre_m.copy(),
            rest_m=centre_m.copy(),
            rest_us=np.full(count, self._now_us),
            is_confirmed=falses.copy(),
            is_proved=falses.copy(),
            is_observed=~falses,
            is_clipped=~is_whole,
            doubled_us=np.zeros(count, np.int64),
            coupled_us=np.zeros(count, np.int64),
            twin_us=np.zeros(count, np.int64),
            borders_m=np.zeros((count, 4)),
            borders_us=np.zeros(count, np.int64),
        )

    def _objects(self, bodies: Boxes) -> VisionObjects:
        """Tell of the confirmed tracks; those just begun, without a body in `bodies`, are none."""
        assert self._now_us is not None
        tracks = self._tracks
        # Who is hidden for longer is waited for, but not shown until it is seen again.
        shown = tracks.is_confirmed & (self._now_us - tracks.seen_us <= self._settings.coast_us)
        boxes = bodies.select(np.flatnonzero(shown))
        # The size of an object never seen whole is that of a usual car, without a shadow.
        is_seen_whole = tracks.sized_us[shown] > 0
        return VisionObjects(
            t_us=self._now_us,
            ids=tuple(f"v{number}" for number in tracks.number[shown].tolist()),
            centre_m=boxes.centre_m,
            velocity_mps=tracks.state[shown, 2:],
            heading_rad=wrap_angle(boxes.heading_rad),
            length_m=np.where(is_seen_whole, boxes.length_m, tracks.length_m[shown]),
            width_m=np.where(is_seen_whole, boxes.width_m, tracks.width_m[shown]),
            observed=tracks.is_observed[shown],
            clipped=tracks.is_clipped[shown],
            sigma_m=np.sqrt((tracks.covariance[shown, 0, 0] + tracks.covariance[shown, 1, 1]) / 2),
        )
