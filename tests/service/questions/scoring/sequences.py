"""Random tracks with every fault there is, as boxes in the image: for comparing scores with another program.

Nothing of ours is imported here, so that the other program's environment can make the same sequences.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SEEDS = (1, 2, 3, 4, 5, 6)
FRAMES = 120


@dataclass(frozen=True)
class BoxTracks:
    """Rows ordered by frame: frame (n,), track (n,) 0, 1, ..., box_px (n, 4) left, top, width, height."""

    frame: NDArray[np.int64]
    track: NDArray[np.int64]
    box_px: NDArray[np.float64]


def make_sequence(seed: int) -> tuple[BoxTracks, BoxTracks]:
    """Make true and found tracks: noise, misses, false boxes, swapped names, gaps, frames with nothing at all.

    Higher seeds are worse: more of every fault.
    """
    rng = np.random.default_rng(seed)
    objects, badness = 4 + 2 * seed, seed / max(SEEDS)
    start = rng.integers(0, FRAMES // 2, objects)
    end = start + rng.integers(FRAMES // 4, FRAMES // 2, objects)
    corner = rng.uniform(0, 160, (objects, 2))
    speed = rng.normal(0, 2.0, (objects, 2))
    size = rng.uniform(20, 60, (objects, 2))
    name = np.arange(objects)
    true, found = [], []
    next_name = objects
    for frame in range(FRAMES):
        present = np.flatnonzero((start <= frame) & (frame < end))
        if rng.random() < 0.05 * badness:
            present = present[:0]  # a frame of the truth without anything
        is_blind = rng.random() < 0.05 * badness  # nothing is found in this frame
        if len(present) > 1 and rng.random() < 0.2 * badness:
            one, other = rng.choice(present, 2, replace=False)
            name[[one, other]] = name[[other, one]]
        for which in present.tolist():
            box = np.concatenate((corner[which] + speed[which] * (frame - start[which]), size[which]))
            true.append((frame, which, *box))
            if rng.random() < 0.02 * badness:
                name[which], next_name = next_name, next_name + 1
            if not is_blind and rng.random() > 0.2 * badness:
                found.append((frame, int(name[which]), *(box + rng.normal(0, 1 + 5 * badness, 4))))
        for _ in range(0 if is_blind else rng.poisson(1.5 * badness)):
            found.append((frame, next_name, *rng.uniform(0, 160, 2), *rng.uniform(20, 60, 2)))
            next_name += rng.random() < 0.3
        next_name += 1
    return _tracks(true), _tracks(found)


def _tracks(rows: list[tuple[float, ...]]) -> BoxTracks:
    """Number the tracks without holes, and leave one row for each track and frame."""
    table = np.array(rows)
    _, first = np.unique(table[:, :2], axis=0, return_index=True)
    table = table[np.sort(first)]
    _, track = np.unique(table[:, 1], return_inverse=True)
    return BoxTracks(table[:, 0].astype(np.int64), track.astype(np.int64), table[:, 2:])
