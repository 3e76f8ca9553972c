"""An overtake is told, doubted and taken back: its overtaker was another car all the time.

All of it is filmed. A car follows a slow one, pulls out, and both go into a short tunnel. The first to come out is a
car like it that stood in there, and it comes out ahead of the slow one: it is taken for the car that pulled out, which
is said to have overtaken. Then that car comes out itself, still behind the slow one.
"""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from data_gen.drawing.cameras import camera_path
from data_gen.drawing.occluders import Occluder
from data_gen.drawing.overlay import Overlay
from data_gen.drawing.render import SceneRenderer
from data_gen.drawing.video import VideoWriter
from data_gen.outputs.scene import plan_world
from data_gen.outputs.site_file import write_site
from data_gen.scenario import View
from data_gen.scenarios.catalogue import scenario_named
from data_gen.simulation.states import VehicleStates
from gis.roads.sumo_net import read_sumo_net
from service.api.app import create_app
from service.cli.app import run as dyknow
from service.questions.events.queries import EventFilter, decode_event, iterate_events
from service.questions.observations.identity import links_of
from service.records.events import EventRecord
from service.store.log import open_log
from tests.clips import first_seconds
from tests.service.http import Client

pytestmark = pytest.mark.long

S = 1_000_000
RATE_HZ, SIZE_PX = 25, (632, 64)
ALL_S, UNTIL_IT_COMES_OUT_S = 15, 13
VIEW = View((504.0, 0.0), 221.0)
TUNNEL_M = (455.0, 545.0)
PULLED_OUT_AT_M = 420.0


def places_m(t_s: float) -> dict[str, tuple[float, float]]:
    """Say where the middle of each car is: all drive to the east."""
    lost_m, waited_s = 409.0 + 10 * t_s, max(t_s - 5.66, 0.0)
    lost_is_out = PULLED_OUT_AT_M < lost_m < 500.0
    other_m = 498.7 + 1.75 * min(waited_s, 5.14) ** 2 + 18 * max(waited_s - 5.14, 0.0)
    return {
        "ahead": (565.0 + 14 * t_s, -1.75),
        "slow": (425.0 + 10 * t_s, -1.75),
        # Out of the lane in 25 m, and back into it where nobody sees that.
        "lost": (lost_m, -1.75 + 3 * _eased((lost_m - PULLED_OUT_AT_M) / 25) * lost_is_out),
        # From beside the road, over the other lane, into its own.
        "other": (other_m, 5.4 - 3.8 * _eased((other_m - 500) / 15) - 3.35 * _eased((other_m - 570) / 40)),
    }


LOOKS = {"ahead": (4.1, 1.7, 11), "slow": (4.8, 1.8, 20), "lost": (4.3, 1.75, 11), "other": (4.3, 1.75, 11)}
"""Length, width and paint: the one that is lost and the other one look alike."""


