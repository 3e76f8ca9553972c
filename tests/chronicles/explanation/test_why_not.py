"""What a near miss tells."""

import pytest

from chronicles import library
from chronicles.chronicle_set import load
from chronicles.errors import ChronicleError
from chronicles.explanation.explanations import CountReading, HoldReading, MissingEvent, NearMiss, WhyNot
from chronicles.explanation.why_not import why_not
from tests.chronicles.explanation.test_why import TWO_VISITS, VISITS, events_of

STAY = "chronicle stay[?car](t1, t2) { event(enter[?car], t1)  event(left[?car], t2)  t2 - t1 in [1s, 9s] }"
GIVEN = "message gives[?a, ?b] { ?a in Person ?b in Person } domain Person = symbol\n"


def asked(text: str, stream: str, **roles: str) -> WhyNot:
    chronicles = load(text)
    return why_not(chronicles, chronicles.names[-1], events_of(stream), roles=roles)


def nearest(text: str, stream: str, **roles: str) -> NearMiss:
    return asked(text, stream, **roles).near_misses[0]


def kinds(miss: NearMiss) -> list[str]:
    return [failure.kind for failure in miss.failures]


def test_broken_bound_is_told_with_the_least_change_that_mends_it() -> None:
    miss = nearest(STAY, "1s enter[a]\n11.5s left[a]")
    assert (kinds(miss), miss.unmet_count, miss.short_us) == (["bound"], 1, 1_500_000)
    assert miss.change is not None
    assert (miss.change.before, miss.change.after) == ("t2 - t1 in [1s, 9s]", "t2 - t1 in [1s, 10500ms]")


def test_bound_in_the_middle_of_a_long_chronicle_is_one_broken_statement() -> None:
    text = """chronicle chain[](t1, t4) {
      event(a[], t1)  event(b[], t2)  event(c[], t3)  event(d[], t4)
      0s <= t2 - t1 <= 2s   0s <= t3 - t2 <= 2s   0s <= t4 - t3 <= 2s
    }"""
    miss = nearest(text, "1s a[]\n2s b[]\n7s c[]\n8s d[]")
    assert (kinds(miss), miss.short_us, len(miss.events)) == (["bound"], 3_000_000, 4)
    assert miss.change is not None
    assert miss.change.after == "0s <= t3 - t2 <= 5s"


def test_equation_is_changed_to_what_it_was() -> None:
    text = "chronicle two[](t1) { event(a[], t1)  event(b[], t2)  t2 = t1 + 2s }"
    miss = nearest(text, "1s a[]\n2.5s b[]")
    assert miss.change is not None
    assert (miss.change.after, miss.change.size) == ("t2 = t1 + 1500ms", 500_000)


def test_missing_event_is_told_with_its_window() -> None:
    miss = nearest(STAY, "1s enter[a]\n60s enter[b]")
    [missing] = miss.missing
    assert (missing.label, missing.pattern) == ("t2", "left[a]")
    assert (missing.earliest_us, missing.latest_us) == (2_000_000, 10_000_000)
    assert (kinds(miss), miss.short_us, miss.change) == (["missing event"], None, None)


def test_missing_event_that_may_still_come_is_open() -> None:
    assert kinds(nearest(STAY, "1s enter[a]\n5s enter[b]")) == ["open"]


def test_missing_event_is_told_with_the_nearest_one_outside_its_window() -> None:
    text = """chronicle three[?x](t1) {
      event(a[?x], t1)  event(b[?x], t2)  event(c[?x], t3)
      t2 - t1 in [0s, 1s]  t3 - t2 in [0s, 1s]  t3 - t1 in [0s, 1s]
    }"""
    miss = nearest(text, "1s a[x]\n1.5s b[x]\n9s c[x]")
    [missing] = miss.missing
    assert (missing.label, missing.latest_us, missing.outside_us) == ("t3", 2_000_000, 7_000_000)


def test_event_with_another_value_is_told() -> None:
    text = "chronicle on[?x](t1, t2) { event(a[?x], t1)  event(lit[?x]:(off, on), t2)  t2 - t1 in [0s, 5s] }"
    miss = nearest(text, "1s a[x]\n2s lit[y] off -> on\n3s lit[x] unknown -> on\n60s a[z]", x="x")
    [missing] = miss.missing
    assert kinds(miss) == ["other value"]
    assert [(one.field, one.wanted, one.got) for one in missing.mismatches] == [("old value", "off", "unknown")]


