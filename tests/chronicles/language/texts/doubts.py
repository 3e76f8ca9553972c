"""Texts that are loaded and yet hardly meant (warnings), what is said about them, and how they are mended."""

from tests.chronicles.language.texts.faults_of_words import HEAD, TWO, Case, body

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
    "a name with two numbers of arguments": Case(
        "C0308",
        "chronicle one[?a](t1) { event(on[?a, x], t1) noevent(<<on[?a]>>, (t1 + 1us, t1 + 1s)) }",
        "expected 2 arguments for 'on' as in line 1, got 1",
        "? stands for anything",
        "chronicle one[?a](t1) { event(on[?a, x], t1) noevent(on[?a, ?], (t1 + 1us, t1 + 1s)) }",
    ),
    "an example with another number of arguments": Case(
        "C0308",
        'chronicle one[?a](t1) { event(on[?a], t1) } example "e" { 1s <<on[a, b]>> }',
        "expected 1 argument for 'on' as in line 1, got 2",
        "an event fits only a pattern with as many arguments",
        'chronicle one[?a](t1) { event(on[?a], t1) } example "e" { 1s on[a] expect one[a=a] 1s..1s }',
    ),
    "a domain without values": Case(
        "C0309",
        "domain D = {a, b} domain E = <<D ~ D>>",
        "expected a domain with a value, got D ~ D, which has none",
        "nothing but unknown fits it",
        "domain D = {a, b} domain E = D ~ {a}",
    ),
    "a parameter without values": Case(
        "C0309",
        "domain D = {a, b} message m[?a] { ?a in <<D ~ D>> }",
        "expected a domain with a value, got D ~ D, which has none",
        "",
        "domain D = {a, b} message m[?a] { ?a in D }",
    ),
    "a count that says nothing": Case(
        "C0603",
        body("<<occurs((0, oo), enter[?], (t1, t1 + 1s))>>"),
        "expected a number of events with a bound, got 0 to oo, which every number is",
        "leave it out, or give a bound",
        body("occurs((0, 9), enter[?], (t1, t1 + 1s))"),
    ),
    "a report about nothing": Case(
        "C0807",
        body('when recognised { <<report "?aa seen">> }'),
        "expected variables with a value in a report, got ?aa",
        "did you mean '?a'?",
        body('when recognised { report "?a seen" }'),
    ),
    "a report about any other thing": Case(
        "C0807",
        body('noevent(enter[?other], (t1 + 1us, t1 + 1s)) when recognised { <<report "no ?other">> }'),
        "got ?other",
        "known: '?a'",
        body('noevent(enter[?other], (t1 + 1us, t1 + 1s)) when recognised { report "no other" }'),
    ),
    "many combinations": Case(
        "C1001",
        f"{HEAD}chronicle <<pair>>[?a, ?b](t1, t2) {{ event(enter[?a], t1) {TWO} t2 - t1 in [0s, 1h] }}",
        "expected events that share a variable, got 2 groups without one in common, at t1 and t2",
        "within 1h every combination is kept: with n things each, n^2 instances",
        f"{HEAD}chronicle pair[?a, ?b](t1, t2) {{ event(enter[?a], t1) {TWO} t2 - t1 in [0s, 5s] }}",
    ),
}
