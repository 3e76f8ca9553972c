"""On which roads were the cars of a run? Its site, read again where it lies, if it is still the same."""

import msgspec
import numpy as np
from msgspec import Struct

from service.errors import NotInLogError
from service.questions.computed_relations import ground_of
from service.records import RunRecord


class SiteLane(Struct, frozen=True):
    """A lane: of `edge`, whose lanes run side by side, the one of this index, from the outer side of the road."""

    id: str
    road: str
    edge: str
    index: int
    direction: int
    width_m: float
    speed_limit_mps: float
    centre_line_m: list[tuple[float, float]]


class SiteJunction(Struct, frozen=True):
    """An area where roads meet."""

    id: str
    outline_m: list[tuple[float, float]]


class RunSite(Struct, frozen=True):
    """Roads in local metres, x east and y north; `origin_deg` is the latitude and longitude of (0, 0), if known."""

    run: str
    site: str
    origin_deg: tuple[float, float] | None
    lanes: list[SiteLane]
    junctions: list[SiteJunction]


def run_site(run: RunRecord) -> RunSite:
    """Read the site of a run.

    Raises
    ------
    NotInLogError
        If the run had no roads.
    InputError
        If its site file is gone, another one, or cannot be used.
    """
    network = ground_of(run, "to tell its roads").network
    if network is None:
        raise NotInLogError(f"run {run.id!r}: expected one with roads, got one on open ground")
    plain = msgspec.to_builtins((network.lanes, network.junctions), enc_hook=np.ndarray.tolist)
    lanes, junctions = msgspec.convert(plain, tuple[list[SiteLane], list[SiteJunction]])
    origin_deg = run.site_file.origin_deg if run.site_file else None
    return RunSite(run.id, run.site, origin_deg, lanes, junctions)
