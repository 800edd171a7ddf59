"""The engine: cases go to the workers of a Dask cluster a few at a time, and come back as parts of the data set.

On this machine, a cluster of processes of its own; or a scheduler that runs already, whoever started its workers.
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from typing import Any

from formation_gnc.campaign.dataset import Dataset, Range
from formation_gnc.campaign.definition import Campaign
from formation_gnc.campaign.version import software_version
from formation_gnc.campaign.worker import UnseenDirectoryError, VersionError, fly_range, note_lost
from formation_gnc.errors import ConfigurationError

AHEAD = 4
"""Ranges of cases per worker that are submitted and not yet flown, at most: the rest is a number on the client."""

PATIENCE = 15.0
"""Wall time (s) for a scheduler to answer."""

Progress = Callable[[int, str], None]
"""Takes the number of cases flown, and a word on the workers."""


class CampaignError(RuntimeError):
    """The flights stop for a reason that is no case's; what is done is kept."""


@dataclass(frozen=True)
class Cluster:
    """Where cases are flown.

    Attributes:
        workers: processes on this machine; None for one per core.
        scheduler: address of a running scheduler, in place of them.
        scheduler_file: file that a running scheduler has written, likewise.
    """

    workers: int | None = None
    scheduler: str | None = None
    scheduler_file: str | None = None


def fly(campaign: Campaign, results: Dataset, cluster: Cluster, show: Progress) -> None:
    """Fly all cases that the results lack.

    Args:
        campaign: with its number of runs.
        results: its directory, created.
        cluster: where.
        show: called after every part.

    Raises:
        ConfigurationError: the scheduler does not answer, or a worker has another version or no such directory.
        CampaignError: the flights stopped; what is done is kept.
    """
    block = int(results.manifest["block"])
    missing = results.missing(campaign.runs, block)
    first = next(missing, None)
    if first is None:
        return
    with _client(cluster) as client:
        _check_workers(client)
        dashboard = f", dashboard {client.dashboard_link}" if find_spec("bokeh") else ""
        _fly(client, campaign, results, _chained(first, missing), lambda done: show(done, _words(client) + dashboard))


def _chained(first: Range, others: Iterator[Range]) -> Iterator[Range]:
    yield first
    yield from others


def _words(client: Any) -> str:
    count = len(client.scheduler_info(n_workers=-1)["workers"])
    return f"{count} worker{'' if count == 1 else 's'}" if count else "waiting for workers"


@contextmanager
def _client(cluster: Cluster) -> Iterator[Any]:
    """Client of a running scheduler, or of a cluster of processes that ends with it."""
    import dask
    from distributed import Client, LocalCluster

    for name in ("distributed", "tornado.application"):  # what they say of an interrupt is no news
        logging.getLogger(name).setLevel(logging.CRITICAL)
    settings = {"distributed.scheduler.allowed-failures": 3, "distributed.comm.timeouts.connect": "120s"}
    with dask.config.set(settings):
        if cluster.scheduler or cluster.scheduler_file:
            given = {"address": cluster.scheduler} if cluster.scheduler else {"scheduler_file": cluster.scheduler_file}
            place = cluster.scheduler or cluster.scheduler_file
            try:
                client = Client(**given, timeout=PATIENCE, set_as_default=False)
            except (OSError, ValueError, TimeoutError) as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise ConfigurationError(f"scheduler {place}: cannot be reached ({reason})") from None
            with client:
                yield client
            return
        dashboard = ":0" if find_spec("bokeh") else None
        options = {"threads_per_worker": 1, "memory_limit": 0, "silence_logs": logging.CRITICAL}
        try:
            local = LocalCluster(cluster.workers, dashboard_address=dashboard, **options)
        except (OSError, RuntimeError) as error:  # a machine too busy to start them in time, or without room for more
            reason = " ".join(str(error).split()) or type(error).__name__
            raise CampaignError(f"workers cannot be started ({reason})") from None
        with local, Client(local, set_as_default=False) as client:
            yield client


def _check_workers(client: Any) -> None:
    """Raise ConfigurationError for a worker of another version; those that join later check themselves."""
    own = software_version()
    try:
        versions = client.run(software_version, on_error="return")
    except Exception as error:
        raise ConfigurationError(f"workers: cannot be asked for their version ({error})") from None
    for worker, version in versions.items():
        if isinstance(version, Exception):
            raise ConfigurationError(f"worker {worker}: has no formation_gnc that flies campaigns ({version})")
        if version != own:
            raise ConfigurationError(
                f"worker {worker}: has formation_gnc {version}, the campaign {own}; install the same on both"
            )


def _fly(
    client: Any, campaign: Campaign, results: Dataset, missing: Iterator[Range], show: Callable[[int], None]
) -> None:
    from distributed import as_completed

    directory, own = str(results.directory.absolute()), (campaign.identity, software_version())
    done = sum(min(end, campaign.runs) - first for first, end in results.done() if first < campaign.runs)

    def submit(cases: Range) -> Any:
        key = f"cases-{cases[0]}-{cases[1]}-{own[0][:12]}"
        ranges[key] = cases
        return client.submit(fly_range, directory, *own, cases, key=key, pure=False)

    def most() -> int:
        return AHEAD * max(1, sum(map(int, client.nthreads().values())))

    ranges: dict[str, Range] = {}
    show(done)
    pending = as_completed([submit(each) for each in islice(missing, most())], loop=client.loop)
    for future in pending:
        cases = ranges.pop(future.key)
        for again in _finish(future, cases, directory, own):
            pending.add(submit(again))
        if future.status != "error" or cases[1] - cases[0] == 1:
            done += cases[1] - cases[0]
        future.release()
        show(done)
        for more in islice(missing, max(0, most() - len(ranges))):
            pending.add(submit(more))


def _finish(future: Any, cases: Range, directory: str, own: tuple[str, str]) -> Iterator[Range]:
    """Take a result; gives the single cases of a range whose workers died, to be flown again."""
    from distributed import KilledWorker

    if future.status == "cancelled":
        raise CampaignError("the scheduler is gone")
    if future.status != "error":
        return  # finished; the part stays when the worker dies with the number that it returned
    error = future.exception()
    if isinstance(error, KilledWorker):
        if cases[1] - cases[0] > 1:
            yield from ((case, case + 1) for case in range(*cases))
        else:
            note_lost(directory, *own, cases[0], "the worker died each time that this case was flown")
    elif isinstance(error, VersionError | UnseenDirectoryError):
        raise ConfigurationError(str(error))
    elif isinstance(error, OSError):
        raise CampaignError(f"results {directory}: cannot be written ({error.strerror or error})")
    else:
        raise CampaignError(f"cases {cases[0]} to {cases[1] - 1}: {type(error).__name__}: {error}")
