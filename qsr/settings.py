"""At which distances, angles and times does a relation change?"""

import math
from dataclasses import dataclass, fields

from qsr.errors import QsrError


@dataclass(frozen=True, slots=True, kw_only=True)
class RelationSettings:
    """Hold every threshold of the relations.

    Each is "by reason" unless it says from where it comes; none was fitted to the shipped scenes, and in which range
    each works is not known. What literature says is quoted in docs/qsr.md.

    Attributes
    ----------
    enter_radius_m, leave_radius_m : a pair is looked at while its centres are nearer than this plus both half lengths;
        by reason, and two of them, so that cars at the rim do not come and go with the noise.
    enter_reach_s, leave_reach_s : for time gaps and conflicts, which reach further the faster cars are, so are pairs
        that the faster one's speed would bring together in less (by reason: a little over ``following_s``) ...
    enter_line_m, leave_line_m : ... if they are in line: less than this apart sideways, centre to centre; by reason:
        less than two lanes.
    gap_sigma_m : standard deviation of the noise in the gap between two cars; of white noise, frame by frame. That of
        the smooth positions of anchoring; docs/qsr.md has what happens at 0.6 m.
    sigma_factor, least_margin_m : the margin of the position thresholds is the larger of ``least_margin_m`` (by reason)
        and ``sigma_factor * gap_sigma_m``. Slow passes without flicker: 47 of 50 at a factor of 2, 50 of 50 at 3.
    beside_lateral_m : two cars that are not known to be on one road are not beside each other when they are further
        apart sideways (centre to centre); three lanes, since on motorways lanes 1 and 3 are 8.7 to 9.6 m apart.
    close_m, close_margin_m : bodies nearer than this are close; by reason.
    heading_limit_rad : headings that differ by less are the same direction, off the roads; by reason.
    road_alignment : product of the cosines between each heading and the road above which two cars on one road have the
        same direction (1: both along it, -1: oncoming, 0: one goes across). 0.5 is 45 degrees for both; by reason.
    direction_margin : margin of both direction thresholds, in units of the cosine; 0.05 is about 5 degrees at 37; by
        reason.
    moving_mps, moving_margin_mps : faster cars are moving. VISSIM lets a car join a queue below 5 km/h and leave it
        above 10 km/h: 2.1 m/s and 0.7 m/s to both sides.
    place_dwell_us : a car is on another road, or in another lane or junction, when it has been there for this long; so
        with its direction against road and lane. By reason: it takes the place of the margin of a distance.
    double_us : two symbols whose bodies were in each other, deeper than the margin of positions, ``sigma_factor`` times
        their noise, and for longer than ``place_dwell_us``, are one vehicle for so long after (where the noise is
        known). By reason: two names of one vehicle come apart for moments; two vehicles are never so near.
    far_along : on one road, but this many times as far along it as in the plane (or as the near radius), two cars are
        on a ring or a hairpin, where free space is meant; and on a ring of several roads a car is behind another one if
        the way back is this many times as long as the way there. By reason.
    widest_m : bodies count as no wider than this where it matters whether they overlap sideways; tracks often begin too
        wide. Directive 96/53/EC, the widest vehicle allowed.
    following_s : a car follows the next one in its path at a smaller time gap (bumper to bumper, over its own speed);
        Highway Capacity Manual 2000, chapter 20.
    short_headway_s : a smaller time gap is too short to react in; about the time a driver needs (Vogel 2003).
    short_headway_least_mps : slower cars are not blamed for their time gap; 30 km/h, CommonRoad's "slow traffic".
    time_gap_margin_s : margin of both time gaps; a speed of 25 m/s that is off by 0.5 m/s makes 0.06 s of a gap of 3 s.
    conflict_ttc_s, conflict_ttc_margin_s : time to collision below which two cars are in conflict (van der Horst 1990;
        the margin by reason) ...
    conflict_braking_mps2, conflict_braking_margin_mps2 : ... if it also takes more than this to avoid the collision
        (AASHTO 2001, comfortable for most drivers; the margin by reason).
    conflict_at_once_s : nearer contacts count as so near, so that the braking stays finite; by reason. Cars that touch
        more slowly than twice this times ``conflict_braking_mps2``, 0.7 m/s, are never in conflict.
    speed_noise_mps : standard deviation of the speed of a car whose place is known to a metre; it goes with the third
        root of that. Measured by ``benchmarks.evaluate_speeds`` on mast scenes 1 to 5.
    oncoming_s, oncoming_margin_s : two cars that drive towards each other are oncoming when they meet in less time;
        by reason.
    oncoming_enter_m, oncoming_leave_m : how far along the road or route such pairs are looked at, bumper to bumper; by
        reason: two cars at 25 m/s are then ``oncoming_s`` apart.
    backdate_us : how far a change may be dated back before the frame that decided it; by reason: whoever reads changes
        waits for so long.
    """

    enter_radius_m: float = 40.0
    leave_radius_m: float = 45.0
    enter_reach_s: float = 3.3
    leave_reach_s: float = 3.7
    enter_line_m: float = 5.0
    leave_line_m: float = 6.0
    gap_sigma_m: float = 0.15
    sigma_factor: float = 3.0
    least_margin_m: float = 0.5
    beside_lateral_m: float = 12.0
    close_m: float = 25.0
    close_margin_m: float = 1.0
    heading_limit_rad: float = math.radians(37.0)
    road_alignment: float = 0.5
    direction_margin: float = 0.05
    moving_mps: float = 2.0
    moving_margin_mps: float = 0.7
    place_dwell_us: int = 200_000
    double_us: int = 2_000_000
    far_along: float = 2.0
    widest_m: float = 2.6
    following_s: float = 3.0
    short_headway_s: float = 1.0
    short_headway_least_mps: float = 8.33
    time_gap_margin_s: float = 0.15
    conflict_ttc_s: float = 1.5
    conflict_ttc_margin_s: float = 0.2
    conflict_braking_mps2: float = 3.4
    conflict_braking_margin_mps2: float = 0.5
    conflict_at_once_s: float = 0.1
    speed_noise_mps: float = 0.85
    oncoming_s: float = 3.0
    oncoming_margin_s: float = 0.2
    oncoming_enter_m: float = 150.0
    oncoming_leave_m: float = 160.0
    backdate_us: int = 2_000_000

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise QsrError(f"relation settings: {field.name} must be a number >= 0, got {value!r}")
        self._check_order("enter_radius_m", "leave_radius_m")
        self._check_order("enter_reach_s", "leave_reach_s")
        self._check_order("enter_line_m", "leave_line_m")
        self._check_order("oncoming_enter_m", "oncoming_leave_m")

    def _check_order(self, enter: str, leave: str) -> None:
        entered, left = getattr(self, enter), getattr(self, leave)
        if left < entered:
            raise QsrError(f"relation settings: {leave} must be at least {enter} ({entered!r}), got {left!r}")

    @property
    def margin_m(self) -> float:
        """Half the width of the band around a position threshold in which nothing is decided."""
        return max(self.least_margin_m, self.sigma_factor * self.gap_sigma_m)
