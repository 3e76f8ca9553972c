"""Which start of a track is which lost car? One joint choice, and of it only what is clear.

Evidence is given for pairs; a start that is no lost car is a new one, at no gain and no loss. All pairs that hang
together are decided together, and a pair only counts if every other choice would lose a margin: with two cars equally
likely nothing is linked, since a wrong link tells lies about two cars.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import bellman_ford, connected_components, dijkstra

from anchoring.observations import BoolArray, FloatArray, IntArray, LongArray

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
    (starts, first), (ends, second) = (np.unique(side, return_inverse=True) for side in (kept.starts, kept.ends))
    count = len(starts)
    joined = coo_array((np.ones(len(hopeful)), (first, count + second)), shape=(count + len(ends),) * 2)
    _, group = connected_components(joined, directed=False)
    chosen, margins = list[LongArray](), list[FloatArray]()
    for pairs in _groups(group[first]):
        part = Evidence(first[pairs], second[pairs], kept.ratios[pairs])
        indices, lost = _choose_joined(part)
        chosen.append(hopeful[pairs[indices]])
        margins.append(lost)
    order = np.argsort(np.concatenate(chosen))
    return np.concatenate(chosen)[order], np.concatenate(margins)[order]


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
    order = np.lexsort((-losses, side))
    least = np.zeros(side.max(initial=-1) + 1, np.int64)
    least[side[order]] = order  # the last one stays
    return least


def _groups(labels: IntArray) -> list[LongArray]:
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.diff(labels[order]).nonzero()[0] + 1)


def _choose_joined(evidence: Evidence) -> tuple[LongArray, FloatArray]:
    """Choose among pairs that hang together."""
    if len(evidence.ratios) == 1:
        return np.zeros(1, np.int64), np.minimum(evidence.ratios, MOST_MARGIN)
    (starts, row), (ends, column) = (np.unique(side, return_inverse=True) for side in (evidence.starts, evidence.ends))
    gains = np.zeros((len(starts), len(ends)))
    number = np.full(gains.shape, -1)
    gains[row, column], number[row, column] = evidence.ratios, np.arange(len(row))
    rows, columns = linear_sum_assignment(gains, maximize=True)
    is_pair = number[rows, columns] >= 0
    chosen = number[rows[is_pair], columns[is_pair]]
    return chosen, _margins(gains, rows[is_pair], columns[is_pair])


def _margins(gains: FloatArray, rows: LongArray, columns: LongArray) -> FloatArray:
    """Measure what the best choice without each chosen pair loses.

    Any other choice differs by cycles of exchanges: a start takes the end of another one, which takes that of a third
    one, or none. So the loss is the shortest cycle through the pair, in a graph of the chosen pairs and one node for
    all that stays alone. No cycle is shorter than 0, as the choice is the best one.

    Parameters
    ----------
    gains : (s, l) >= 0, 0 where there is no evidence.
    rows, columns : (k,) the chosen pairs.
    """
    count = len(rows)
    own = gains[rows, columns]
    free_rows, free_columns = np.ones(len(gains), np.bool_), np.ones(gains.shape[1], np.bool_)
    free_rows[rows] = free_columns[columns] = False
    # steps[i, k]: what is lost where start i takes the end of start k, which has to leave it.
    steps = np.full((count + 1, count + 1), np.inf)
    taken = gains[np.ix_(rows, columns)]
    steps[:count, :count] = np.where(taken > 0.0, own[:, None] - taken, np.inf)
    steps[:count, count] = own - np.max(gains[rows][:, free_columns], axis=1, initial=0.0)
    steps[count, :count] = -np.max(gains[free_rows][:, columns], axis=0, initial=0.0)
    np.fill_diagonal(steps, np.inf)
    # Seen from the loss of reaching them, no step is negative and every cycle is as long as before.
    reached = bellman_ford(_graph(steps), indices=np.array(count))
    steps = np.maximum(steps + reached[:, None] - reached, 0.0)
    # From the last node everything is reached at no loss: a cycle over it is as long as the way there. Without it the
    # graph falls apart, and shortest ways from everywhere are few.
    alone = dijkstra(_graph(steps.T), indices=np.array(count), limit=MOST_MARGIN)[:count]
    among = steps[:count, :count]
    ways = dijkstra(_graph(among), limit=MOST_MARGIN)
    margins: FloatArray = np.minimum(np.minimum(alone, (ways + among.T).min(axis=1)), MOST_MARGIN)
    return margins


def _graph(steps: FloatArray) -> csr_array:
    source, target = np.isfinite(steps).nonzero()
    return csr_array((steps[source, target], (source, target)), shape=steps.shape)
