"""Printing loses nothing, and what was printed is printed the same again."""

import random

from dyknow.kpl import model
from dyknow.kpl.model import Constraint, ConstraintKind, Label, Name, Specification, Term
from dyknow.kpl.parser import parse_kpl, parse_type
from dyknow.kpl.policies import parse_policy
from dyknow.kpl.printer import print_kpl
from dyknow.policies.policy import AnyChange, AnyUpdate, Approximation, Order, Policy, SampleEvery
from dyknow.streams.mediation import MediationKind
from tests.cases import for_each

EVERY_FORM = """sort Frame;
sort Point = <float, float>;
sort Track = set(<int, Point>);
object Car car1, car2;
feature int lights;
feature bool behind(Car, Car);
source Frame video;
compunit set(Point) points(Frame, Point);
configuration follow(set(string));
strmgen frames = video;
strmgen behind[car1, car2] = test(pos[car1] with any update, any order, pos[car2], map with oldest 2h);
strmgen near[car1] = selection of Point by chosen;
strmgen all = collection of set(Point) with any change, strict order by chosen[car1];
strmgen of = by(selection with to 5s, collection);
configure collected = follow(chosen with sample every 1s, max delay 0s);
sort Place = collected(<Point, collected(int)>);
stream a = frames with any change, no approximation, max delay 1500ms, from 90s to 2min, monotone order;
stream b = frames with sample every 200ms, use most recent, max delay oo, from now to oo, strict order;
stream c = frames with sample every 1us, linear interpolation, to 5s, max delay 0s;
"""
_TIMED = (ConstraintKind.SAMPLE_EVERY, ConstraintKind.OLDEST)
_MAYBE_TIMED = (ConstraintKind.MAX_DELAY, ConstraintKind.FROM, ConstraintKind.TO)


def test_every_form_is_printed_as_it_was_written() -> None:
    assert print_kpl(parse_kpl(EVERY_FORM)) == EVERY_FORM


def test_comments_spaces_and_units_do_not_matter() -> None:
    text = "stream a=pos with any update,# all of it\n // really\nmax delay 0.5 s , from 0\nto 60s;;"
    first, _, second = text.rpartition(";")
    assert print_kpl(parse_kpl(first + second)) == "stream a = pos with any update, max delay 500ms, from 0s to 1min;\n"


def test_a_from_and_a_separate_to_print_as_one_form() -> None:
    one, two = (parse_kpl(f"stream a = b with from 1s{comma} to 2s;") for comma in ("", ","))
    assert one == two
    assert print_kpl(two) == "stream a = b with from 1s to 2s;\n"


@for_each("seed", range(300))
def test_parsing_what_was_printed_gives_the_same_model(seed: int) -> None:
    specification = random_specification(random.Random(seed))
    text = print_kpl(specification)
    again = parse_kpl(text)
    assert again == specification
    assert print_kpl(again) == text


@for_each("seed", range(100))
def test_policy_survives_its_text_form(seed: int) -> None:
    policy = random_policy(random.Random(seed))
    assert parse_policy(str(policy)) == policy


def test_type_is_printed_in_one_layout() -> None:
    assert str(parse_type("< set( Point ),<float> >")) == "<set(Point), <float>>"


def random_policy(rng: random.Random) -> Policy:
    from_us = rng.choice([None, rng.randrange(10**6)])
    return Policy(
        rng.choice([AnyUpdate(), AnyChange(), SampleEvery(rng.randrange(1, 10**7))]),
        rng.choice(list(Approximation)),
        max_delay_us=rng.randrange(10**7) * rng.randrange(2),
        from_us=from_us,
        to_us=rng.choice([None, rng.randrange(10**6, 10**9)]),
        oldest_us=rng.choice([None, rng.randrange(10**8)]),
        order=rng.choice(list(Order)),
    )


def random_specification(rng: random.Random) -> Specification:
    makers = (_sort, _objects, _feature, _source, _unit, _configuration, _process, _mediation, _configure, _stream)
    return Specification(tuple(rng.choice(makers)(rng) for _ in range(rng.randrange(6))))


NAMES = [
    "a",
    "B2",
    "_x",
    "samples",
    "ooo",
    "to_",
    "anyway",
    "nowhere",
    "set_",
    "Max",
    "s",
    "ms",
    "order",
    "now",
    "of",
    "by",
    "selection",
    "collection",
    "collected",
    "configurations",
]


def _name(rng: random.Random) -> Name:
    return Name(rng.choice(NAMES))


def _names(rng: random.Random, least: int = 1) -> tuple[Name, ...]:
    return tuple(_name(rng) for _ in range(rng.randrange(least, 4)))


def _type(rng: random.Random, depth: int = 0) -> model.Type:
    form = rng.randrange(6 if depth < 3 else 3)
    if form == 5:
        return model.CollectedType(_type(rng, depth + 1))
    if form == 3:
        return model.SetType(_type(rng, depth + 1))
    if form == 4:
        return model.TupleType(tuple(_type(rng, depth + 1) for _ in range(rng.randrange(1, 4))))
    return model.NamedType(_name(rng))


def _sort(rng: random.Random) -> model.Statement:
    return model.SortDeclaration(_name(rng), rng.choice([None, _type(rng)]))


def _objects(rng: random.Random) -> model.Statement:
    return model.ObjectDeclaration(_name(rng), _names(rng))


def _feature(rng: random.Random) -> model.Statement:
    return model.FeatureDeclaration(_type(rng), _name(rng), _names(rng, 0))


def _source(rng: random.Random) -> model.Statement:
    return model.SourceDeclaration(_type(rng), _name(rng))


def _unit(rng: random.Random) -> model.Statement:
    return model.UnitDeclaration(_type(rng), _name(rng), tuple(_type(rng) for _ in range(rng.randrange(1, 4))))


def _process(rng: random.Random) -> model.Statement:
    return model.GeneratorDeclaration(_label(rng), _name(rng), tuple(_term(rng) for _ in range(rng.randrange(4))))


def _configuration(rng: random.Random) -> model.Statement:
    return model.ConfigurationDeclaration(_name(rng), _type(rng))


def _mediation(rng: random.Random) -> model.Statement:
    kind = rng.choice(list(MediationKind))
    return model.MediationDeclaration(_label(rng), kind, _type(rng), _term(rng).constraints, Term(_label(rng)))


def _configure(rng: random.Random) -> model.Statement:
    return model.ConfigureDeclaration(Label(_name(rng)), _name(rng), _term(rng))


def _stream(rng: random.Random) -> model.Statement:
    return model.StreamDeclaration(_name(rng), _term(rng))


def _label(rng: random.Random) -> Label:
    return Label(_name(rng), _names(rng, 0))


def _term(rng: random.Random) -> Term:
    return Term(_label(rng), tuple(_constraint(rng) for _ in range(rng.randrange(4))))


def _constraint(rng: random.Random) -> Constraint:
    kind = rng.choice(list(ConstraintKind))
    us = rng.randrange(2**50) if rng.random() < 0.5 else 1000 * rng.randrange(5000)
    if kind in _TIMED or (kind in _MAYBE_TIMED and rng.random() < 0.7):
        return Constraint(kind, us)
    return Constraint(kind)
