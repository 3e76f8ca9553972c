"""Reports: what is produced, from what, under which policy, at what cost."""

from dyknow.node import Node
from dyknow.policies.policy import AnyChange, Order, Policy
from dyknow.sample import Sample
from dyknow.streams.stream_report import short_repr
from tests.dyknow.units import Latest, Pairing, Recorder


def test_report_counts_samples_updates_and_time() -> None:
    ticks = iter(range(0, 1_000, 10))
    node = Node(clock=lambda: next(ticks))
    source = node.add_source("numbers")
    node.add_refinement("pairs", Pairing(), of="numbers")
    for t in range(3):
        source.publish(Sample(t, t, t))
    node.finish()
    numbers, pairs = node.report()
    assert (numbers.label, numbers.kind, numbers.published, numbers.updates) == ("numbers", "source", 3, 0)
    assert (pairs.label, pairs.kind, pairs.published, pairs.updates) == ("pairs", "refinement", 2, 3)
    assert pairs.busy_ns == 4 * 10


def test_report_says_what_is_read_under_which_policy() -> None:
    node = Node()
    node.add_source("a")
    node.add_source("b")
    node.add_refinement("both", Latest(), of=("a", "b"), policy=(Policy(AnyChange()), Policy(order=Order.STRICT)))
    report = node.report()[-1]
    assert report.inputs == ("a", "b")
    assert report.policies == ("any change", "any update, strict order")


def test_report_tells_rate_lag_losses_and_queues() -> None:
    node = Node()
    source = node.add_source("pos")
    node.subscribe("pos", Recorder(), Policy(order=Order.STRICT))
    source.open(capacity=2)
    for now_us, valid_us in ((0, 0), (500_000, 400_000), (1_000_000, 300_000)):
        source.publish(Sample(now_us, valid_us, (1.0, 2.0)))
    (report,) = node.report()
    assert (report.rate_hz, report.lag_us, report.last_valid_us) == (2.0, 700_000, 300_000)
    assert (report.published, report.delivered, report.subscribers) == (3, 5, 2)
    assert (report.dropped, report.queued) == ({"order": 1, "drop oldest": 1}, (2,))
    assert report.last_value == "(1.0, 2.0)"


def test_report_of_a_stream_without_samples_has_no_last_one() -> None:
    node = Node()
    node.add_source("pos")
    (report,) = node.report()
    assert (report.rate_hz, report.lag_us, report.last_valid_us, report.last_value) == (0.0, None, None, None)


def test_long_value_is_shortened_to_one_line() -> None:
    text = short_repr({"line\n" * k: list(range(100)) for k in range(50)})
    assert len(text) <= 60
    assert "\n" not in text
