"""Texts that are loaded and yet hardly meant (warnings), what is said about them, and how they are mended."""

from tests.chronicles.language.faults_of_words import HEAD, TWO, Case, body

THREE = TWO + "event(enter[?c], t3)\nt2 - t1 in [1s, 5s]\nt3 - t2 in [1s, 5s]\n"

DOUBTS = {
    "an unused constant": Case(
        "C0209",
        "constant <<gap>> = 5s " + body(""),
        "expected the constant 'gap' to be used, got no use of it",
        "leave it out",
        body(""),
    ),
    "an unused domain": Case(
        "C0209", "domain <<Gap>> = {a} " + body(""), "expected the domain 'Gap' to be used", "leave it out", body("")
    ),
    "an end before the start": Case(
        "C0406",
        body(TWO + "t2 - t1 in [-1s, 5s]", "[?a](t1, <<t2>>)"),
        "the end t2 of 'one' may be before its start t1",
        "add t1 <= t2",
        body(TWO + "t2 - t1 in [0s, 5s]", "[?a](t1, t2)"),
    ),
    "an interval that may be turned round": Case(
        "C0409",
        body(TWO + "t2 - t1 in [-1s, 5s] noevent(on[?a, ?]:(?, true), <<(t1, t2)>>)"),
        "expected an interval whose start is before its end, got one that may be turned round",
        "add t1 <= t2",
        body(TWO + "t2 - t1 in [0s, 5s] noevent(on[?a, ?]:(?, true), (t1 + 1us, t2))"),
    ),
    "a constraint that a chain implies": Case(
        "C0601",
        body(THREE + "<<t3 > t1>>"),
        "expected constraints that each say something new, got one that lines 8 and 9 imply",
        "leave it out, or tighten it",
        body(THREE),
    ),
    "both bounds implied": Case(
        "C0601",
        body(THREE + "<<t3 - t1 in [2s, 10s]>>"),
        "got one that lines 8 and 9 imply",
        "leave it out, or tighten it",
        body(THREE + "t3 - t1 in [2s, 9s]"),
    ),
    "a constraint twice": Case(
        "C0601",
        body(TWO + "t2 - t1 in [1s, 5s]\n<<t1 - t2 in [-5s, -1s]>>"),
        "got one that line 7 implies",
        "leave it out",
        body(TWO + "t2 - t1 in [1s, 5s]"),
    ),
    "a weaker constraint first": Case(
        "C0601",
        body(TWO + "<<t2 >= t1>>\nt2 - t1 in [1s, 5s]"),
        "got one that line 8 implies",
        "leave it out",
        body(TWO + "t2 - t1 in [1s, 5s]"),
    ),
    "a constraint that bounds nothing": Case(
        "C0601",
        body(TWO + "t2 - t1 in [0s, 5s] <<t2 - t1 in ]-oo, oo[>>"),
        "expected a constraint that bounds a time, got one that leaves it open on both sides",
        "leave it out",
        body(TWO + "t2 - t1 in [0s, 5s]"),
    ),
    "a hold twice": Case(
        "C0602",
        body("hold(on[?a, ?]:true, (t1, t1 + 1s))\n<<hold(on[?a, ?]:true, (t1, t1 + 1000ms))>>"),
        "expected each statement once, got again what line 7 says",
        "leave one of them out",
        body("hold(on[?a, ?]:true, (t1, t1 + 1s))"),
    ),
    "a constraint on values twice": Case(
        "C0602", body("?a != x <<?a != x>>"), "got again what line 7 says", "leave one of them out", body("?a != x")
    ),
    "a variable that stands once": Case(
        "C0806",
        body("event(on[?a, <<?road>>]:(?, true), t1)"),
        "expected ?road to be used again, got it once",
        "write ? for anything",
        body("event(on[?a, ?]:(?, true), t1)"),
    ),
    "many combinations": Case(
        "C1001",
        f"{HEAD}chronicle <<pair>>[?a, ?b](t1, t2) {{ event(enter[?a], t1) {TWO} t2 - t1 in [0s, 1h] }}",
        "expected events that share a variable, got 2 groups without one in common, at t1 and t2",
        "within 1h every combination is kept: with n things each, n^2 instances",
        f"{HEAD}chronicle pair[?a, ?b](t1, t2) {{ event(enter[?a], t1) {TWO} t2 - t1 in [0s, 5s] }}",
    ),
}
