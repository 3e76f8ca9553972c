"""Monitors over traffic: what they see, what they tell while the pipeline runs, and what chronicles make of it."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from chronicles import library
from chronicles.errors import ChronicleError
from dyknow.errors import FormulaError
from dyknow.mtl.monitors import MonitorEvent
from qsr.relations import RELATIONS
from qsr.settings import RelationSettings
from service.errors import InputError, NotInLogError
from service.questions.events.queries import EventFilter
from service.questions.recognition.explaining import AbsenceQuestion, Explainer
from service.questions.recognition.stored_monitoring import monitor_log
from service.questions.recognition.stored_recognition import recognise_stored
from service.records.events import EventRecord
from service.runs.processing import RunRequest, process
from service.store.log import open_log
from service.texts.monitor_files import load_monitor_files
from service.texts.monitored_features import CAR_FEATURES, SIGNATURE
from tests.service.logs import SECOND_US, read_all
from tests.service.tracks import HEADER

LIMIT = "monitor limit per ?car in Car: always speed[?car] < 15 m/s\n"
APART = (
    "monitor apart per ?a in Car, ?b in Car: always (beside[?a, ?b] implies eventually[0s, 2s] not beside[?a, ?b])\n"
)


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


# ---- texts


def test_every_relation_and_feature_has_a_kind_and_a_number_of_arguments() -> None:
    assert SIGNATURE.features.keys() == {*CAR_FEATURES, *(one.name for one in RELATIONS)}


def test_an_unknown_feature_is_refused_with_the_nearest_name(tmp_path: Path) -> None:
    path = written(tmp_path, "a.monitors", LIMIT.replace("speed[", "spead["))
    with pytest.raises(FormulaError, match=r"expected a known feature, got 'spead'(.|\n)*did you mean 'speed'\?"):
        load_monitor_files([path])


def test_an_unknown_sort_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormulaError, match="expected a known sort, got 'Cat'"):
        load_monitor_files([written(tmp_path, "a.monitors", LIMIT.replace("Car:", "Cat:"))])


def test_values_of_different_kinds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormulaError, match=r"expected a speed, as 'speed.*' is, got a length"):
        load_monitor_files([written(tmp_path, "a.monitors", LIMIT.replace("m/s", "m"))])


def test_a_file_without_a_monitor_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected at least one monitor, got none"):
        load_monitor_files([written(tmp_path, "a.monitors", "# nothing\n")])


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (LIMIT, "1:9"),
        ("# monitor limit\n" + APART + "  monitor # a\n  limit per ?car in Car: always moving[?car]\n", "4:3"),
    ],
    ids=["first", "in_pieces"],
)
def test_names_are_shared_by_all_files(tmp_path: Path, text: str, place: str) -> None:
    paths = [written(tmp_path, "a.monitors", LIMIT), written(tmp_path, "b.monitors", text)]
    with pytest.raises(
        FormulaError,
        match=rf"expected a new name of a monitor, got 'limit' as in .*a.monitors\n --> .*b.monitors:{place}\n",
    ):
        load_monitor_files(paths)


def test_what_monitors_look_at_is_known_without_running_them(tmp_path: Path) -> None:
    loaded = load_monitor_files([written(tmp_path, "a.monitors", LIMIT + APART)])
    assert (loaded.features, loaded.relations) == ({"speed", "beside"}, {"beside"})


# ---- runs


def write_race(path: Path, frames: int = 120) -> Path:
    """Write two cars that drive east ten times a second: fast passes slow, with a pause beside it from 3 s to 7 s."""
    rows = [HEADER]
    for k in range(frames):
        t_s = k / 10
        is_paused = 3 <= t_s < 7
        lead_m = -20 + 6 * min(t_s, 3) + 6 * max(0.0, t_s - 7)
        rows.append(f"{100_000 * k},slow,{10 * t_s},0.0,0.0,10,4.5,1.8")
        rows.append(f"{100_000 * k},fast,{10 * t_s + lead_m},3.0,0.0,{10 if is_paused else 16},4.5,1.8")
    path.write_text("\n".join([*rows, ""]))
    return path


def run_race(folder: Path, monitors: str, chronicle: str = "", site: Path | None = None) -> str:
    """Process the race, where fast becomes car1; return the log's URL."""
    url = f"sqlite:///{folder / 'log.db'}"
    request = RunRequest(
        input=write_race(folder / "race.csv"),
        site=site,
        log_url=url,
        chronicle_files=(written(folder, "a.chronicle", chronicle),) if chronicle else (),
        monitor_files=(written(folder, "a.monitors", monitors),) if monitors else (),
        again=True,
    )
    process(request)
    return url


