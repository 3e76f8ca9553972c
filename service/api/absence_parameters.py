"""Which parameters does `GET /api/v1/chronicles/{name}/why-not` take, and what do they mean?"""

from collections.abc import Mapping

from service.api.parameters import ROLE_PREFIX, JsonObject, Pairs
from service.errors import QueryError
from service.questions.explaining import MAX_NEAR_MISSES, AbsenceQuestion
from service.questions.queries import MAX_ROLES
from service.times import parse_media_us

_TEXT: JsonObject = {"type": "string"}
_MEDIA_TIME: JsonObject = {"type": "string", "examples": ["12500000", "12.5s", "01:23.5"]}
_DEFAULT_LIMIT = 5

PARAMETERS: Mapping[str, tuple[str, JsonObject]] = {
    "from": ("Start of the window, media time.", _MEDIA_TIME),
    "to": ("End of the window, excluded, media time.", _MEDIA_TIME),
    "run": ("Identifier of a run; may be left out if the log holds one.", _TEXT),
    "limit": (
        "Near misses at most.",
        {"type": "integer", "minimum": 1, "maximum": MAX_NEAR_MISSES, "default": _DEFAULT_LIMIT},
    ),
}


def read_absence_question(chronicle: str, pairs: Pairs) -> AbsenceQuestion:
    """Read the parameters of a request for near misses.

    Raises
    ------
    QueryError
        If a name is unknown or comes twice, or a value is malformed.

    Examples
    --------
    >>> question = read_absence_question("overtake", [("role.overtaker", "car7"), ("from", "5s")])
    >>> question.roles, question.start_us, question.limit
    ({'overtaker': 'car7'}, 5000000, 5)
    """
    values: dict[str, str] = {}
    for name, value in pairs:
        is_role = name.startswith(ROLE_PREFIX) and name != ROLE_PREFIX
        if not is_role and name not in PARAMETERS:
            raise QueryError(f"query: expected {', '.join(PARAMETERS)} or role.NAME, got {name!r}", parameter=name)
        if name in values:
            raise QueryError(f"{name}: expected one value, got {[values[name], value]!r}", parameter=name)
        values[name] = value
    roles = {name.removeprefix(ROLE_PREFIX): value for name, value in values.items() if name not in PARAMETERS}
    if len(roles) > MAX_ROLES:
        raise QueryError(f"role: expected at most {MAX_ROLES} roles, got {len(roles)}", parameter="role")
    return AbsenceQuestion(
        chronicle=chronicle,
        run=values.get("run"),
        roles=roles,
        start_us=_time(values, "from"),
        end_us=_time(values, "to"),
        limit=_limit(values),
    )


def describe_absence_parameters(*, name: str) -> list[JsonObject]:
    """Describe the parameters for OpenAPI; `name` is the part of the path that names the chronicle."""
    path: JsonObject = {"name": name, "in": "path", "required": True, "schema": _TEXT}
    described: list[JsonObject] = [
        {"name": one, "in": "query", "required": False, "description": description, "schema": schema}
        for one, (description, schema) in PARAMETERS.items()
    ]
    roles: JsonObject = {
        "type": "object",
        "patternProperties": {r"^role\..+$": _TEXT},
        "additionalProperties": False,
    }
    description = "The object that fills a role, as in `role.overtaker=car7`."
    role: JsonObject = {"name": "roles", "in": "query", "required": False, "description": description}
    return [path, *described, {**role, "style": "form", "explode": True, "schema": roles}]


def _time(values: Mapping[str, str], name: str) -> int | None:
    return parse_media_us(values[name], parameter=name) if name in values else None


def _limit(values: Mapping[str, str]) -> int:
    text = values.get("limit", str(_DEFAULT_LIMIT))
    if not (text.isascii() and text.isdigit() and len(text) <= 6 and 1 <= int(text) <= MAX_NEAR_MISSES):
        raise QueryError(f"limit: expected 1 to {MAX_NEAR_MISSES}, got {text!r}", parameter="limit")
    return int(text)
