"""Which cars are there, where were they, and by what is each the one that it is? Routes about cars."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field
from starlette.responses import Response

from service.api.messages.answers import answers, json_answer
from service.api.messages.asked import GEOJSON, Form, InWindow, MediaTime, OfRun
from service.api.messages.bodies import CarList, LinkList, Tracks
from service.errors import FilterError
from service.questions.observations.car_tracks import car_columns
from service.questions.observations.coverage import Coverage
from service.questions.observations.identity import check_car, identities, links_of
from service.records.runs import RunRecord
from service.records.times import MAX_MEDIA_US
from service.store.log import EventLog

MOST_US = 60_000_000
"""Of all cars so much is told at once: some megabytes of a busy junction."""


class _Stepwise(InWindow):
    format: Form = "json"
    step_us: int = Field(1, ge=1, le=MAX_MEDIA_US, description="The first state of a car in each step; all for 1.")


class _Window(_Stepwise):
    from_: MediaTime = Field(alias="from", description="Start of the window, media time.")
    to: MediaTime = Field(description=f"End of the window, excluded, at most {MOST_US} us later.")


def add_cars(router: APIRouter, log: EventLog, coverage: Coverage) -> None:
    """Add the routes about cars.

    Parameters
    ----------
    coverage : of the same log.
    """
    tracked = answers(Tracks, 400, 404, 409, 422, also=GEOJSON)

    @router.get("/cars", name="cars", responses=answers(CarList, 404, 422))
    def list_cars(asked: Annotated[OfRun, Query()]) -> Response:
        """List the cars of a run in the order of first sight, and how sure each is the same one."""
        record = log.run(asked.run)
        return json_answer(CarList(record.id, identities(log, record.id), coverage.of_run(record)))

    @router.get("/cars/{car}/links", name="links", responses=answers(LinkList, 404, 422))
    def get_links(car: str, asked: Annotated[OfRun, Query()]) -> Response:
        """Say by what links a car is the one that it is, the oldest first."""
        record = log.run(asked.run)
        return json_answer(LinkList(record.id, car, links_of(log, record, car), coverage.of_run(record)))

    @router.get("/cars/{car}/trajectory", name="trajectory", responses=tracked)
    def get_trajectory(car: str, asked: Annotated[_Stepwise, Query()]) -> Response:
        """Say where a car was over its life, or in a window."""
        record = log.run(asked.run)
        check_car(log, record, car)
        return _tracks(record, asked, (car,))

    @router.get("/tracks", name="tracks", responses=tracked)
    def get_tracks(asked: Annotated[_Window, Query()]) -> Response:
        """Say where all cars were in a window."""
        if asked.to > asked.from_ + MOST_US:
            expected = f"to: expected at most {MOST_US} us after 'from'"
            raise FilterError(f"{expected}, got {asked.to - asked.from_} us", parameter="to")
        return _tracks(log.run(asked.run), asked)

    def _tracks(run: RunRecord, asked: _Stepwise | _Window, cars: tuple[str, ...] | None = None) -> Response:
        states = log.states(run.id, cars=cars, from_us=asked.from_, to_us=asked.to)
        columns = car_columns(states, step_us=asked.step_us)
        if asked.format == "geojson":
            from service.export.geojson import car_features, known_frame_of  # loads what projects

            return Response(car_features(columns, known_frame_of(run)), media_type=GEOJSON)
        return json_answer(Tracks(run.id, columns, coverage.of_run(run)))
