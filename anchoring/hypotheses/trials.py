"""Which links may still turn out wrong, and when is a link believed? By its margin, and if nothing found fault with it.

A link may turn out to be wrong, and whatever was concluded from it with it. So every link is a *hypothesis* with a
label while it is on trial. A refutation after the trial speaks of what the two did lately, not of the time when they
were linked: it takes nothing back.
"""

from collections.abc import Iterable, Mapping

from anchoring.hypotheses.hypotheses import Weighing
from anchoring.observations import NEW, Level, LinkChange, LinkKind
from anchoring.settings import AnchoringSettings

_RANK: Mapping[Level, int] = {"world": 0, "on_road": 1, "car": 2}


class DoubtfulLinks:
    """Keep the labels of links that are not known to be right, by the cars above them.

    Examples
    --------
    >>> doubtful = DoubtfulLinks()
    >>> doubtful.take(LinkChange(0, "established", "world", "v1", "w1", "", "v1->w1#1"))
    >>> doubtful.take(LinkChange(0, "established", "car", "w1", "car1", "", "w1->car1#2"))
    >>> doubtful.by_car()
    {'car1': ('v1->w1#1', 'w1->car1#2')}
    >>> doubtful.believe("v1->w1#1")
    >>> doubtful.by_car()
    {'car1': ('w1->car1#2',)}
    """

    def __init__(self) -> None:
        self._labels: dict[tuple[Level, str], str] = {}  # by the upper object
        self._keys: dict[str, tuple[Level, str]] = {}  # by the label
        self._uppers: dict[str, tuple[Level, str]] = {}  # lower object, above the vision objects: what it is linked to

    def take(self, change: LinkChange) -> None:
        """Take the next change of a link."""
        if change.kind in ("validated", "undecided", "joined", "parted"):
            return
        key = change.level, change.upper
        self._keys.pop(self._labels.pop(key, ""), None)
        if change.kind in ("established", "reestablished"):
            self._labels[key] = change.label
            self._keys[change.label] = key
            if change.level != "world":
                self._uppers[change.lower] = key
        elif change.level != "world":
            self._uppers.pop(change.lower, None)

    def believe(self, label: str) -> None:
        """Take it that a link is right, or gone."""
        self._labels.pop(self._keys.pop(label, ("world", "")), None)

    def by_car(self) -> dict[str, tuple[str, ...]]:
        """Give the cars that rest on such links, and the labels of these, lowest link first."""
        found: dict[str, list[str]] = {}
        for key, label in sorted(self._labels.items(), key=lambda one: _RANK[one[0][0]]):
            above: tuple[Level, str] | None = key
            while above and above[0] != "car":
                above = self._uppers.get(above[1])
            if above:
                found.setdefault(above[1], []).append(label)
        return {car: tuple(labels) for car, labels in found.items()}


class Trials:
    """Put links on trial, and end their trials.

    What was weighed is on trial while something else may take its place; what was not, while the conditions of links
    may find fault with it. It is validated if its least margin was large enough, and undecided for good if not; a link
    that ends without being refuted is judged then.

    Attributes
    ----------
    validated, refuted, undecided : labels of the links that were judged in the last frame.
    doubtful : the links that are on trial or undecided.

    Examples
    --------
    >>> trials = Trials(AnchoringSettings())
    >>> link = LinkChange(0, "reestablished", "world", "v2", "w1", "", score_nats=6.0, margin_nats=4.0, runner_up=NEW)
    >>> [change.label for change in trials.judge(0, [link], {})]
    ['v2->w1#1']
    >>> trials.judge(1_000_000, [], {"w1": Weighing("w1", 6.0, 1.0, "v3")})      # v3 came, and may be it as well
    []
    >>> [(change.kind, change.margin_nats, change.runner_up) for change in trials.judge(4_000_000, [], {})]
    [('undecided', 1.0, 'v3')]
    >>> trials.undecided
    ('v2->w1#1',)
    """

    def __init__(self, settings: AnchoringSettings) -> None:
        self._settings = settings
        self._count = 0
        # By the upper object: how the link began, with the least margin that it ever had, and until when it is tried.
        self._open: dict[tuple[Level, str], tuple[LinkChange, int]] = {}
        self.doubtful = DoubtfulLinks()
        self.validated, self.refuted, self.undecided = tuple[str, ...](), tuple[str, ...](), tuple[str, ...]()

    def judge(self, t_us: int, changes: Iterable[LinkChange], weighed: Mapping[str, Weighing]) -> list[LinkChange]:
        """Take a frame's link changes in their order, and what was weighed again, by world object.

        Returns
        -------
        The changes with their labels, and among them the verdicts on links that were weighed.
        """
        self.validated = self.refuted = self.undecided = ()
        for upper, weighing in weighed.items():
            link, _ = self._open.get(("world", upper), (None, 0))
            if link and (link.margin_nats is None or weighing.margin_nats < link.margin_nats):
                self._try(link._replace(margin_nats=weighing.margin_nats, runner_up=weighing.runner_up))
        told: list[LinkChange] = []
        for change in changes:
            if change.kind not in ("joined", "parted"):
                told += self._end(t_us, change)
            begins = change.kind in ("established", "reestablished")
            told.append(self._begin(change) if begins else change)
            self.doubtful.take(told[-1])
        for key in [key for key, (_, until_us) in self._open.items() if until_us <= t_us]:
            told += self._verdict(t_us, self._open.pop(key)[0])
        return told

    def _begin(self, change: LinkChange) -> LinkChange:
        self._count += 1
        link = change._replace(label=f"{change.lower}->{change.upper}#{self._count}")
        self._try(link)
        return link

    def _try(self, link: LinkChange) -> None:
        """Put a link on trial: what something else may still take the place of stays open for that."""
        is_found = link.margin_nats is not None and link.kind == "reestablished"
        is_open = is_found or not self._is_clear(link)
        until_us = link.t_us + (self._settings.open_us if is_open else self._settings.trial_us)
        self._open[link.level, link.upper] = link, until_us

    def _is_clear(self, link: LinkChange) -> bool:
        return link.margin_nats is None or link.margin_nats >= self._settings.decided_nats

    def _end(self, t_us: int, change: LinkChange) -> list[LinkChange]:
        """End the trial of the link that a change ends."""
        link, _ = self._open.pop((change.level, change.upper), (None, 0))
        if link is None:
            return []
        if change.kind != "refuted":
            return self._verdict(t_us, link)
        self.refuted += (link.label,)
        return []

    def _verdict(self, t_us: int, link: LinkChange) -> list[LinkChange]:
        """Judge a link that nobody found fault with; tell it of those that were weighed."""
        kind: LinkKind = "validated" if self._is_clear(link) else "undecided"
        if kind == "validated":
            self.validated += (link.label,)
            self.doubtful.believe(link.label)
        else:
            self.undecided += (link.label,)
        if link.margin_nats is None:
            return []
        other = "a new car" if link.runner_up == NEW else link.runner_up
        nearness = "was likelier at times, by" if link.margin_nats < 0 else "was never nearer than"
        reason = f"{other} {nearness} {abs(link.margin_nats):.1f} nats"
        return [link._replace(t_us=t_us, kind=kind, reason=reason, hidden_us=None)]
