"""On which roads were the cars of a run? Its site, read again where it lies, if it is still the same."""

from pathlib import Path

import msgspec
import numpy as np

from service.errors import InputError, NotInLogError
from service.records.runs import RunRecord, RunSite, SiteJunction, SiteLane
from service.runs.inputs.input_kind import content_digest
from service.runs.inputs.sites.site import NO_SITE, Site, load_site


def ground_of(run: RunRecord, asked: str, site_file: Path | None = None) -> Site:
    """Read the site of a run again, `NO_SITE` of one on open ground; see `stored_events.unwatched_relations`.

    Parameters
    ----------
    asked : what it is for, in messages.

    Raises
    ------
    InputError
        If it is not known any more, is another one, or cannot be used.
    """
    if not run.site and site_file is None:
        return NO_SITE
    known = run.site_file
    path = site_file or (Path(known.path) if known else None)
    where = f"run {run.id!r}: expected the site file of {run.site!r} as it was, {asked}"
    if path is None or not path.exists():
        came = "none in this older log" if path is None else f"no file {str(path)!r}"
        raise InputError(f"{where}, got {came}; say where it is with --site")
    site = load_site(path)
    if not _is_the_same(site, run):
        raise InputError(f"{where}, got another one in {str(path)!r}")
    return site


def _is_the_same(site: Site, run: RunRecord) -> bool:
    """Compare the contents, or the names where an older log has no more."""
    if run.site_file is None:
        return site.name == run.site
    return content_digest(*site.files) == run.site_file.digest


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
