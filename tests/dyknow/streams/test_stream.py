"""Stream generators: who gets which samples, and when."""

import gc
import weakref

import pytest

from dyknow.errors import StreamError
from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery
from dyknow.sample import Sample
from dyknow.streams.buffers import WhenFull
from dyknow.streams.stream import StreamGenerator, Subscription
from dyknow.streams.testing import samples_of
from tests.dyknow.units import Recorder


def stream_of(*valid_us: int) -> StreamGenerator:
    """Publish samples whose values are their times, in a stream that remembers 100 us."""
    stream = StreamGenerator("s")
    stream.remember(100)
    publish(stream, *valid_us)
    return stream


def publish(stream: StreamGenerator, *valid_us: int) -> None:
    for t_us in valid_us:
        stream.publish(Sample(t_us, t_us, t_us))


def test_subscribers_of_one_stream_have_their_own_policies() -> None:
    stream, everything, ordered, changed = StreamGenerator("s"), Recorder(), Recorder(), Recorder()
    stream.subscribe(everything)
    stream.subscribe(ordered, Policy(order=Order.STRICT))
    stream.subscribe(changed, Policy(AnyChange()))
    for sample in samples_of((1, 1, "a"), (3, 3, "a"), (4, 2, "b")):
        stream.publish(sample)
    assert (everything.values, ordered.values, changed.values) == (["a", "a", "b"], ["a", "a"], ["a", "b"])


def test_sampled_and_plain_subscriber_get_what_they_asked_for() -> None:
    stream, sampled = StreamGenerator("s"), Recorder()
    stream.subscribe(sampled, Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=5))
    publish(stream, 8)
    stream.advance(16)
    publish(stream, 19)
    stream.finish()
    assert sampled.samples == samples_of((15, 10, 8))


def test_subscriber_that_leaves_while_it_is_served_gets_nothing_more() -> None:
    stream, seen = StreamGenerator("s"), []
    mine = stream.subscribe(lambda sample: (seen.append(sample.value), stream.unsubscribe(mine)))
    publish(stream, 1, 2)
    assert seen == [1]


def test_subscriber_that_is_sent_away_before_its_turn_gets_nothing() -> None:
    stream, seen, mine = StreamGenerator("s"), Recorder(), list[Subscription]()
    stream.subscribe(lambda _: stream.unsubscribe(mine.pop()) if mine else None)
    mine.append(stream.subscribe(seen))
    publish(stream, 1)
    assert seen.values == []


def test_subscriber_that_leaves_between_two_sampled_values_misses_the_second() -> None:
    stream, seen = StreamGenerator("s"), []
    policy = Policy(SampleEvery(10), Approximation.MOST_RECENT, order=Order.STRICT)
    mine = stream.subscribe(lambda sample: (seen.append(sample.valid_us), stream.unsubscribe(mine)), policy)
    publish(stream, 8, 35)  # settles 10, 20 and 30
    assert seen == [10]


def test_subscriber_that_joins_during_delivery_gets_the_next_sample() -> None:
    stream, late = StreamGenerator("s"), Recorder()
    first = stream.subscribe(lambda _: (stream.subscribe(late), stream.unsubscribe(first)))
    publish(stream, 1, 2)
    assert late.values == [2]


def test_subscriber_that_joins_during_delivery_and_asks_for_the_oldest_gets_each_sample_once() -> None:
    stream, late = stream_of(1), Recorder()
    first = stream.subscribe(lambda _: (stream.subscribe(late, Policy(oldest_us=50)), stream.unsubscribe(first)))
    publish(stream, 2, 3)
    assert late.values == [1, 2, 3]


def test_oldest_delivers_stored_samples_of_that_age() -> None:
    seen = Recorder()
    stream_of(10, 40, 60, 70).subscribe(seen, Policy(oldest_us=30))
    assert seen.values == [40, 60, 70]


def test_oldest_counts_from_the_time_that_was_told() -> None:
    stream, seen = stream_of(10, 40, 60), Recorder()
    stream.advance(80)
    stream.subscribe(seen, Policy(oldest_us=30))
    assert seen.values == [60]


def test_stored_samples_pass_the_policy_too() -> None:
    seen = Recorder()
    stream_of(10, 50, 40).subscribe(seen, Policy(order=Order.STRICT, oldest_us=100))
    assert seen.values == [10, 50]


def test_pulled_stream_begins_with_the_oldest() -> None:
    stream = stream_of(10, 20).open(Policy(oldest_us=100))
    assert [sample.value for sample in stream.take()] == [10, 20]


def test_oldest_is_refused_where_samples_were_not_stored() -> None:
    with pytest.raises(StreamError, match="stream 's': expected to remember at least 101 us for 'oldest', got 100 us"):
        stream_of(10).subscribe(print, Policy(oldest_us=101))


def test_who_asks_for_the_oldest_before_the_first_sample_makes_the_stream_remember() -> None:
    stream, first, second = StreamGenerator("s"), Recorder(), Recorder()
    stream.subscribe(first, Policy(oldest_us=50))
    publish(stream, 1, 40, 60)
    stream.subscribe(second, Policy(oldest_us=50))
    assert (first.values, second.values) == ([1, 40, 60], [40, 60])
    with pytest.raises(StreamError, match="expected to remember at least 51 us for 'oldest', got 50 us"):
        stream.subscribe(second, Policy(oldest_us=51))


def test_consumer_that_raises_on_stored_samples_is_not_subscribed() -> None:
    def refuse(sample: Sample[int]) -> None:
        raise OSError(f"no room for {sample.value}")

    stream = stream_of(10, 20)
    with pytest.raises(OSError, match="no room for 10"):
        stream.subscribe(refuse, Policy(oldest_us=100))
    assert (stream.subscriptions, stream.delivered) == ((), 1)
    publish(stream, 30)


