"""Which pairs are no two vehicles? Of these nothing is said, since it would be a tracker's mistake.

Bodies cannot be in each other: who overlaps for longer, and deeper than noise explains, is one vehicle under two names,
or in two pieces.
"""

from itertools import pairwise

import numpy as np

from qsr.changes.looks import Look, Objects
from qsr.measuring.footprints import BoolArray, FloatArray, LongArray
from qsr.measuring.free_space import FreeSpace
from qsr.measuring.pairs import pair_keys
from qsr.settings import RelationSettings


class OneVehicle:
    """Keep which pairs are one vehicle.

    Parameters
    ----------
    settings : thresholds.
    """

    def __init__(self, settings: RelationSettings) -> None:
        self._settings = settings
        # Both by the key of a pair.
        self._since_us: dict[int, int] = {}  # from which frame on it overlaps
        self._until_us: dict[int, int] = {}  # up to when it counts as one vehicle

    def are_two(self, objects: Objects, pairs: LongArray, distance_m: FloatArray) -> BoolArray:
        """Tell which pairs are two vehicles; call it with each look once, in their order.

        Parameters
        ----------
        objects : of the looks.
        pairs : (2, pairs) of them of which something new is known, in lexicographic order.
        distance_m : (pairs,) between the centres, less half the lengths.
        """
        are_two = np.ones(len(distance_m), np.bool_)
        touching = (distance_m < self._settings.widest_m).nonzero()[0]  # the others are apart, however they lie
        overlapping = touching[self._overlap(objects, pairs.take(touching, axis=1))]
        if not (len(overlapping) or self._since_us or self._until_us):
            return are_two
        keys, starts = pair_keys(objects.serials, pairs), objects.starts_of(pairs)
        begins = overlapping.searchsorted(starts).tolist()
        for look, span, some in zip(objects.looks, pairwise(starts.tolist()), pairwise(begins), strict=True):
            self._note(look, keys.take(overlapping[slice(*some)]).tolist())
            if self._until_us:
                are_two[slice(*span)] = ~np.isin(keys[slice(*span)], list(self._until_us))
        return are_two

    def _overlap(self, objects: Objects, pairs: LongArray) -> BoolArray:
        """Tell which are deeper in each other than noise explains; where it is not known, it may explain anything."""
        sigma_m, settings = objects.shown.sigma_m, self._settings
        if not pairs.shape[1] or np.isnan(sigma_m).all():
            return np.zeros(pairs.shape[1], np.bool_)
        ends = objects.table.take(pairs, axis=1)
        noise_m = settings.sigma_factor * np.hypot(*sigma_m.take(objects.order).take(pairs))
        overlap: BoolArray = FreeSpace.of(ends).depth_m(ends) > np.maximum(noise_m, settings.margin_m)
        return overlap

    def _note(self, look: Look, keys: list[int]) -> None:
        if look.returned is not None or not (keys or self._since_us or self._until_us):
            return
        t_us, settings = look.t_us, self._settings
        since_us = {key: self._since_us.get(key, t_us) for key in keys}
        if look.observed is not None and self._since_us.keys() - since_us.keys():
            # Those of which one is not seen now may overlap still.
            unseen, first_us = set(look.serials[~look.observed].tolist()), t_us - settings.double_us
            old = ((key, us) for key, us in self._since_us.items() if us >= first_us)
            since_us |= {key: us for key, us in old if not unseen.isdisjoint((key >> 31, key & (2**31 - 1)))}
        self._since_us = since_us
        self._until_us = {key: us for key, us in self._until_us.items() if us > t_us}
        doubled = [key for key in keys if t_us - since_us[key] >= settings.place_dwell_us]
        self._until_us |= dict.fromkeys(doubled, t_us + settings.double_us)
