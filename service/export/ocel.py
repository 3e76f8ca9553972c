"""Which events came to whom? An object-centric event log, OCEL 2.0 as JSON, for process mining.

An event has all its roles as relationships, and none of them has to be its case. A car is an object of its run, with
its class as type; what else fills a role, such as a road, is of type `other`. Objects and types stand behind the
events, so that these can be sent as they are read.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache

from service.export.json_items import Json, as_json, json_items
from service.questions.events.queries import decode_events
from service.records.events import EventRecord

_ATTRIBUTES = {"end": "time", "source": "string", "status": "string", "confidence": "float"}


def ocel(pages: Iterable[str], classes_of: Callable[[str], Mapping[str, str]]) -> Iterator[str]:
    """Write events, given as lines of JSON, as such a log.

    Parameters
    ----------
    classes_of : gives the class of each car of a run.
    """
    types, objects, classes = set[str](), dict[str, str](), cache(classes_of)

    def made(event: EventRecord) -> Json:
        types.add(event.type)
        names = {role: f"{event.run}/{actor}" for role, actor in event.roles.items()}
        for role, actor in event.roles.items():
            objects[names[role]] = classes(event.run).get(actor, "other")
        return {
            "id": event.id,
            "type": event.type,
            "time": event.start,
            "attributes": [{"name": name, "value": getattr(event, name)} for name in _ATTRIBUTES],
            "relationships": [{"objectId": name, "qualifier": role} for role, name in names.items()],
        }

    yield '{"events":['
    yield from json_items(as_json(made(event)) for lines in pages for event in decode_events(lines))
    attributes = [{"name": name, "type": kind} for name, kind in _ATTRIBUTES.items()]
    rest = {
        "objects": [{"id": one, "type": kind, "attributes": [], "relationships": []} for one, kind in objects.items()],
        "eventTypes": [{"name": one, "attributes": attributes} for one in sorted(types)],
        "objectTypes": [{"name": one, "attributes": []} for one in sorted({*objects.values()})],
    }
    yield f"\n],{as_json(rest)[1:]}\n"