def test_pattern_of_a_missing_event_has_all_known_values() -> None:
    text = """chronicle on[?x](t1, t2) {
      event(a[?x], t1)  event(lit[?y, ?kind, ?, "?x"]:(?, ?y), t2)  t2 - t1 in [0s, 5s]  ?y == ?x  ?kind == lamp
    }"""
    [missing] = nearest(text, "1s a[x]\n60s a[z]", x="x").missing
    assert missing.pattern == 'lit[x, lamp, ?, "?x"]:(?, x)'


def test_values_that_must_differ_are_told() -> None:
    text = (
        GIVEN + "chronicle given[?a, ?b](t1) { event(gives[?a, ?c], t1) event(gives[?c, ?b], t2) t2 - t1 in [0s, 5s] }"
    )
    miss = nearest(text, "1s gives[ann, bob]\n2s gives[bob, ann]\n60s gives[eve, eve]")
    assert kinds(miss) == ["same value"]


def test_hold_broken_by_a_change_is_told_with_the_change() -> None:
    text = STAY[:-1] + "hold(lit[?car]:on, (t1, t2)) }"
    miss = nearest(text, "0s lit[a] unknown -> on\n1s enter[a]\n4s lit[a] on -> off\n6s left[a]\n9s tick[]")
    [hold] = miss.obligations
    assert isinstance(hold, HoldReading)
    assert (kinds(miss), miss.failures[0].t_us) == (["hold"], 4_000_000)
    assert [(span.value, span.start_us) for span in hold.contrary] == [("off", 4_000_000)]
    assert miss.change is not None
    assert miss.change.after == "hold(lit[?car]:on, (t1, t2 - 2s))"


def test_unknown_value_is_no_evidence() -> None:
    miss = nearest(STAY[:-1] + "hold(lit[?car]:on, (t1, t2)) }", "1s enter[a]\n2s lit[b] off -> on\n3s left[a]")
    [hold] = miss.obligations
    assert isinstance(hold, HoldReading)
    assert ([span.value for span in hold.contrary], miss.change) == (["unknown"], None)


def test_value_that_only_a_hold_gives_is_told_with_what_it_could_have_been() -> None:
    text = STAY[:-1] + "hold(on[?car, ?road]:true, (t1, t2)) hold(free[?road]:true, (t1, t2)) }"
    stream = "0s on[a, e4] unknown -> true\n0s free[e5] unknown -> true\n1s enter[a]\n3s left[a]\n9s tick[]"
    holds = [one for one in nearest(text, stream).obligations if isinstance(one, HoldReading)]
    told = {one.subject: (one.outcome, one.alternatives) for one in holds}
    assert told == {"free[e4]": ("failed", ("free[e5]",)), "on[a, e4]": ("met", ())}


def test_role_that_only_a_hold_gives_can_be_asked_for() -> None:
    text = "chronicle on[?car, ?road](t1) { event(seen[?car], t1)  hold(on[?car, ?road]:true, (t1 - 1s, t1)) }"
    stream = "0s on[a, e4] unknown -> true\n5s seen[a]"
    assert asked(text, stream, road="e4").recognised == 1
    [hold] = nearest(text, stream, road="e5").obligations
    assert isinstance(hold, HoldReading)
    assert (hold.subject, hold.outcome, hold.alternatives) == ("on[a, e5]", "failed", ("on[a, e4]",))


def test_forbidden_event_is_told_and_the_interval_shrunk_behind_it() -> None:
    text = "chronicle alone[?x](t1) { event(a[?x], t1)  noevent(b[?], (t1, t1 + 5s)) }"
    miss = nearest(text, "1s a[x]\n5s b[y]\n60s tick[]")
    assert (kinds(miss), miss.failures[0].t_us) == (["noevent"], 5_000_000)
    assert miss.change is not None
    assert (miss.change.after, miss.change.size) == ("noevent(b[?], (t1, t1 + 4s))", 1_000_000)


def test_too_few_events_are_told_with_the_count() -> None:
    text = "chronicle busy[](t1) { event(a[], t1)  occurs((3, oo), b[?], (t1, t1 + 5s)) }"
    miss = nearest(text, "1s a[]\n2s b[x]\n3s b[y]\n60s a[]\n90s tick[]")
    [reading] = [one for one in miss.obligations if isinstance(one, CountReading)]
    assert (kinds(miss), len(reading.counted)) == (["occurs"], 2)
    assert miss.change is not None
    assert (miss.change.after, miss.change.unit) == ("occurs((2, oo), b[?], (t1, t1 + 5s))", "events")