def _eased(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * (3 - 2 * share)


def states(t_us: int, names: Sequence[str]) -> VehicleStates:
    now, soon = (np.array([places_m(t_us / S + later_s)[name] for name in names]) for later_s in (0.0, 0.01))
    moved_m = soon - now
    looks = np.array([LOOKS[name] for name in names])
    return VehicleStates(
        t_us=t_us,
        ids=tuple(names),
        classes=("car",) * len(names),
        lanes=("eastbound_0",) * len(names),
        centre_m=now,
        heading_rad=np.arctan2(moved_m[:, 1], moved_m[:, 0]),
        speed_mps=np.hypot(*moved_m.T) / 0.01,
        length_m=looks[:, 0],
        width_m=looks[:, 1],
        appearance=looks[:, 2].astype(np.int64),
    )


def film(folder: Path) -> Path:
    """Film the road with the tunnel; returns the video, with the site file beside it."""
    plan, network = scenario_named("rural_overtaking"), folder / "network.net.xml"
    shutil.copyfile(plan.network_file, network)
    roads = read_sumo_net(network)
    t_us = np.arange(RATE_HZ * ALL_S) * (S // RATE_HZ)
    path = camera_path("vertical", VIEW, SIZE_PX, t_us=t_us, rng=np.random.default_rng(1))
    world = plan_world(plan, roads, path, np.random.default_rng(1), weather="overcast")
    roof = Occluder("bridge", 6.0, ((shapely.box(TUNNEL_M[0], -40.0, TUNNEL_M[1], 40.0), (60.0, 100.0, 70.0), 0.2),))
    overlay = Overlay([roof], pixel_m=path.finest_pixel_m, sun=world.sun, rng=np.random.default_rng(1))
    renderer = SceneRenderer(replace(world, occluders=(roof,), overlay=overlay), path, np.random.default_rng(1))
    write_site(folder / "site.toml", name="doubted", network=network, path=path)
    with VideoWriter(folder / "video.mp4", SIZE_PX, RATE_HZ) as video:
        for number, now_us in enumerate(t_us.tolist()):
            video.write(renderer.frame(states(now_us, tuple(LOOKS))), number)
    return folder / "video.mp4"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[int, str]:
    """Process the film, and the film cut off before the lost car comes out: the log by seconds."""
    folder = tmp_path_factory.mktemp("doubted")
    whole, made = film(folder), {}
    for seconds in (ALL_S, UNTIL_IT_COMES_OUT_S):
        video, made[seconds] = folder / f"{seconds}.mp4", str(folder / f"{seconds}.db")
        words = ["process", str(first_seconds(whole, video, seconds)), "--site", str(folder / "site.toml")]
        assert dyknow([*words, "--log", made[seconds], "--workers", "0"]) == 0
    return made


def overtakes(url: str, *statuses: str) -> list[EventRecord]:
    with open_log(url) as log:
        wanted = EventFilter(types=("overtake",), statuses=statuses)  # type: ignore[arg-type]  # words of the literal
        return [decode_event(text) for text in iterate_events(log, wanted)]


def test_an_overtake_is_told_and_taken_back_when_the_car_comes_out_behind(logs: dict[int, str]) -> None:
    assert overtakes(logs[ALL_S]) == []
    [taken_back] = overtakes(logs[ALL_S], "retracted")
    [told] = overtakes(logs[UNTIL_IT_COMES_OUT_S])
    assert told.status == "tentative"
    assert (told.roles, told.end) == (taken_back.roles, taken_back.end)
    assert told.recognised_us < UNTIL_IT_COMES_OUT_S * S
    assert 14 * S <= taken_back.recognised_us < 15 * S  # when it was taken back, and not when it was told
    assert taken_back.revises is not None


def test_nothing_of_the_wrong_car_stands(logs: dict[int, str]) -> None:
    with open_log(logs[ALL_S]) as log:
        assert [
            decode_event(text).type for text in iterate_events(log, EventFilter())
        ] == []  # not the wrong way either


def test_the_car_that_comes_out_takes_the_link_over(logs: dict[int, str]) -> None:
    [event] = overtakes(logs[ALL_S], "retracted")
    with open_log(logs[ALL_S]) as log:
        chain = links_of(log, log.run(), event.roles["overtaker"])
    first, doubted, last = [one for one in chain if one.level == "world"]
    assert (first.verdict, doubted.verdict) == ("validated", "refuted")
    assert last.start_us == event.recognised_us
    assert doubted.start_us < 11.5 * S  # 0.7 s after its front came out


def test_what_was_taken_back_is_listed_when_asked_for(logs: dict[int, str], capsys: pytest.CaptureFixture[str]) -> None:
    [event] = overtakes(logs[ALL_S], "retracted")
    capsys.readouterr()
    assert dyknow(["events", logs[ALL_S], "--type", "overtake", "--status", "retracted"]) == 0
    assert event.id in capsys.readouterr().out
    assert dyknow(["objects", logs[ALL_S], event.roles["overtaker"]]) == 0
    assert "refuted: another one explains it better" in capsys.readouterr().out
    with Client(create_app(logs[ALL_S])) as client:
        listed = client.get("/api/v1/events?type=overtake&status=retracted").json()["items"]
        told = client.get(f"/api/v1/events/{event.revises}").json()
    assert [one["id"] for one in listed] == [event.id]
    assert (told["status"], told["end"]) == ("tentative", event.end)
