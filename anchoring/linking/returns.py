"""Which of what began lately is a car that was lost? All of it is weighed at once, with what it may be else."""

import numpy as np

from anchoring.hypotheses.hypotheses import Weighing
from anchoring.linking.births import Outline
from anchoring.linking.bodies import END, NOW, START, Bodies
from anchoring.linking.evidence import NewCars, weigh
from anchoring.linking.frame import Frame, RoadMap
from anchoring.linking.linker import MOST_MARGIN, Evidence, choose, rivals
from anchoring.observations import NEW, BoolArray, LongArray
from anchoring.settings import AnchoringSettings


def find_returns(
    bodies: Bodies, frame: Frame, is_new: BoolArray, *, outline: Outline, roads: RoadMap, settings: AnchoringSettings
) -> tuple[dict[int, int], dict[str, Weighing]]:
    """Find which vision objects that began lately are lost world objects, and note in their chains how likely it is.

    Parameters
    ----------
    bodies, frame : now; which bodies look like a lost car is noted in ``is_contested``.
    is_new : (n,) the bodies that are no world objects yet.
    outline : of the view.
    roads, settings : the ways, and what is likely.

    Returns
    -------
    Columns of vision objects and of the lost world objects that they clearly are; and what was weighed of world objects
    whose vision object began lately, by name.
    """
    is_open = frame.is_seen & (frame.t_us - bodies.states_us[START] <= settings.open_us)
    starts = (is_open | is_new).nonzero()[0]
    returned = (is_open & bodies.is_returned).nonzero()[0]
    lost = (bodies.is_established & ~frame.is_seen).nonzero()[0]
    ends = np.concatenate([lost, returned])
    bodies.is_contested[:] = False
    if not len(ends):
        return {}, {}
    begun = bodies.looks(starts, START)
    gone = bodies.looks(ends, np.repeat((NOW, END), (len(lost), len(returned))))
    births_per_m = outline.births_per_m(begun, bodies.was_clipped[START, starts], settings)
    new = NewCars(births_per_m, *bodies.usual_size_m())
    evidence = weigh(begun, gone, new, roads.routes.between(begun, gone), settings)
    bodies.is_contested[starts[evidence.starts[evidence.ratios > 0.0]]] = True
    bodies.is_contested &= is_new
    chosen, margins = choose(evidence)
    pairs = Evidence(starts[evidence.starts], ends[evidence.ends], evidence.ratios)
    clear = pairs.select(chosen[margins >= settings.margin_nats])
    found = zip(clear.starts.tolist(), clear.ends.tolist(), strict=True)
    weighed = _weighings(bodies, starts, pairs, dict(zip(chosen.tolist(), margins.tolist(), strict=True)))
    return {column: target for column, target in found if column != target}, weighed


def _weighings(bodies: Bodies, starts: LongArray, pairs: Evidence, margins: dict[int, float]) -> dict[str, Weighing]:
    """Keep how much likelier than all else it is what each vision object is taken for; margins are of chosen pairs."""
    losses, by_start, by_end = (one.tolist() for one in rivals(pairs, np.array([*margins], np.int64)))
    pair_starts, pair_ends, ratios = (one.tolist() for one in (pairs.starts, pairs.ends, pairs.ratios))
    best = {pair_starts[pair]: pair for pair in margins}
    chains, possible, weighed = bodies.chains, set(pair_starts), dict[str, Weighing]()
    for column in starts.tolist():
        chain, upper = chains[column], chains[column].world.upper
        if column not in possible:
            if bodies.is_returned[column]:  # as its speed is surer now, it could not have come here
                weighed[upper] = Weighing(upper, None, -MOST_MARGIN, NEW)
            continue
        rival = by_start[column]
        loss_nats, runner_up = losses[rival], chains[pair_ends[rival]].world.upper
        if column in best:
            pair = best[column]
            target, ratio, other = pair_ends[pair], ratios[pair], by_end[pair_ends[pair]]
            others = (ratio, NEW), (loss_nats, runner_up), (losses[other], chains[pair_starts[other]].vision_id)
            chain.weighing = Weighing(chains[target].world.upper, ratio, margins[pair], min(others)[1])
        else:
            chain.weighing = Weighing(NEW, None, min(loss_nats, MOST_MARGIN), runner_up)
        if upper:
            weighed[upper] = chain.weighing.of(upper if bodies.is_returned[column] else NEW)
    return weighed
