"""How many events does a run tell of times in which its camera did not know where it looked? There should be none."""

from dataclasses import dataclass

from service.questions.queries import EventFilter, decode_event, iterate_events
from service.store.log import EventLog, open_log


@dataclass(frozen=True, slots=True)
class LostViews:
    """Hold when the view was lost, and what was told of these times nevertheless.

    Attributes
    ----------
    losses_us : from when to when, half-open.
    told : identifiers of the events of which a part lies in one of them.
    events : how many events the run told in all.
    """

    losses_us: tuple[tuple[int, int], ...]
    told: tuple[str, ...]
    events: int

    @property
    def lost_s(self) -> float:
        """Return for how long the view was lost in all."""
        return sum(end_us - start_us for start_us, end_us in self.losses_us) / 1e6

    def as_record(self) -> dict[str, object]:
        """Return the figures as plain data, for JSON."""
        return {
            "losses": len(self.losses_us),
            "lost_s": self.lost_s,
            "events": self.events,
            "events_told": len(self.told),
            "told": list(self.told),
        }


def find_lost_views(url: str, *, run: str | None = None) -> LostViews | None:
    """Count the events that a run tells of times in which its view was lost.

    Parameters
    ----------
    url : the event log.
    run : which run of the log; may be left out when there is only one.

    Returns
    -------
    The counts; None for a run whose camera did not move.

    Raises
    ------
    LogError
        If the log or the run cannot be read.
    """
    with open_log(url) as log:
        run_id = log.run(run).id
        losses_us = _losses(log, run_id)
        if losses_us is None:
            return None
        events = [decode_event(text) for text in iterate_events(log, EventFilter(runs=(run_id,)))]
    told = tuple(event.id for event in events if _is_within(event.start_us, event.end_us, losses_us))
    return LostViews(losses_us, told, len(events))


def _losses(log: EventLog, run_id: str) -> tuple[tuple[int, int], ...] | None:
    """Read when the view was lost: from a row without a map to the next one with a map, or to the end of the run."""
    views = list(log.views(run_id))
    if not views:
        return None
    losses_us: list[tuple[int, int]] = []
    lost_us: int | None = None
    for view in views:
        if not view.pixel_from_ground:
            lost_us = view.t_us if lost_us is None else lost_us
        elif lost_us is not None:
            losses_us.append((lost_us, view.t_us))
            lost_us = None
    if lost_us is not None:
        losses_us.append((lost_us, max((t_us for _, t_us in log.frames(run_id)), default=views[-1].t_us)))
    return tuple(losses_us)


def _is_within(start_us: int, end_us: int, losses_us: tuple[tuple[int, int], ...]) -> bool:
    """Tell whether a part of an event lies in a loss; what ends with the loss's first moment does not."""
    return any(start_us < to_us and end_us > from_us for from_us, to_us in losses_us)