def told(events: Sequence[MonitorEvent]) -> list[tuple[str, str, dict[str, str], int, int]]:
    return [(one.name, one.version, dict(one.roles), one.since_us, one.t_us) for one in events]


def stored(event: EventRecord) -> tuple[str, str, dict[str, str], int, int]:
    return event.type, event.chronicle.version, event.roles, event.sub_events[0].t_us, event.start_us


def test_a_violation_is_an_event_of_the_log(tmp_path: Path) -> None:
    url = run_race(tmp_path, LIMIT)
    first, second = read_all(url, EventFilter(types=("limit_violated",), actors=("car1",)))
    assert first.start_us < SECOND_US  # as soon as fast is a car
    assert second.start_us == second.end_us == 7 * SECOND_US
    assert second.recognised_us == second.start_us + RelationSettings().backdate_us
    assert (second.chronicle.name, second.status, second.hypotheses) == ("limit", "recognised", ())
    assert [(part.label, part.t_us) for part in second.sub_events] == [
        ("since", 3 * SECOND_US),
        ("violated", 7 * SECOND_US),
    ]
    assert second.place is not None
    assert second.place.x_m == pytest.approx(68.0, abs=0.5)


@pytest.mark.long
def test_the_run_keeps_the_texts_of_its_monitors_and_is_another_one_without(tmp_path: Path) -> None:
    with open_log(run_race(tmp_path, LIMIT)) as log:
        monitored = log.run()
    with open_log(run_race(tmp_path, "")) as log:
        ids = {one.id for one in log.runs()}
    assert [one.text for one in monitored.monitors] == [LIMIT.strip()]
    assert len(ids) == 2


@pytest.mark.long
def test_deadlines_count_from_the_state_where_the_relation_began(tmp_path: Path) -> None:
    events = read_all(run_race(tmp_path, APART), EventFilter(types=("apart_violated",)))
    # The tail of slow was reached between the frames at 2.5 s and 2.6 s.
    assert [(one.start_us, one.roles) for one in events] == [
        (4_600_000, {"a": "car1", "b": "car2"}),
        (4_600_000, {"a": "car2", "b": "car1"}),
    ]


@pytest.mark.long
def test_a_chronicle_looks_at_violations_in_the_same_run(tmp_path: Path) -> None:
    chronicle = """
        message limit_violated[?car] { ?car in Car }
        chronicle races_by[?car, ?other](t1, t2, t3) {
            event(beside[?car, ?other]:(false, true), t1)
            event(limit_violated[?car], t2)
            event(beside[?car, ?other]:(true, false), t3)
            t1 < t2  t2 < t3  t3 - t1 in [0s, 9s]
        }
    """
    url = run_race(tmp_path, LIMIT, chronicle)
    [found] = read_all(url, EventFilter(types=("races_by",)))
    assert found.roles == {"car": "car1", "other": "car2"}
    assert found.sub_events[1].t_us == 7 * SECOND_US


@pytest.mark.long
def test_changes_outside_a_declared_domain_are_counted_in_the_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = library.relations_text()
    declared = shipped.replace("attribute beside[?a, ?b] { ?a in Car", "attribute beside[?a, ?b] { ?a in {car77}")
    monkeypatch.setattr(library, "relations_text", lambda: declared)
    chronicle = "chronicle begins[?car, ?other](t1) { event(beside[?car, ?other]:(false, true), t1) }"
    request = RunRequest(
        input=write_race(tmp_path / "race.csv"),
        site=None,
        log_url=f"sqlite:///{tmp_path / 'log.db'}",
        chronicle_files=(written(tmp_path, "a.chronicle", chronicle),),
    )
    [told] = [one for one in process(request).warnings if "domain" in one]
    assert told.startswith("race.csv: expected values of 'beside' inside their domains, got ")


def test_a_chronicle_that_no_verdict_could_match_is_refused(tmp_path: Path) -> None:
    chronicle = "message limit_violated[?a, ?b] chronicle late[?a](t1) { event(limit_violated[?a, car2], t1) }"
    with pytest.raises(ChronicleError, match="expected 1 argument of 'limit_violated', as its monitor has, got 2"):
        run_race(tmp_path, LIMIT, chronicle)
    assert not (tmp_path / "log.db").exists()


