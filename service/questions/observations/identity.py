"""Who was a car? The links of its identity chain, what speaks for each, and the times at which nobody saw it.

A car is what it is by links, from a vision object up. The log holds their changes; here they are laid out as intervals,
with the verdict on each. Whatever stands between two intervals of the lowest level is time in which the car was hidden.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping

from msgspec import Struct
from msgspec.structs import replace

from dyknow.language.diagnostics import hinted
from service.errors import NotInLogError
from service.records.runs import RunRecord
from service.records.seen import CarRecord, LinkRecord
from service.store.log import EventLog

_LEVELS = ("world", "on_road", "car")
_SHOWN = 5  # names in a message


class IdentityLink(Struct, frozen=True):
    """A link by which a car was the car it was, during [start_us, end_us); `end_us` null: to the end of the run.

    Attributes
    ----------
    reason : why it ended, after the kind of change that ended it; empty while it has not.
    how : `established`, `reestablished`, or `joined` as a vision object of another sensor, and why.
    verdict : `validated`, `undecided`, `refuted`, or `open` if the run ended first; empty if the log does not say.
    score_nats : log likelihood ratio of this car against a new one; null where nothing was weighed.
    margin_nats, runner_up : how much likelier than the next best, and what that is; null and empty as above.
    hidden_us : since when the car had not been seen; null unless it was found again by this link.
    """

    level: str
    lower: str
    upper: str
    start_us: int
    end_us: int | None
    reason: str
    how: str = ""
    verdict: str = ""
    score_nats: float | None = None
    margin_nats: float | None = None
    runner_up: str = ""
    hidden_us: int | None = None


class CarIdentity(Struct, frozen=True):
    """A car with how sure its identity is.

    Attributes
    ----------
    vision_ids : of its vision objects, in the order in which they were linked to it; those refuted are left out.
    hidden_us : how long it was not seen in all, between two of them.
    undecided, refuted, open : links of its chain, by verdict.
    """

    car: str
    car_class: str
    first_us: int
    last_us: int
    vision_ids: tuple[str, ...]
    hidden_us: int
    undecided: int
    refuted: int
    open: int


def identities(log: EventLog, run_id: str) -> list[CarIdentity]:
    """List the cars of a run in the order of first sight, with how sure their identity is."""
    below = links_below(log, run_id)
    return [_identity(one, chain_of(below, one.car)) for one in log.cars(run_id)]


def links_of(log: EventLog, run: RunRecord, car: str) -> list[IdentityLink]:
    """List the links of the chain of a car, oldest first.

    Raises
    ------
    NotInLogError
        If the run has no such car.
    """
    check_car(log, run, car)
    return chain_of(links_below(log, run.id, [car]), car)


def check_car(log: EventLog, run: RunRecord, car: str) -> None:
    """Refuse a car that a run does not have, with the nearest that it has."""
    cars = [one.car for one in log.cars(run.id)]
    if car not in cars:
        known = ", ".join(cars[:_SHOWN]) + (", ..." if len(cars) > _SHOWN else "") if cars else "none"
        expected = f"run {run.id!r}: expected one of its {len(cars)} cars ({known}), got {car!r}"
        raise NotInLogError(expected + hinted(car, cars))


def links_below(log: EventLog, run_id: str, cars: Collection[str] | None = None) -> dict[str, list[IdentityLink]]:
    """List the links below every upper object of a run, oldest first; of some cars, those of their chains alone."""
    if cars is None:
        return _laid_out(log.links(run_id), {one.label: one.verdict for one in log.hypotheses(run_id)})
    changes: list[LinkRecord] = []
    pending, seen = set(cars), set(cars)
    while pending:
        found = list(log.links(run_id, uppers=pending))
        pending = {one.lower for one in found if one.lower} - seen
        seen |= pending
        changes += found
    labels = {one.label for one in changes if one.label}
    return _laid_out(changes, {one.label: one.verdict for one in log.hypotheses(run_id, labels=labels)})


def _laid_out(changes: Iterable[LinkRecord], verdicts: Mapping[str, str]) -> dict[str, list[IdentityLink]]:
    """Turn the changes of links into intervals, by upper object; those of one object come as they were decided."""
    found: dict[str, list[IdentityLink]] = {}
    for change in changes:
        links = found.setdefault(change.upper, [])
        if change.kind in ("established", "reestablished", "joined"):  # the last has no label
            links.append(_begun(change, verdicts.get(change.label, "open" if change.label else "")))
            continue
        # Links to vision objects of several sensors overlap; an object that ends with none has none in its row.
        for k, one in enumerate(links):
            if one.end_us is not None or change.lower not in ("", one.lower):
                continue
            if change.kind in ("validated", "undecided"):
                links[k] = replace(one, verdict=change.kind, **_weighed(change))
            else:
                links[k] = replace(one, end_us=change.t_us, reason=f"{change.kind}: {change.reason}")
    return found


def chain_of(below: Mapping[str, list[IdentityLink]], car: str, *, until_us: int | None = None) -> list[IdentityLink]:
    """Follow the links from a car down, oldest first, as far as they began by a time."""
    found: list[IdentityLink] = []
    pending, seen = [car], {car}
    while pending:
        links = [one for one in below.get(pending.pop(), ()) if until_us is None or one.start_us <= until_us]
        found += links
        pending += sorted({one.lower for one in links} - seen)
        seen.update(pending)
    return sorted(found, key=lambda one: (one.start_us, _LEVELS.index(one.level), one.upper))


def hidden_times(chain: Iterable[IdentityLink]) -> Iterator[tuple[int, int]]:
    """Give the times from when to when a car was not seen, though it was found again."""
    lost_us: int | None = None
    for link in chain:
        if link.level != "world":
            continue
        since_us = lost_us if link.hidden_us is None else link.hidden_us
        if link.verdict != "refuted":
            if since_us is not None and since_us < link.start_us:
                yield since_us, link.start_us
            lost_us = link.end_us if lost_us is None or link.end_us is None else max(lost_us, link.end_us)


def _begun(change: LinkRecord, verdict: str) -> IdentityLink:
    how = f"{change.kind}: {change.reason}" if change.reason else change.kind
    link = IdentityLink(change.level, change.lower, change.upper, change.t_us, None, "", how, verdict)
    return replace(link, hidden_us=change.hidden_us, **_weighed(change))


def _weighed(change: LinkRecord) -> dict[str, float | str | None]:
    return {one: getattr(change, one) for one in ("score_nats", "margin_nats", "runner_up")}


def _identity(car: CarRecord, chain: list[IdentityLink]) -> CarIdentity:
    seen = [one.lower for one in chain if one.level == "world" and one.verdict != "refuted"]
    counts = {verdict: sum(one.verdict == verdict for one in chain) for verdict in ("undecided", "refuted", "open")}
    hidden_us = sum(end_us - start_us for start_us, end_us in hidden_times(chain))
    ids = tuple(dict.fromkeys(seen))
    return CarIdentity(car.car, car.car_class, car.first_us, car.last_us, ids, hidden_us, **counts)