def test_stream_ends_once() -> None:
    stream, sampled = StreamGenerator("s"), Recorder()
    stream.subscribe(sampled, Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=5))
    publish(stream, 8, 12)
    stream.finish()
    stream.finish()
    assert sampled.values == [8]
    with pytest.raises(
        StreamError, match="stream 's': expected an open stream to publish to, got one that was finished"
    ):
        publish(stream, 13)
    assert (stream.published, stream.is_open, stream.is_closed) == (2, False, False)


def test_who_joins_after_the_end_gets_what_is_stored_and_nothing_is_held_back() -> None:
    stream, seen = stream_of(8, 12), Recorder()
    stream.finish()
    stream.subscribe(seen, Policy(SampleEvery(10), Approximation.MOST_RECENT, max_delay_us=5, oldest_us=50))
    assert seen.values == [8]


def test_leaving_twice_is_told_from_leaving_a_foreign_stream() -> None:
    stream = StreamGenerator("s")
    subscription = stream.subscribe(print)
    stream.unsubscribe(subscription)
    with pytest.raises(StreamError, match="stream 's': expected one of its subscriptions, got one that has ended"):
        stream.unsubscribe(subscription)


def test_consumer_must_be_callable_and_policy_a_policy() -> None:
    with pytest.raises(StreamError, match="stream 's': expected a consumer to call and a policy, got "):
        StreamGenerator("s").subscribe(Policy(), print)  # type: ignore[arg-type]


def test_consumer_that_raises_stays_subscribed_and_those_after_it_miss_the_sample() -> None:
    stream, before, after = StreamGenerator("s"), Recorder(), Recorder()

    def refuse_one(sample: Sample[int]) -> None:
        if sample.value == 1:
            raise OSError("once")

    stream.subscribe(before)
    stream.subscribe(refuse_one)
    stream.subscribe(after)
    with pytest.raises(OSError, match="once"):
        publish(stream, 1)
    publish(stream, 2)
    assert (before.values, after.values) == ([1, 2], [2])


def test_store_is_bounded_by_age_and_by_number() -> None:
    stream, seen = StreamGenerator("s"), Recorder()
    stream.remember(100, capacity=3)
    publish(stream, 1, 150, 160, 170, 180)
    stream.subscribe(seen, Policy(oldest_us=100))
    assert seen.values == [160, 170, 180]
    assert stream.dropped() == {"history full": 1}


@pytest.mark.long
def test_nothing_is_stored_when_nobody_may_ask() -> None:
    class Value:
        pass

    stream = StreamGenerator("s")
    first = Value()
    trace = weakref.ref(first)
    stream.publish(Sample(0, 0, first))
    publish(stream, 1)
    del first
    gc.collect()
    assert trace() is None


def test_every_sample_offered_is_delivered_or_counted() -> None:
    stream = StreamGenerator("s")
    stream.subscribe(Recorder(), Policy(order=Order.STRICT))
    left = stream.subscribe(Recorder(), Policy(AnyChange()))
    pulled = stream.open(capacity=2)
    publish(stream, 1, 3, 2, 2)
    stream.unsubscribe(left)
    assert stream.dropped() == {"order": 2, "no change": 1, "drop oldest": 2}
    assert stream.delivered == 2 + 3 + 4
    assert len(pulled) == 2


def test_losses_stay_counted_when_nothing_waits_any_more() -> None:
    stream = StreamGenerator("s")
    pulled = stream.open(capacity=1)
    publish(stream, 1, 2)
    pulled.take()
    assert stream.dropped() == {"drop oldest": 1}


def test_pulled_stream_that_refuses_keeps_what_it_has() -> None:
    stream = StreamGenerator("s")
    pulled = stream.open(capacity=2, when_full=WhenFull.REFUSE_NEWEST)
    publish(stream, 1, 2, 3)
    assert ([sample.value for sample in pulled.take()], pulled.dropped) == ([1, 2], {"refuse newest": 1})


def test_closed_pull_stream_keeps_what_waits_and_gets_nothing_more() -> None:
    stream = StreamGenerator("s")
    pulled = stream.open()
    publish(stream, 1)
    pulled.close()
    pulled.close()
    publish(stream, 2)
    assert [sample.value for sample in pulled.take()] == [1]


def test_rate_and_lag_come_from_the_times_of_the_samples() -> None:
    stream = StreamGenerator("s")
    for k in range(5):
        stream.publish(Sample(k * 200_000, k * 200_000 - 30_000, k))
    assert stream.rate_hz == pytest.approx(5.0)
    assert stream.last is not None
    assert stream.last.delay_us == 30_000


@pytest.mark.parametrize("valid_us", [(), (5,), (5, 5)])
def test_rate_is_zero_while_no_time_has_passed(valid_us: tuple[int, ...]) -> None:
    assert stream_of(*valid_us).rate_hz == 0.0


def test_leaving_a_foreign_stream_is_refused() -> None:
    subscription = StreamGenerator("a").subscribe(print)
    with pytest.raises(StreamError, match="stream 'b'"):
        StreamGenerator("b").unsubscribe(subscription)


def test_closed_stream_takes_no_samples_and_no_subscribers() -> None:
    stream = StreamGenerator("s")
    subscription = stream.subscribe(print)
    stream.close()
    assert not subscription.is_open
    with pytest.raises(StreamError, match="expected an open stream to publish to"):
        publish(stream, 1)
    with pytest.raises(StreamError, match="expected an open stream to subscribe to"):
        stream.subscribe(print)
