"""Which start of a track is which lost car? One joint choice, and of it only what is clear.

Evidence is given for pairs; a start that is no lost car is a new one, at no gain and no loss. All pairs that hang
together are decided together, and a pair only counts if every other choice would lose a margin: with two cars equally
likely nothing is linked, since a wrong link tells lies about two cars.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra, min_weight_full_bipartite_matching

from anchoring.observations import BoolArray, FloatArray, LongArray

# No margin is told larger: at e^10 to 1 a choice is clear to anybody, and looking farther costs time.
MOST_MARGIN = 10.0


@dataclass(frozen=True, slots=True)
class Evidence:
    """Hold what speaks for pairs of starts and ends of tracks; entry k of every array belongs to pair k.

    Attributes
    ----------
    starts, ends : (p,) which start and which end; no pair comes twice.
    ratios : (p,) log likelihood ratio, nats: the start is that lost car, against: a new car has come.
    """

    starts: LongArray
    ends: LongArray
    ratios: FloatArray

    def select(self, chosen: BoolArray | LongArray) -> "Evidence":
        """Take some of the pairs."""
        return Evidence(self.starts[chosen], self.ends[chosen], self.ratios[chosen])


def choose(evidence: Evidence) -> tuple[LongArray, FloatArray]:
    """Choose the pairs, one to one, whose ratios sum up to the most.

    Returns
    -------
    (k,) indices of pairs, and (k,) how much the sum would be less without each, at most `MOST_MARGIN`.

    Examples
    --------
    >>> def chosen(*pairs):
    ...     starts, ends, ratios = zip(*pairs)
    ...     return [one.tolist() for one in choose(Evidence(np.array(starts), np.array(ends), np.array(ratios)))]
    >>> chosen((0, 0, 4.0), (0, 1, 1.0), (1, 1, 3.0))
    [[0, 2], [4.0, 3.0]]
    >>> chosen((0, 0, 4.0), (0, 1, 3.5))                      # either could be it
    [[0], [0.5]]
    """
    hopeful = (evidence.ratios > 0.0).nonzero()[0]
    if not len(hopeful):
        return hopeful, np.zeros(0)
    kept = evidence.select(hopeful)
    alone = np.arange(kept.starts.max() + 1)
    # Whoever stays alone does so at no gain in a place of its own; all gain 1 more, since no weight may be 0.
    gains = 1.0 + np.concatenate([kept.ratios, np.zeros(len(alone))])
    places = np.concatenate([kept.ends, kept.ends.max() + 1 + alone])
    table = csr_array((gains, (np.concatenate([kept.starts, alone]), places)))
    _, place = min_weight_full_bipartite_matching(table, maximize=True)
    chosen = (place[kept.starts] == kept.ends).nonzero()[0]
    return hopeful[chosen], _margins(kept, chosen)


def rivals(evidence: Evidence, chosen: LongArray) -> tuple[FloatArray, LongArray, LongArray]:
    """Find what is next best to a choice, one exchange away.

    Returns
    -------
    (p,) what taking each pair would lose, as its start and its end have to leave those chosen; inf for the chosen ones.
    And the pair that loses least of each start, and of each end; any where there is none.

    Examples
    --------
    >>> evidence = Evidence(np.array([0, 0, 1]), np.array([0, 1, 1]), np.array([5.0, 3.0, 1.0]))
    >>> [one.tolist() for one in rivals(evidence, np.array([0, 2]))]
    [[inf, 3.0, inf], [1, 2], [0, 1]]
    """
    losses, sides = -evidence.ratios, (evidence.starts, evidence.ends)
    for side in sides:
        gains = np.zeros(side.max(initial=-1) + 1)
        gains[side[chosen]] = evidence.ratios[chosen]
        losses += gains[side]
    losses[chosen] = np.inf
    by_start, by_end = (_least(side, losses) for side in sides)
    return losses, by_start, by_end


def _least(side: LongArray, losses: FloatArray) -> LongArray:
    least = np.full(side.max(initial=-1) + 1, np.inf)
    np.minimum.at(least, side, losses)
    pairs = (losses == least[side]).nonzero()[0]
    found = np.zeros(len(least), np.int64)
    found[side[pairs]] = pairs
    return found


def _margins(evidence: Evidence, chosen: LongArray) -> FloatArray:
    """Measure what the best choice without each chosen pair loses.

    Any other choice differs by cycles of exchanges: a start takes the end of another one, which takes that of a third
    one, or none. So the loss is the shortest cycle through the pair, in a graph of the chosen pairs and one node for
    all that stays alone. No cycle is shorter than 0, as the choice is the best one.
    """
    count = len(chosen)
    own = np.append(evidence.ratios[chosen], 0.0)  # at the end of all that stays alone
    sides = [np.full(side.max() + 1, count) for side in (evidence.starts, evidence.ends)]
    sides[0][evidence.starts[chosen]] = sides[1][evidence.ends[chosen]] = np.arange(count)
    # The start of one pair takes the end of another, which has to leave it.
    source, target = sides[0][evidence.starts], sides[1][evidence.ends]
    losses = own[source] - evidence.ratios
    # Whoever leaves its end may stay alone as well, and an end may be left by its start at no loss to others.
    reached = _shortest(np.zeros(count + 1), source, target, losses)
    margins: FloatArray = np.clip(reached + _shortest(own, target, source, losses), 0.0, MOST_MARGIN)[:count]
    # Without that node the graph falls apart, and shortest ways from everywhere are few. Seen from the loss of reaching
    # them, no step is negative and every cycle is as long as before.
    among = ((source != target) & (source < count) & (target < count)).nonzero()[0]
    source, target = source[among], target[among]
    steps = np.maximum(losses[among] + reached[source] - reached[target], 0.0)
    ways = dijkstra(csr_array((steps, (source, target)), shape=(count, count)), limit=MOST_MARGIN)
    np.minimum.at(margins, source, steps + ways[target, source])
    return margins


def _shortest(first: FloatArray, source: LongArray, target: LongArray, losses: FloatArray) -> FloatArray:
    """Go on from what is lost at first along steps until nothing is reached at less (Bellman and Ford)."""
    for _ in first:
        nearer = first.copy()
        np.minimum.at(nearer, target, first[source] + losses)
        if (nearer == first).all():
            break
        first = nearer
    return first
