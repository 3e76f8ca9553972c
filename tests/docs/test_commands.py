"""Does the command line take every command that the README and the pages show?"""

import pytest

from tests.docs.commands import PAGES, block_commands, refusal, sentence_commands


def test_every_command_of_the_pages_is_one() -> None:
    blocks = [(one, True) for path in PAGES for one in block_commands(path)]
    sentences = [(one, False) for path in PAGES for one in sentence_commands(path)]
    refused = [(one, refusal(one.words, is_whole=is_whole)) for one, is_whole in blocks + sentences]
    assert [f"{one.place}: dyknow {' '.join(one.words)}: {said}" for one, said in refused if said] == []
    assert (len(blocks) > 60, len(sentences) > 40) == (True, True)


@pytest.mark.parametrize(
    "line",
    ["proces a.mp4 --log a.db", "events a.db --form csv", "draw a.mp4 a.db", "tracks a.db --format text"],
    ids=["command", "option", "missing", "value"],
)
def test_a_wrong_command_is_told(line: str) -> None:
    assert refusal(tuple(line.split()))


def test_a_command_in_a_sentence_may_be_short_but_not_wrong() -> None:
    assert refusal(("process", "...", "--kpl"), is_whole=False) == ""
    assert refusal(("process", "...", "--klp", "FILE"), is_whole=False).startswith("No such option")
