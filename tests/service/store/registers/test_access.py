"""Are tokens made, kept as digests, listed and revoked, and is what was written listed?"""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from service.cli.app import run
from service.errors import NotInLogError, QueryError
from service.store import schema
from service.store.entries import SCOPES, Token, Written
from service.store.log import open_log
from service.store.registers.access import digest_of, list_tokens, list_written, make_token, note_written, revoke_token
from tests.service.conftest import NewLog
from tests.service.logs import write_log


def test_a_token_is_kept_as_a_digest_until_it_is_revoked(new_log: NewLog) -> None:
    with open_log(write_log(new_log(), [])) as log:
        secret = make_token(log, "office", "write", now_us=5, expires_us=9)
        assert len(secret.removeprefix("dyknow_")) >= 43  # 256 bits in base64
        assert list_tokens(log) == [Token("office", digest_of(secret), "write", 5, 9)]
        with log.connect() as connection:
            assert secret not in str(list(connection.execute(select(schema.tokens))))
        revoke_token(log, "office")
        assert list_tokens(log) == []


def test_names_of_tokens_are_plain_and_their_own(new_log: NewLog) -> None:
    with open_log(write_log(new_log(), [])) as log:
        make_token(log, "office", "read", now_us=0)
        with pytest.raises(QueryError, match="expected a name that is free, got 'office'"):
            make_token(log, "office", "admin", now_us=0)
        with pytest.raises(QueryError, match="expected a name of 1 to 64 letters"):
            make_token(log, "a b", "read", now_us=0)
        with pytest.raises(NotInLogError, match=r"expected one of its tokens, \['office'\], got 'police'"):
            revoke_token(log, "police")
        assert [one.scope for one in list_tokens(log)] == ["read"]


def test_a_token_allows_what_lesser_ones_do_until_it_ends() -> None:
    allowed = [[Token("a", "", own, 0).allows(asked) for asked in SCOPES] for own in SCOPES]
    assert allowed == [[True, False, False], [True, True, False], [True, True, True]]
    ends = Token("a", "", "read", 0, 10)
    assert [ends.is_valid(now_us) for now_us in (9, 10)] == [True, False]
    assert Token("a", "", "read", 0).is_valid(10**18)


def test_what_was_written_is_listed_the_newest_first(new_log: NewLog) -> None:
    rows = [Written(number, "office", "PUT", "/api/v1/x", 204, f"r{number}") for number in range(3)]
    with open_log(write_log(new_log(), [])) as log:
        for row in rows:
            note_written(log, row)
        assert list_written(log, limit=2) == [rows[2], rows[1]]


def test_tokens_and_the_audit_by_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = write_log(tmp_path / "a.db", [])

    def told(*words: str) -> Any:  # Any: JSON
        assert run([*words, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    assert run(["token", "make", url, "office", "--expires", "90d"]) == 0
    assert re.fullmatch(r"dyknow_[\w-]{43}\n", capsys.readouterr().out)
    made = told("token", "make", url, "police", "--scope", "admin")
    assert (made["scope"], made["expires_us"]) == ("admin", None)
    office, police = told("token", "list", url)["items"]
    assert office["expires_us"] - office["made_us"] == 90 * 86_400_000_000
    assert police == {"name": "police", "scope": "admin", "made_us": police["made_us"], "expires_us": None}
    assert run(["token", "list", url]) == 0
    assert re.findall(r"never$", capsys.readouterr().out, re.MULTILINE) == ["never"]
    assert told("token", "revoke", url, "office") == {"revoked": "office"}
    with open_log(url) as log:
        note_written(log, Written(0, "police", "PUT", "/api/v1/x", 204, "r1"))
    assert told("log", "audit", url)["items"][0]["token"] == "police"
    assert run(["log", "audit", url]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == [
        "1970-01-01T00:00:00.000000Z", "police", "PUT", "/api/v1/x", "204", "r1",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (
            ["make", "office", "--expires", "soon"],
            2,
            "error: --expires: expected an age such as 90d, 12h or 30min, got 'soon'",
        ),
        (["make", "office", "--scope", "all"], 2, "'all'"),
        (["make", "a b"], 2, "error: token: expected a name of 1 to 64 letters"),
        (["revoke", "office"], 3, "expected one of its tokens, [], got 'office'"),
    ],
)
def test_wrong_commands_about_tokens_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], code: int, said: str
) -> None:
    url = write_log(tmp_path / "a.db", [])
    assert run(["token", words[0], url, *words[1:]]) == code
    assert said in " ".join(capsys.readouterr().err.split())