def test_obligation_that_ends_after_the_events_is_open() -> None:
    text = "chronicle alone[?x](t1) { event(a[?x], t1)  noevent(b[?], (t1, t1 + 5s)) }"
    assert kinds(nearest(text, "1s a[x]\n3s tick[]")) == ["open"]
    chronicles = load(text)
    answer = why_not(chronicles, "alone", events_of("1s a[x]"), until_us=6_000_000)
    assert (answer.recognised, answer.near_misses) == (1, ())


def test_occurrence_ruled_out_by_a_selection_is_told() -> None:
    text = "chronicle pair[](t1, t2) { event(a[], t1)  event(b[], t2)  t2 - t1 in [0s, 9s]  select first(t1) }"
    answer = asked(text, "1s a[]\n2s b[]\n3s b[]\n60s tick[]")
    assert answer.recognised == 1
    assert kinds(answer.near_misses[0]) == ["not selected"]


def test_recognised_occurrences_are_counted_and_left_out() -> None:
    answer = asked(STAY, "1s enter[a]\n4s left[a]\n20s enter[b]\n30s left[b]")
    assert answer.recognised == 1
    assert [miss.roles[0].value for miss in answer.near_misses] == ["b"]


PASS = "chronicle pass[?a, ?b](t1, t2) { event(behind[?a, ?b], t1)  event(ahead[?a, ?b], t2)  t2 - t1 in [1s, 9s] }"
PASSED = "1s behind[a, b]\n1s ahead[b, a]\n4s ahead[a, b]\n4s behind[b, a]\n15s ahead[b, c]\n60s tick[]"


def test_what_was_recognised_is_not_told_with_its_roles_exchanged() -> None:
    answer = asked(PASS, PASSED)
    assert answer.recognised == 1
    told = [{role.name: role.value for role in miss.roles} for miss in answer.near_misses]
    assert {"a": "b", "b": "c"} in told
    assert {"a": "b", "b": "a"} not in told


def test_exchanged_roles_are_told_to_who_asks_for_them_and_at_another_time() -> None:
    assert asked(PASS, PASSED, a="b", b="a").near_misses
    later = PASSED.replace("60s", "40s behind[b, a]\n60s")
    times = [[one.event.t_us for one in miss.events] for miss in asked(PASS, later).near_misses]
    assert [40_000_000] in times


def test_nearest_comes_first() -> None:
    stream = "1s enter[a]\n12s left[a]\n20s enter[b]\n30s left[b]\n50s enter[c]\n90s tick[]"
    assert [miss.roles[0].value for miss in asked(STAY, stream).near_misses] == ["b", "a", "c"]


def test_roles_and_window_restrict_the_question() -> None:
    events = events_of("1s enter[a]\n12s left[a]\n20s enter[b]\n30s left[b]\n50s enter[a]\n60s left[a]")
    answer = why_not(load(STAY), "stay", events, roles={"car": "a"}, start_us=15_000_000)
    assert [[one.event.t_us for one in miss.events] for miss in answer.near_misses] == [[50_000_000, 60_000_000]]


def test_emitted_events_count_as_events() -> None:
    answer = asked(VISITS, TWO_VISITS.replace("80s leave", "500s leave"))
    [miss] = answer.near_misses
    [missing] = [failure.subject for failure in miss.failures]
    assert isinstance(missing, MissingEvent)
    assert missing.emitters == ("visit",)


def test_limit_restricts_the_number_of_near_misses() -> None:
    stream = "\n".join(f"{20 * index}s enter[c{index}]" for index in range(1, 9)) + "\n999s tick[]"
    answer = why_not(load(STAY), "stay", events_of(stream), limit=3)
    assert (len(answer.near_misses), answer.is_complete) == (3, True)


@pytest.mark.parametrize(
    ("roles", "message"),
    [
        ({"car": "a"}, r"roles of 'overtake': expected names out of \['overtaker', 'overtaken', 'road'\], got 'car'"),
        ({"overtaker": "a", "overtaken": "a"}, "to differ, got 'a' for both"),
    ],
)
def test_roles_that_cannot_be_are_refused(roles: dict[str, str], message: str) -> None:
    with pytest.raises(ChronicleError, match=message):
        why_not(library.load_library(["overtake"]), "overtake", [], roles=roles)


def test_nothing_at_all_is_told_as_all_events_missing() -> None:
    [miss] = why_not(load(STAY), "stay", []).near_misses
    assert [missing.label for missing in miss.missing] == ["t1", "t2"]


def test_limit_below_one_is_refused() -> None:
    with pytest.raises(ChronicleError, match="expected a limit >= 1, got 0"):
        why_not(load(STAY), "stay", [], limit=0)
