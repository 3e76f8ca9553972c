"""Does the command line take every command that the README and the pages show?"""

import pytest

from tests.docs.commands import PAGES, all_commands, block_commands, sentence_commands

COMMANDS = all_commands()
GROUPS = {name.split()[0] for name in COMMANDS if " " in name}


def refusal(words: tuple[str, ...], *, is_whole: bool = True) -> str:
    """Parse a command line without running it; say what is wrong with it, in a word or two.

    Parameters
    ----------
    is_whole : a command in a sentence may leave out what the sentence is not about.
    """
    count = 2 if words[0] in GROUPS else 1
    name, arguments = " ".join(words[:count]), list(words[count:])
    if name not in COMMANDS:
        return f"no command {name!r}"
    if not is_whole:
        arguments = [one for one in arguments if one != "..."]
        arguments += ["WORD"] if arguments and arguments[-1].startswith("--") else []
    try:
        COMMANDS[name].make_context(name, arguments).close()
    except Exception as error:
        if not is_whole and type(error).__name__ == "MissingParameter":
            return ""
        return getattr(error, "message", None) or str(error)
    return ""


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
