"""What linkage texts say, and what is said of wrong ones."""

import pytest

from anchoring.errors import LinkageError
from anchoring.hypotheses.adapter import load_linkage
from anchoring.hypotheses.conditions import Verdict
from anchoring.hypotheses.language import FLUENTS, default_text, read_linkage
from anchoring.linking.classes import CLASS_NAMES
from anchoring.settings import AnchoringSettings
from dyknow.language.diagnostics import Diagnostic

USUAL, TEXT = AnchoringSettings(), default_text()


def changed(old: str, new: str) -> str:
    assert old in TEXT, old
    return TEXT.replace(old, new, 1)


def findings(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(LinkageError) as raised:
        load_linkage(text, USUAL, name="my.linkage")
    return raised.value.diagnostics


# What is wrong between « and »: the text of the default file that is replaced, what stands there instead, what is said.
FAULTS = {
    "a strange character": ("visible and fits;", "visible «&» fits;", "L0101", "the character '&'", "write 'and'"),
    "a word misspelt": ("establish:", "«establsh»:", "L0102", "got 'establsh'", "did you mean 'establish'?"),
    "a statement misspelt": ("class van is", "«clas» van is", "L0102", "got 'clas'", "did you mean 'class'?"),
    "a word as a name": ("class van is", "class «link» is", "L0102", "expected a name after 'class'", "choose another"),
    "no unit": ("spread 0.8 m, width 1", "spread «0.8», width 1", "L0102", "a quantity such as 4.5 m after", ""),
    "no end": ("visible and fits;", "visible and fits", "L0102", "or ';' after 'fits', got 'maintain'", "end with ';'"),
    "an unknown class": ("class truck", "class «trck»", "L0201", "a class that DyKnow knows", "did you mean 'truck'?"),
    "an unknown parent": ("van is vehicle", "van is «vehcle»", "L0201", "a class from further above", "'vehicle'?"),
    "itself as a parent": ("van is vehicle", "van is «van»", "L0201", "a class from further above, got 'van'", ""),
    "a car per sensor": (
        "class van is vehicle",
        "class «van»: one vision_object per sensor",
        "L0201",
        "'world_object'",
        "",
    ),
    "another class per sensor": ("one vision_object per", "one «car» per", "L0201", "the lowest class, got 'car'", ""),
    "sensors twice": (
        "one vision_object per sensor",
        "one vision_object per sensor, «one vision_object per sensor»",
        "L0203",
        "a new norm",
        "",
    ),
    "a link that starts elsewhere": ("link world_object to", "link «vision_object» to", "L0201", "the link above", ""),
    "a link down": ("to on_road_object as", "to «vision_object» as", "L0201", "a class of objects above", ""),
    "an unknown setting": ("[establish_us,", "[«estblish_us»,", "L0202", "a setting of time", "'establish_us'?"),
    "a sum of other kinds": ("[swap_us + 1us,", "[swap_us + «1 m»,", "L0202", "expected a duration, got '1 m'", ""),
    "a product of what is no time": ("0.5 * swap_us", "0.5 * «swap_m»", "L0102", "a setting of time such as", ""),
    "a class twice": ("class van", "class «car»", "L0203", "a new class, got 'car' again", ""),
    "a norm twice": (", width 2.4 m spread", ", «length 2.4 m spread 0.4 m», width 2.4 m spread", "L0203", "norm", ""),
    "a name that ends in a digit": ("as car:", "as «car1»:", "L0208", "a name that ends in no digit, got 'car1'", ""),
    "a name twice": ("as r:", "as «w»:", "L0203", "a new name of objects, got 'w' again", ""),
    "a condition twice": (
        "    maintain:\n",
        "    «establish»: visible;\n    maintain:\n",
        "L0203",
        "a new condition",
        "",
    ),
    "a length in seconds": ("length 4.5 m", "length «4.5 s»", "L0301", "a length above 0 in m, got '4.5 s'", ""),
    "a spread of nothing": ("spread 0.8 m", "spread «0 m»", "L0301", "a length above 0 in m, got '0 m'", ""),
    "a width without end": ("width 1.8 m", f"width «{'9' * 400} m»", "L0301", "a width above 0 in m", ""),
    "a speed in metres": ("up to 80 m/s", "up to «80 m»", "L0301", "a speed above 0 in m/s or km/h, got '80 m'", ""),
    "a formula that is none": ("visible and fits", "visible and «and» fits", "F0102", "a formula after 'and'", "'and'"),
    "an unknown fluent": ("visible and fits", "visible and «fts»", "F0201", "a known feature, got 'fts'", "'fits'?"),
    "a window backwards": ("+ 1us, oo]", ", «1us»]", "F0301", "an end that is not before the start 100ms", ""),
}


@pytest.mark.parametrize(("old", "new", "code", "message", "hint"), FAULTS.values(), ids=FAULTS)
def test_fault_is_told_where_it_is(old: str, new: str, code: str, message: str, hint: str) -> None:
    marked = changed(old, new)
    text = marked.replace("«", "").replace("»", "")
    found, *_ = findings(text)
    assert (found.code, found.file) == (code, "my.linkage")
    assert message in found.message
    assert hint in found.hint
    if "«" in marked:
        before, _, rest = marked.partition("«")
        marks = rest.partition("»")[0]
        assert found.line == before.count("\n") + 1
        assert found.source_line[found.column - 1 : found.end_column - 1] == marks


def test_what_a_text_lacks_is_told() -> None:
    assert [(one.code, one.message) for one in findings("")] == [
        ("L0204", "expected links up to 'vehicle', got an end at 'vision_object'"),
        ("L0206", "expected a class with length and width, got none"),
    ]
    (found,) = findings(changed("    reestablish: on_road until[establish_us, oo] on_road;\n", ""))
    assert (found.code, found.message) == ("L0205", "expected 'reestablish' as well, got 2 conditions")
    assert [one.code for one in findings("class car")] == ["L0103"]


def test_all_faults_are_told_at_once() -> None:
    text = changed("class truck", "class trck").replace("visible and fits", "visible and fts")
    assert [one.code for one in findings(text)] == ["L0201", "F0201"]


def test_formulas_of_other_shapes_need_somebody_who_progresses_them() -> None:
    text = changed("visible and fits;", "eventually[0, 1s] (visible and fits);")
    assert load_linkage(text, USUAL).linkages[0].reestablish().progress(0, _all(fits=False)) is Verdict.UNKNOWN
    with pytest.raises(LinkageError, match=r"L0207.*expected a formula of a shape that is compiled"):
        read_linkage(text, USUAL)


def test_durations_are_those_of_the_settings() -> None:
    settings = AnchoringSettings(establish_us=250_000, swap_us=30_000)
    world = read_linkage(TEXT, settings).linkages[0]
    establish = world.establish()
    assert [establish.progress(t_us, _all()) for t_us in (0, 249_999, 250_000)] == [
        *[Verdict.UNKNOWN] * 2,
        Verdict.TRUE,
    ]
    for fluent, last_us in (("not_swapped", 15_000), ("same_heading", 30_000), ("same_size", 150_000)):
        maintain, wrong = world.maintain(), _all(**{fluent: False})
        told = [maintain.progress(t_us, wrong) for t_us in (0, last_us, last_us + 1)]
        assert told == [Verdict.UNKNOWN, Verdict.UNKNOWN, Verdict.FALSE]


def test_the_default_text_has_all_classes_of_cars() -> None:
    assert {one.name for one in read_linkage(TEXT, USUAL).classes} >= {*CLASS_NAMES} - {"unknown"}


def _all(**other: bool) -> dict[str, bool]:
    return dict.fromkeys(FLUENTS, True) | other
