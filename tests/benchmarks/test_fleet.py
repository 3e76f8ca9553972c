"""Does the simulated queue do what queues are known to do?"""

import numpy as np
import pytest

from benchmarks.simulate_fleet import Fleet, least_cores, main, simulated_waits_s


def fleet(arrivals_s: list[float], work_s: float, *, take_s: float = 0.0, write_s: float = 0.0) -> Fleet:
    return Fleet(np.array(arrivals_s), np.full(len(arrivals_s), work_s), take_s, write_s)


@pytest.mark.parametrize(
    ("jobs", "cores", "waits_s"),
    [
        (fleet([0, 0, 0], 10), 1, [0, 10, 20]),
        (fleet([0, 0, 0], 10), 2, [0, 0, 10]),
        (fleet([0, 5, 100], 10), 1, [0, 5, 0]),
        (fleet([0, 0, 0], 10, take_s=1), 3, [1, 2, 3]),
        (fleet([0, 0, 0], 10, write_s=5), 1, [0, 15, 30]),
        (fleet([0, 0, 0], 10, write_s=5), 2, [0, 0, 20]),  # handed out after both have written
    ],
    ids=["one core", "two cores", "pause", "taking", "writing", "writing takes turns"],
)
def test_jobs_wait_for_cores_and_store(jobs: Fleet, cores: int, waits_s: list[float]) -> None:
    assert simulated_waits_s(jobs, cores).tolist() == waits_s


@pytest.mark.long
def test_waits_are_those_of_queueing_theory() -> None:
    """One server, arrivals and times exponential, half busy: the mean wait is the mean time (Erlang 1909)."""
    rng = np.random.default_rng(3)
    jobs = Fleet(np.cumsum(rng.exponential(2.0, 200_000)), rng.exponential(1.0, 200_000), 0.0, 0.0)
    assert simulated_waits_s(jobs, 1).mean() == pytest.approx(1.0, rel=0.05)


def test_cores_are_enough_and_one_less_is_not() -> None:
    rng = np.random.default_rng(3)
    jobs = Fleet(np.sort(rng.uniform(0, 1000, 300)), rng.gamma(9, 3, 300), 0.01, 0.1)
    cores, waits_s = least_cores(jobs, 20.0)
    assert np.percentile(waits_s, 95) <= 20.0 < np.percentile(simulated_waits_s(jobs, cores - 1), 95)


def test_table_has_a_row_for_each_fleet_and_says_what_is_full(capsys: pytest.CaptureFixture[str]) -> None:
    store = ["--take-s", "0.01", "--write-mb-s", "2", "--connections", "4"]
    main(["--cameras", "10", "2000", "--scenes", "rural", *store, "--wait-s", "900"])
    measured, _, *rows, _, _, limits = capsys.readouterr().out.splitlines()
    assert measured == "store: 10.0 ms a job, 2.0 MB/s, 4 connections a worker"
    assert [row.split()[:2] for row in rows] == [["rural", count] for count in ("10", "10", "2,000", "2,000")]
    assert ["grows" in row for row in rows] == [False, False, True, True]
    assert limits.split() == ["rural", "10.5", "262", "1,304"]
