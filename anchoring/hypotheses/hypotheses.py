"""Which object is hypothesised to be which, and what must hold for that? Chains of links from vision object to car.

A link joins a lower object to an upper one. It is made when its *establish* condition becomes true (a new upper
object), or its *reestablish* condition (an upper object that had lost its lower one); it is broken when its
*maintain* condition becomes false. The upper object then stays, and may be linked again.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from anchoring.hypotheses.conditions import Condition, Maker, Verdict
from anchoring.observations import NEW, Level, LinkChange, LinkKind


@dataclass(frozen=True, slots=True)
class Linkage:
    """Describe one level: how links to its objects come and go.

    Attributes
    ----------
    level : of the upper objects.
    prefix : of their names.
    establish, reestablish, maintain : each makes a fresh condition for one link. Above the world objects,
        ``reestablish`` has no other object to choose from: it restores the link that was broken.
    """

    level: Level
    prefix: str
    establish: Maker
    reestablish: Maker
    maintain: Maker


@dataclass(slots=True, eq=False)
class Link:
    """Keep one link of a chain: hypothesised (no upper object yet), linked, or broken."""

    linkage: Linkage
    condition: Condition
    upper: str = ""
    is_linked: bool = False

    def join(self) -> None:
        """Link, and watch the maintain condition from here on."""
        self.is_linked = True
        self.condition = self.linkage.maintain()

    def part(self) -> None:
        """Break the link; the upper object stays."""
        self.is_linked = False
        self.condition = self.linkage.reestablish()


class Weighing(NamedTuple):
    """Say by how much it is likeliest that a vision object is one that was lost, or `NEW`; see `LinkChange`."""

    said: str
    score_nats: float | None
    margin_nats: float
    runner_up: str

    def of(self, said: str) -> "Weighing":
        """Say the same of something that may be less likely.

        Examples
        --------
        >>> Weighing("w1", 4.0, 2.5, "w2").of(NEW)
        Weighing(said='new', score_nats=None, margin_nats=-2.5, runner_up='w1')
        """
        return self if said == self.said else Weighing(said, None, -self.margin_nats, self.said)


class Chain:
    """Keep all links above one vision object, or above a world object that has none at the moment.

    Parameters
    ----------
    vision_id : the vision object.
    linkages : one a level, lowest first.

    Attributes
    ----------
    links : one a level, lowest first. world : the first of them.
    car_number : of the symbol; 0 before there is one.
    proposal : while nothing is established, the lost world object that it may be, with the condition of the link.
    weighing : the last one of its vision object; None if nothing was lost that it could be.
    """

    __slots__ = ("car_number", "links", "proposal", "vision_id", "weighing", "world")

    def __init__(self, vision_id: str, linkages: tuple[Linkage, ...]) -> None:
        self.vision_id = vision_id
        self.links = tuple([Link(linkage, linkage.establish()) for linkage in linkages])
        self.world = self.links[0]
        self.car_number = 0
        self.proposal: tuple[str, Condition] | None = None
        self.weighing: Weighing | None = None

    @property
    def car_id(self) -> str:
        """The car's symbol; "" before there is one."""
        return self.links[-1].upper

    @property
    def has_car(self) -> bool:
        """Tell whether every link above the world object holds."""
        return bool(self.world.upper) and all(link.is_linked for link in self.links[1:])

    @property
    def is_idle(self) -> bool:
        """Tell whether more states equal to the last one would change nothing."""
        return all(link.condition.is_idle for link in self._waiting())

    def progress(self, t_us: int, state: Mapping[str, bool], name: Callable[[Linkage], str]) -> Iterator[LinkChange]:
        """Take the next state, lowest level first, and make or break links.

        Parameters
        ----------
        t_us, state : as for a condition.
        name : gives out the next name of a level.
        """
        has_lower = True
        for link in self._waiting():
            verdict = link.condition.progress(t_us, state)
            if link.is_linked and verdict is Verdict.FALSE:
                link.part()
                failed = tuple(fluent for fluent, holds in state.items() if not holds and fluent != "fits")
                change = self.change(t_us, "refuted", link, f"no longer: {', '.join(failed)}")
                yield change._replace(failed=failed)
            elif not link.is_linked and verdict is Verdict.TRUE and has_lower:
                kind: LinkKind = "reestablished" if link.upper else "established"
                link.upper = link.upper or name(link.linkage)
                link.join()
                yield self.change(t_us, kind, link, "the establish condition became true")
            has_lower = has_lower and (link.is_linked or (link is self.world and bool(link.upper)))

    def lose(self, t_us: int, reason: str, *, kind: LinkKind = "lost") -> LinkChange:
        """Take the vision object away from the world object: it is gone, or was another thing all the time."""
        change = self.change(t_us, kind, self.world, reason)
        self.world.part()
        self.vision_id = ""
        return change

    def adopt(self, t_us: int, vision_id: str, reason: str, hidden_us: int | None = None) -> LinkChange:
        """Link another vision object to the world object, by what was weighed or by its name."""
        self.vision_id = vision_id
        self.world.join()
        return self.change(t_us, "reestablished", self.world, reason, hidden_us)

    def revive(self, t_us: int, vision_id: str, reason: str) -> Iterator[LinkChange]:
        """Link every upper object again that was linked when all of them ended, lowest first."""
        self.weighing = None
        yield self.adopt(t_us, vision_id, reason)
        for link in self.links[1:]:
            if link.is_linked:
                link.join()
                yield self.change(t_us, "reestablished", link, reason)

    def end(self, t_us: int, reason: str) -> Iterator[LinkChange]:
        """End every upper object, highest first."""
        for link in reversed(self.links):
            if link.upper:
                yield self.change(t_us, "ended", link, reason)

    def change(self, t_us: int, kind: LinkKind, link: Link, reason: str, hidden_us: int | None = None) -> LinkChange:
        """Describe what has just happened to a link."""
        level = self.links.index(link)
        lower = self.links[level - 1].upper if level else self.vision_id
        weighed: tuple[float | None, float | None, str] = (None, None, "")
        if self.weighing and not level and kind in ("established", "reestablished"):
            weighing = self.weighing.of(NEW if kind == "established" else link.upper)
            weighed = weighing.score_nats, weighing.margin_nats, weighing.runner_up
        return LinkChange(t_us, kind, link.linkage.level, lower, link.upper, reason, "", *weighed, hidden_us)

    def _waiting(self) -> tuple[Link, ...]:
        # A world object that has lost its vision object is linked again by the linker, which compares all pairs.
        return self.links[1:] if self.world.upper and not self.world.is_linked else self.links
