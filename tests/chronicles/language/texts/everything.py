"""A text with every construct of the language in it."""

EVERYTHING = """
timeunit 1ms; constant gap = 1.5s  constant place = "Main Street"  constant many = -3
domain Car = symbol ~ {ghost}; domain Level = ([1..5] | {6, 8}) ~ ({2} | {3})
attribute p[?a, ?b] { ?a in Car; ?b in Level; value in {on, "in", "t1"}; default on }  attribute q[]  message m[?a]
chronicle all_of_it[?a, ?b](t0, t1, t2x) {
  event(p[?a, ?]:(?, "in"), t1); event(m[place], t2x)  event(q[]:(x, -3), t3)
  noevent(m[?z], (t1 + 1us, t2x - gap))
  occurs((1, oo), m[?a], (t1, t2x))  occurs(0, 3, m[?a], (t1, t2x))
  hold(p[?a, 4]:?v, (t0, t1 + 1h))  assert(q[]:"a \\"b\\" \\\\c", (t1, t1 + 90min))
  t1 - t0 in [1s, 1s]  t2x - t1 in ]-oo, oo[  t2x - t1 in [-gap, many[  t1 < t2x  t1 <= t2x + 5  t1 = t3 - 500us
  t2x >= t1 + gap  t3 > t1;
  -2s < t3 - t1 <= oo;  +1 <= t3 - t1 < 5  many <= t3 - t1 < gap;  -gap <= t3 - t1 <= +gap
  ?a == ?b  ?a != car1  ?b in Car | {x}  allow ?a == ?v
  when recognized { emit event(m[?a], t1 + 1s); emit m[?b] emit m[?b] at t3 report "?a was # here" assert(q[]:on, t1) }
}
chronicle bare {
  select all select first(t1); select non_overlapping  confidence >= 0.75
}
example "empty" {
}
example "some \\"events\\"" {
  0 p[a, "t1"]:(unknown, "in") 1.5s m[gap]; 2 q[]:(x, -3)
  until 1min
  expect bare 1..2  expect all_of_it[b=-3, ?t1="x y"] 0s..1h
}
"""
