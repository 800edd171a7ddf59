"""What a worker does: fly a range of cases in all configurations, and write its part of the data set."""

import os
from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any

from formation_gnc.campaign.case import CASE, VARIANT, fly_case
from formation_gnc.campaign.dataset import Dataset, Range, curve_rows
from formation_gnc.campaign.definition import Campaign
from formation_gnc.campaign.version import software_version

Row = dict[str, Any]


class VersionError(RuntimeError):
    """A worker has other software than the campaign."""


class UnseenDirectoryError(RuntimeError):
    """A worker does not see the directory of results."""


@lru_cache(maxsize=4)
def _campaign(directory: Path, identity: str) -> Campaign:
    return Dataset(directory).campaign()


def fly_range(directory: str, identity: str, version: str, cases: Range) -> int:
    """Fly a range of cases and write their part.

    Args:
        directory: of the results, the same for all workers.
        identity: of the campaign.
        version: of the software that is to fly.
        cases: first case, and the one after the last.

    Returns:
        Number of cases.

    Raises:
        VersionError: this worker has other software.
        UnseenDirectoryError: the directory of results is not on this machine.
        OSError: the part cannot be written.
    """
    own, results = software_version(), Dataset(Path(directory))
    if own != version:
        raise VersionError(f"a worker has formation_gnc {own}, the campaign {version}: install the same on both")
    if not results.directory.is_dir():
        raise UnseenDirectoryError(f"results {directory}: a worker on {os.uname().nodename} does not see the directory")
    campaign = _campaign(results.directory, identity)
    rows, curves, timing = list[Row](), list[Row](), list[Row]()
    for case in range(*cases):
        for configuration in campaign.configurations:
            started = perf_counter()
            flown = fly_case(campaign, case, configuration)
            wall = perf_counter() - started
            rows.append({**flown.row, "version": version})
            curves += curve_rows(flown.row, flown.curves)
            timing.append({CASE: case, VARIANT: configuration.name, "wall_time_s": wall, "host": os.uname().nodename})
    results.write(cases, rows, curves, timing)
    return cases[1] - cases[0]


def note_lost(directory: str, identity: str, version: str, case: int, reason: str) -> None:
    """Write the part of a case whose worker died again and again, as rows with that reason."""
    results = Dataset(Path(directory))
    campaign = _campaign(results.directory, identity)
    rows = [
        {CASE: case, VARIANT: each.name, "seed": None, "reason": reason, "version": version}
        for each in campaign.configurations
    ]
    results.write((case, case + 1), rows, [], [{CASE: case, VARIANT: each.name} for each in campaign.configurations])
