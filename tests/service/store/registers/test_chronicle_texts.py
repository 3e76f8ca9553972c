"""Are the chronicle texts of a log kept, version by version?"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from service.errors import NotInLogError, VersionError
from service.store.log import open_log
from service.store.registers.chronicle_texts import ChronicleTexts
from tests.service.conftest import NewLog
from tests.service.logs import write_log


@pytest.fixture
def texts(new_log: NewLog) -> Iterator[ChronicleTexts]:
    with open_log(write_log(new_log(), [])) as log:
        yield ChronicleTexts(log)


def test_a_text_has_versions_that_stay(texts: ChronicleTexts) -> None:
    assert [texts.put("b", text, after).version for text, after in (("one", None), ("two", 1))] == [1, 2]
    assert texts.put("a", "other", None) == texts.current()[0]
    assert [(one.name, one.version, one.text) for one in texts.current()] == [("a", 1, "other"), ("b", 2, "two")]
    assert [(one.version, one.text) for one in texts.versions("b")] == [(1, "one"), (2, "two")]
    first, second = (one.made_us for one in texts.versions("b"))
    assert 0 < first <= second


def test_a_text_that_ended_is_kept_and_may_begin_again(texts: ChronicleTexts) -> None:
    texts.put("a", "one", None)
    assert texts.end("a", 1).version == 2
    assert texts.current() == []
    assert texts.put("a", "two", None).version == 3
    assert [one.text for one in texts.versions("a")] == ["one", None, "two"]


@pytest.mark.parametrize(("expected", "came"), [(None, "none"), (2, "version 2")])
def test_who_knows_another_version_changes_nothing(texts: ChronicleTexts, expected: int | None, came: str) -> None:
    texts.put("a", "one", None)
    with pytest.raises(VersionError, match=f"'a': expected {came} as the newest, got version 1"):
        texts.put("a", "two", expected)
    assert [one.text for one in texts.versions("a")] == ["one"]


def test_what_is_not_there_or_ended_cannot_end(texts: ChronicleTexts) -> None:
    with pytest.raises(VersionError, match="expected version 1 as the newest, got none"):
        texts.end("a", 1)
    texts.put("a", "one", None)
    texts.end("a", 1)
    with pytest.raises(VersionError, match="expected version 2 as the newest, got none"):
        texts.end("a", 2)


def test_an_unknown_name_has_no_versions(texts: ChronicleTexts) -> None:
    with pytest.raises(NotInLogError, match="expected one of its chronicle texts, got 'a'"):
        texts.versions("a")


def test_of_many_who_write_at_once_one_is_first(texts: ChronicleTexts) -> None:
    def put(number: int) -> int:
        try:
            return texts.put("a", str(number), None).version
        except VersionError:
            return 0

    with ThreadPoolExecutor(4) as pool:
        assert sorted(pool.map(put, range(8))) == [0] * 7 + [1]
