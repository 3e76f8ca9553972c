"""Policies and states by definition, slow and obvious: every rule looks at the whole stream again."""

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any

from dyknow.policies.policy import AnyChange, Approximation, Order, Policy, SampleEvery
from dyknow.sample import NO_VALUE, Sample

Samples = Sequence[Sample[Any]]
Arrived = list[tuple[int, Sample[Any]]]  # the node's time at which each sample came, with the sample


def received(policy: Policy, samples: Samples, told_us: int | None = None) -> list[Sample[Any]]:
    """Say what a subscriber receives of a whole stream."""
    passed, end_us = passed_by(policy, samples, told_us)
    if not is_sampled(policy):
        return changes(policy, [sample for _, sample in passed])
    return [Sample(at, t, value) for at, t, (value,) in states_of_stream(policy, passed, end_us)]


def count_used(policy: Policy, samples: Samples, told_us: int | None = None) -> int:
    """Say how many samples of a whole stream are delivered, or are what a sampled value is made of."""
    if not is_sampled(policy):
        return len(received(policy, samples, told_us))
    passed, end_us = passed_by(policy, samples, told_us)
    kept = first_word_only(policy, passed)
    used_us = {
        one.valid_us
        for at_us, t_us, _ in states_of_stream(policy, passed, end_us)
        for one in nearest(policy.approximation, [one for now_us, one in kept if now_us <= at_us], t_us)
    }
    return len(used_us)


def passed_by(policy: Policy, samples: Samples, told_us: int | None) -> tuple[Arrived, int]:
    """Say what passes the rules before that of cause, and when the stream ends."""
    clock_us = list(accumulate((sample.available_us for sample in samples), max))
    passed: Arrived = []
    for now_us, sample in zip(clock_us, samples, strict=True):
        is_taken = is_sampled(policy) or is_of_interest(policy, sample)
        if is_taken and all(is_in_order(policy, one.valid_us, sample) for _, one in passed):
            passed.append((now_us, sample))
    return passed, max([*clock_us, *([] if told_us is None else [told_us])], default=0)


def is_of_interest(policy: Policy, sample: Sample[Any]) -> bool:
    if policy.from_us is not None and sample.valid_us < policy.from_us:
        return False
    if policy.to_us is not None and sample.valid_us > policy.to_us:
        return False
    return policy.max_delay_us is None or sample.delay_us <= policy.max_delay_us


def is_sampled(policy: Policy) -> bool:
    """Tell whether duration and delay limit the sampled times, instead of the samples that come."""
    return isinstance(policy.cause, SampleEvery)


def is_in_order(policy: Policy, before_us: int, sample: Sample[Any]) -> bool:
    match policy.order:
        case Order.ANY:
            return True
        case Order.MONOTONE:
            return before_us <= sample.valid_us
        case Order.STRICT:
            return before_us < sample.valid_us


def changes(policy: Policy, samples: Samples) -> list[Sample[Any]]:
    is_change = isinstance(policy.cause, AnyChange)
    return [one for k, one in enumerate(samples) if k == 0 or not is_change or samples[k - 1].value != one.value]


def states_of_stream(policy: Policy, passed: Arrived, end_us: int) -> list[tuple[int, int, tuple[Any, ...]]]:
    assert isinstance(policy.cause, SampleEvery)
    if not passed:
        return []
    arrived_us, first = passed[0]
    phase_us, period_us = policy.from_us or 0, policy.cause.period_us
    t_us = min(phase_us, first.valid_us - (first.valid_us - phase_us) % period_us)
    from_us = t_us if policy.from_us is None else policy.from_us
    while t_us < max(first.valid_us, from_us) or is_too_late(policy, t_us, arrived_us):
        t_us += period_us
    return states(
        {"": policy},
        {"": passed},
        period_us=period_us,
        max_delay_us=policy.max_delay_us,
        start_us=t_us,
        end_us=end_us,
        to_us=policy.to_us,
    )


def is_too_late(policy: Policy, t_us: int, now_us: int) -> bool:
    return policy.max_delay_us is not None and t_us + policy.max_delay_us < now_us


def states(
    policies: Mapping[str, Policy],
    arrived: Mapping[str, Arrived],
    *,
    period_us: int,
    max_delay_us: int | None,
    start_us: int,
    end_us: int,
    to_us: int | None = None,
) -> list[tuple[int, int, tuple[Any, ...]]]:
    """Say which states leave when: available time, valid time, values."""
    samples = {name: first_word_only(policies[name], rows) for name, rows in arrived.items()}
    last_us = max((one.valid_us for rows in arrived.values() for _, one in rows), default=start_us - 1)
    result: list[tuple[int, int, tuple[Any, ...]]] = []
    t_us, previous_us = start_us, -(10**9)
    while to_us is None or t_us <= to_us:
        times = [settling_time(policies[name], rows, t_us) for name, rows in samples.items()]
        settled_us = None if None in times else max(one for one in times if one is not None)
        deadline_us = None if max_delay_us is None else t_us + max_delay_us
        if deadline_us is not None and deadline_us < end_us and (settled_us is None or settled_us > deadline_us):
            at_us = deadline_us
        elif settled_us is not None:
            at_us = max(settled_us, previous_us)
        elif t_us <= last_us:
            at_us = end_us
        else:
            break
        known = {name: [one for now_us, one in rows if now_us <= at_us] for name, rows in samples.items()}
        result.append((at_us, t_us, tuple(value_at(policies[name].approximation, known[name], t_us) for name in known)))
        previous_us = at_us
        t_us += period_us
    return result


def first_word_only(policy: Policy, rows: Arrived) -> Arrived:
    """Leave out what repeats a valid time, and from an ordered stream what is not in order."""
    kept: Arrived = []
    for now_us, one in rows:
        times = [other.valid_us for _, other in kept]
        if one.valid_us not in times and (policy.order is Order.ANY or all(t < one.valid_us for t in times)):
            kept.append((now_us, one))
    return kept


def settling_time(policy: Policy, rows: Arrived, t_us: int) -> int | None:
    """Say when the value at a time could not change any more."""
    for now_us, one in rows:
        if one.valid_us == t_us or (policy.order is not Order.ANY and one.valid_us > t_us):
            return now_us
    return None


def value_at(approximation: Approximation, known: Samples, t_us: int) -> Any:
    match nearest(approximation, known, t_us):
        case []:
            return NO_VALUE
        case [one]:
            return one.value
        case [before, after]:
            share = (t_us - before.valid_us) / (after.valid_us - before.valid_us)
            return before.value + (after.value - before.value) * share


def nearest(approximation: Approximation, known: Samples, t_us: int) -> list[Sample[Any]]:
    """Say of which samples the value at a time is made."""
    before = max((one for one in known if one.valid_us <= t_us), key=lambda one: one.valid_us, default=None)
    after = min((one for one in known if one.valid_us >= t_us), key=lambda one: one.valid_us, default=None)
    if before is None:
        return []
    if before.valid_us == t_us or approximation is Approximation.MOST_RECENT:
        return [before]
    if after is None or approximation is Approximation.NONE:
        return []
    return [before, after]
