"""At which sizes, distances and shares does detection decide?"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DetectionSettings:
    """Tuned numbers of detection on the map and in the image; each comment says what it rests on."""

    # Cells of the window that closes gaps; odd, since an even one moves the mask, and with it every centre.
    close_cells: int = 3
    # A blob holds a cell so many times over its threshold: noise and compression differ a little everywhere.
    strong_ratio: float = 1.5
    # Smaller blobs are noise: a motorcycle, the smallest vehicle, covers 1.8 m2.
    min_area_m2: float = 1.2
    # In the image this much of the least area is enough for a vehicle that is known: another one may hide half of it.
    half_hidden_share: float = 0.5
    # Cells under this share of their group's mean difference are halo, which blur and compression put around contrasts;
    # none above the second number, in thresholds, is.
    halo_share: float = 0.5
    halo_most: float = 2.2
    # Border cells are mixed, so boxes come out too large by this: on drawn boxes of 20 to 60 grey levels of contrast.
    blur_cells: float = 0.4
    # Standard deviation of a detected centre, along and across the same; rendered seeds 1 to 5 of rural_overtaking.
    position_noise_m: float = 0.3
    # A tentative track is this close to the middle of the blob or box to which it lends its direction.
    lend_reach_m: float = 1.0
    # What is in a lane moves along it, whatever its shape: at least this elongation is claimed of it.
    lane_elongation: float = 2.0

    # Cells count as evidence for a predicted box up to this far outside it.
    split_reach_m: float = 0.5
    # Part of its own area that a predicted box must own in a blob to claim it, so that no phantom halves a car.
    split_share: float = 0.3
    # A blob is divided only if it covers this much of the boxes that claim it, taken together.
    fill_share: float = 0.6
    # Blobs of one owner are joined only if together they are no longer and no wider than its box by this much.
    join_slack_m: float = 1.5
    # Cells this far outside a box of well-known size belong to something else that touches it, if they are enough.
    rest_reach_m: float = 0.8
    # Enough, that is, for a vehicle; less than any car covers. So large is each that a blob is parted into by lanes.
    part_area_m2: float = 3.0

    # A blob this wide across the lanes may be two vehicles: two cars are 3.6 m wide. Each is so wide in its lane.
    two_vehicles_m: float = 3.4
    part_width_m: float = 1.5
    # Standing blobs in the first frame may be two vehicles side by side, if as wide as this: one and its shadow is not.
    pair_width_m: float = 5.0
    # The part of a lane that is the shadow of the vehicle beside it is evenly dark: so much of it, to so many per cent.
    shadow_share: float = 0.8
    even_percent: int = 10
    # All shadows of a scene leave the most frequent light of its dark cells, up to so many per cent more or less.
    light_percent: int = 8
    # So much of a group is in lanes if it takes their direction.
    lane_share: float = 0.6
    # Lines and kerbs lie so far inside and outside the edge of a lane. No vehicle is so wide that it covers the inside.
    border_inside_m: float = 0.2
    border_outside_m: float = 0.6
    # A body is solid over this width, of a small car, and length, half of one; a gap this short in it is a window.
    body_width_m: float = 1.2
    solid_length_m: float = 1.8
    window_m: float = 1.2
    # Longer vehicles are no cars: taller, with longer shadows. Vans and pickups stay below.
    long_vehicle_m: float = 7.5
    # Seen slantwise, a blob is cut into bodies at the least cost, in squared deviations of sizes: how width differs,
    # what a metre costs of a waist (to nothing, beside what is seen so far before and behind) and of shadow in a body,
    # and of something solid in none, and what a cut costs. Tried on the queues at the start of junction seeds 1 to 3,
    # where 71 of 73 vehicles are parted; 63 to 70 with other numbers.
    width_differs_m: float = 0.5
    waist_cost: float = 3.0
    waist_reach_m: float = 2.0
    shade_cost: float = 0.5
    nobody_cost: float = 6.0
    cut_cost: float = 3.0
    # No body is longer; and where a metre of height leans less than this across its lane, it stays in it.
    longest_m: float = 19.0
    upright_lean: float = 0.5
    # Shadow so near to a body may be its own, and so may be what is no shadow; the rest is nobody's: given to a truck,
    # it covered the neighbours (intersection clip).
    own_shadow_m: float = 0.6
    own_reach_m: float = 2.0

    # A body stands out of its shadow if it is this much of the blob, and at least as long as this.
    body_share: float = 0.35
    body_length_m: float = 2.5
    # Shadows of long vehicles are this much longer than those of cars, until enough was seen of them.
    long_shadow_factor: float = 1.5
    # Sides and reach of shadows are medians over the last so many measurements, and over so many at least.
    shadow_memory: int = 300
    shadow_measurements: int = 10
    # Measured for this long, a vehicle's own shadow counts and not that of its kind; but no more than this of it.
    own_us: int = 200_000
    own_factor: float = 1.25
    own_slack_m: float = 0.25
    # What remains of a box at least, as of small vehicles of both kinds: a shadow that falls off the watched road is
    # not in the box, so there may be less to take off than the sun would have it.
    short_length_m: float = 3.0
    short_width_m: float = 1.6
    long_length_m: float = 6.0
    long_width_m: float = 2.3

    # The image is watched up to this height over the road: that of vans.
    watched_height_m: float = 2.5
    # Road is watched as far as a car is so many pixels wide; cells are coarser than pixels while it has so many cells.
    least_car_px: float = 8.0
    image_car_cells: float = 16.0
    # The lowest row of a blob is this uncertain.
    foot_noise_cells: float = 1.5
    # A vehicle is no smaller than is usual for its kind by more than this part; tried on mast scenes 1 and 2, .1 to .2.
    kind_slack: float = 0.1
    # Feet lie at least this wide side by side; what reaches lower is a speck or a neighbour's cell.
    foot_width_m: float = 0.15
    # So many cells below a column's lowest one are looked at: the border between two vehicles is a little blurred.
    below_cells: int = 3
    # A foot behind the border of the view may be anywhere within this many lengths; behind a nearer vehicle, at a low
    # angle, so far that it says nothing (motorway clip).
    hidden_foot_lengths: float = 2.0
    covered_foot_lengths: float = 8.0
    # Of a vehicle half hidden by another this much is seen at least; shadows on the next lane are flatter.
    feet_width_m: float = 1.1
    feet_height_m: float = 0.9
    # Of one that stands in the same lane as another this width is enough: no shadow falls that far.
    apart_width_m: float = 0.6
    # Lanes run with the line of sight where the cosine of the angle between them is at least this.
    lengthwise_cos: float = 0.9
    # What is seen so high over the foot of a car in front, above its roof, belongs to the vehicle behind it.
    roof_m: float = 1.9
    # The lower outline of one vehicle makes no step as high as this, upright: wheels and bumpers hang lower. On either
    # side of a step, a vehicle is seen this wide.
    step_m: float = 1.2
    step_width_m: float = 0.8
    # What stands in two lanes is one vehicle between them if it is narrower than two and no part is farther by this.
    level_m: float = 2.5
    # Whoever walks is narrower than this, as are motorcycles, and goes along no lane: that is, within this cosine.
    walker_width_m: float = 1.4
    walker_cos: float = 0.7
    # Feet in one lane with nothing between them for this far belong to two vehicles; a coarse view allows no less than
    # so many cells.
    gap_m: float = 6.0
    gap_cells: float = 6.0

    # Mahalanobis distance up to which detections of two cameras may be one vehicle: three sigmas, as usual.
    fusion_sigmas: float = 3.0
    # The two homographies agree on the ground to about this.
    registration_m: float = 0.4
    # A detection that nobody else confirms or denies is a vehicle with this probability.
    lone_trust: float = 0.8
    # A piece of a vehicle lies this close to its box: bumpers and shadows do, other vehicles do not.
    piece_reach_m: float = 1.0
    # Detection rates are means over about this many sightings of tracks, and start from so many at one half.
    rate_memory: float = 2000.0
    rate_prior: float = 20.0
    # No camera is so good that its silence proves anything.
    most_rate: float = 0.98
    # By how much a box may lie beside its vehicle: half a shadow in colour, half a coarse pixel in warmth.
    colour_bias_m: float = 0.5
    thermal_bias_m: float = 0.2