def test_a_monitor_with_the_name_of_a_chronicle_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="monitor 'overtake': expected a name that no chronicle has, got that of one"):
        run_race(tmp_path, LIMIT.replace("limit", "overtake"))


def test_a_chronicle_that_gives_the_event_of_a_monitor_is_refused(tmp_path: Path) -> None:
    chronicle = "chronicle limit_violated[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }"
    with pytest.raises(InputError, match="expected names of events that no monitor gives, got 'limit_violated'"):
        run_race(tmp_path, LIMIT, chronicle)


@pytest.mark.long
def test_what_rests_on_a_verdict_can_be_explained_and_found_again(tmp_path: Path) -> None:
    chronicle = "message limit_violated[?car] chronicle late[?car](t1) { event(limit_violated[?car], t1) }"
    url = run_race(tmp_path, LIMIT, chronicle)
    first, _ = read_all(url, EventFilter(types=("late",)))
    [violated, _] = read_all(url, EventFilter(types=("limit_violated",)))
    with open_log(url) as log:
        explained = Explainer(log).explain_event(first.id)
        assert explained is not None
        assert [one.event.t_us for one in explained.explanation.events] == [violated.start_us]
        with pytest.raises(NotInLogError, match="expected one of a chronicle, got one of the monitor 'limit'"):
            Explainer(log).explain_event(violated.id)
    for lateness_us in (None, RelationSettings().backdate_us):
        found = recognise_stored(url, [tmp_path / "a.chronicle"], lateness_us=lateness_us)
        assert ([one.event.roles for one in found.events], found.late_count) == ([{"car": "car1"}] * 2, 0)


def test_verdicts_on_the_last_states_still_reach_chronicles(tmp_path: Path) -> None:
    text = "monitor limit per ?car in Car: always (speed[?car] < 15 m/s or x[?car] < 140 m)\n"
    chronicle = "message limit_violated[?car] chronicle late[?car](t1) { event(limit_violated[?car], t1) }"
    url = run_race(tmp_path, text, chronicle)
    late, violated = sorted(read_all(url), key=lambda one: one.type)
    assert (late.type, violated.type) == ("late", "limit_violated")
    assert late.start_us == violated.start_us == 11_500_000
    with open_log(url) as log:  # no frame was left that could have told it
        assert violated.start_us + RelationSettings().backdate_us > log.last_us(log.run().id)


@pytest.mark.long
def test_monitors_tell_the_same_of_the_log_as_they_told_in_the_run(tmp_path: Path) -> None:
    text = LIMIT + APART + "monitor near per ?a in Car, ?b in Car: eventually close[?a, ?b]\n"
    url = run_race(tmp_path, text)
    names = ("limit_violated", "apart_violated", "near_satisfied")
    live = sorted((stored(one) for one in read_all(url, EventFilter(types=names))), key=repr)
    found = monitor_log(url, [tmp_path / "a.monitors"])
    assert sorted(told(found.events), key=repr) == live
    assert len(live) == 6
    assert [(one.monitor, one.violated, one.satisfied) for one in found.report] == [
        ("limit", 2, 0),
        ("apart", 2, 0),
        ("near", 0, 2),
    ]


@pytest.mark.long
@pytest.mark.parametrize("late_us", [0, 300_000, 2_000_000, 5_000_000])
def test_what_is_asked_of_a_run_goes_by_its_own_lateness(tmp_path: Path, late_us: int) -> None:
    site = written(tmp_path, "site.toml", f"name = 'race'\n[relations]\nbackdate_us = {late_us}\n")
    chronicle = """message limit_violated[?car]
chronicle late[?car](t1) { event(limit_violated[?car], t1) }
chronicle near[?a, ?b](t1, t2) {
    event(limit_violated[?a], t1) event(beside[?a, ?b]:(false, true), t2) t2 - t1 in ]0s, 12s]
}
"""
    url = run_race(tmp_path, LIMIT + APART, chronicle, site)
    told_live = [one for one in read_all(url) if one.chronicle.name in ("late", "near")]
    assert {one.type for one in told_live} == {"late", "near"}
    first = min((one for one in told_live if one.type == "late"), key=lambda one: one.start_us)
    assert first.recognised_us - first.start_us == late_us
    found = recognise_stored(url, [tmp_path / "a.chronicle"]).events
    assert sorted((one.event.type, one.event.start_us, one.event.end_us) for one in found) == sorted(
        (one.type, one.start_us, one.end_us) for one in told_live
    )
    names = ("limit_violated", "apart_violated")
    live = sorted((stored(one) for one in read_all(url, EventFilter(types=names))), key=repr)
    assert sorted(told(monitor_log(url, [tmp_path / "a.monitors"]).events), key=repr) == live != []
    with open_log(url) as log:
        assert log.run().settings.get("relations.backdate_us", "2000000") == str(late_us)
        explainer = Explainer(log)
        for one in told_live:
            explained = explainer.explain_event(one.id)
            assert explained is not None
            assert explained.explanation.events
            found_again = explainer.explain_absence(AbsenceQuestion(chronicle=one.type, roles=one.roles)).recognised
            assert found_again == sum((each.type, each.roles) == (one.type, one.roles) for each in told_live)


