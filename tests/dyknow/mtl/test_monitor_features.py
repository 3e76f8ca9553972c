"""Which features monitors look at."""

from dyknow.mtl.parser import parse_monitors
from dyknow.mtl.structure import features_of


def test_features_are_found_in_every_part() -> None:
    text = (
        "monitor m per Car: p[?c] until[0s, 1s] (2 * q[?c] + r[car1] > s[?c] - 3 and forall ?d in Car: not t[?c, ?d])"
    )
    assert features_of(parse_monitors(text)) == {"p", "q", "r", "s", "t"}