@pytest.mark.long
@pytest.mark.parametrize("again", [[], [200], [200, 201], [200, 210], [200, 240], [200, 240, 280]])
def test_after_a_gap_the_log_tells_the_same_as_the_run(tmp_path: Path, again: list[int]) -> None:
    """Deadlines pass while no frame comes; the run is told the time of its last frame before the end."""
    windows = ("5s", "15s", "17s", "30s")
    formula = "monitor far{0} per ?car in Car: always eventually[0s, {0}] x[?car] > 1 km\n"
    text = "".join(formula.format(window) for window in windows)
    rows = [f"{100_000 * k},a,{k},0,0,10,4.5,1.8" for k in [*range(40), *again]]
    (tmp_path / "gap.csv").write_text("\n".join([HEADER, *rows, ""]))
    monitors, log = written(tmp_path, "a.monitors", text), str(tmp_path / "log.db")
    process(RunRequest(tmp_path / "gap.csv", None, log, monitor_files=(monitors,)))
    found = told(monitor_log(log, [monitors]).events)
    for window in windows:
        name = f"far{window}_violated"
        live = [stored(one) for one in read_all(f"sqlite:///{log}", EventFilter(types=(name,)))]
        assert [one for one in found if one[0] == name] == live
        assert bool(live) is (window != "30s" and bool(again)), window


@pytest.mark.long
@pytest.mark.parametrize(("jump_at", "expected"), [(14, []), (60, [("car1", "car2"), ("car2", "car1")])])
def test_nobody_violates_anything_by_a_link_that_is_refuted(
    tmp_path: Path, jump_at: int, expected: list[tuple[str, str]]
) -> None:
    log = str(tmp_path / "log.db")
    monitors = written(tmp_path, "a.monitors", "monitor aloof per ?a in Car, ?b in Car: always not close[?a, ?b]\n")
    process(RunRequest(write_jump(tmp_path / "jump.csv", jump_at), None, log, monitor_files=(monitors,)))
    events = read_all(f"sqlite:///{log}", EventFilter(types=("aloof_violated",)))
    assert [tuple(one.roles.values()) for one in events] == expected
    assert told(monitor_log(log, [monitors]).events) == [stored(one) for one in events]


def write_jump(path: Path, jump_at: int) -> Path:
    """Write two cars that drive in a row; the tracker's second one jumps far ahead in a frame, if ever."""
    rows = [HEADER]
    for k in range(60):
        rows.append(f"{100_000 * k},a,{k},0,0,10,4.5,1.8")
        rows.append(f"{100_000 * k},b,{k + (310 if k >= jump_at else 10)},0,0,10,4.5,1.8")
    path.write_text("\n".join([*rows, ""]))
    return path


@pytest.mark.long
def test_a_relation_that_was_not_watched_is_computed(tmp_path: Path) -> None:
    for name in ("asked", "watched"):
        (tmp_path / name).mkdir()
    asked = run_race(tmp_path / "asked", "", "chronicle near[?a, ?b](t1) { event(close[?a, ?b]:(false, true), t1) }")
    watched = run_race(tmp_path / "watched", APART)
    monitors = [written(tmp_path, "b.monitors", APART)]
    found = told(monitor_log(asked, monitors).events)
    assert found == told(monitor_log(watched, monitors).events)
    assert found


@pytest.mark.long
def test_roads_are_refused_where_there_are_none(tmp_path: Path) -> None:
    text = "monitor on per ?car in Car: always on_road[?car]\n"
    with pytest.raises(InputError, match=r"race.csv: expected roads, which the monitors need for on_road, got none"):
        run_race(tmp_path, text)
    assert not (tmp_path / "log.db").exists()
    url = run_race(tmp_path, "")
    with pytest.raises(InputError, match="expected roads"):
        monitor_log(url, [written(tmp_path, "b.monitors", text)])
