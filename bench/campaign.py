"""Campaigns: cases per second beside a bare pool of processes, and what a million cases cost the client."""

import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any
from unittest.mock import patch

from bench.result import Result, interleaved
from formation_gnc.campaign import engine
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import Campaign, load_campaign
from formation_gnc.campaign.engine import Cluster
from formation_gnc.campaign.version import software_version
from formation_gnc.campaign.worker import fly_range

CASES = 40
"""Cases of a measurement, of half a second of processor time or so each."""

ROUNDS = 3
"""Measurements of each, in turn."""

MILLION = 1_000_000

CAMPAIGN = """
scenario: leader_follower
runs: {runs}
set: {{plant.tick: 10.0, plant.duration: 5800.0}}
dispersions:
  plant.deputy1.mass: {{uniform: {{low: 90.0, high: 110.0}}}}
"""


def empty(directory: str, identity: str, version: str, cases: tuple[int, int]) -> int:
    """Stands for `fly_range`, and does nothing."""
    return cases[1] - cases[0]


def _memory() -> float:
    """Resident memory of this process, MB: client and scheduler."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@contextmanager
def _cluster(workers: int) -> Iterator[Any]:
    from distributed import LocalCluster

    with LocalCluster(workers, threads_per_worker=1, memory_limit=0, dashboard_address=None) as cluster:
        yield cluster


def _prepared(directory: str, name: str, runs: int, block: int) -> tuple[Campaign, Dataset]:
    file = Path(directory) / "bench.yaml"
    file.write_text(CAMPAIGN.format(runs=runs))
    campaign, results = load_campaign(file), Dataset(Path(directory) / name)
    results.create(campaign, software_version(), "", block)
    return campaign, results


def _by_campaign(directory: str, cluster: Any, name: str, runs: int) -> float:
    campaign, results = _prepared(directory, name, runs, 1)
    started = perf_counter()
    engine.fly(campaign, results, Cluster(scheduler=cluster.scheduler_address), lambda done, workers: None)
    return runs / (perf_counter() - started)


def _by_pool(directory: str, pool: ProcessPoolExecutor, name: str, runs: int) -> float:
    campaign, results = _prepared(directory, name, runs, 1)
    words = str(results.directory), campaign.identity, software_version()
    started = perf_counter()
    for flown in [pool.submit(fly_range, *words, (case, case + 1)) for case in range(runs)]:
        flown.result()
    return runs / (perf_counter() - started)


def run() -> list[Result]:
    """Rates, and memory."""
    cores = os.cpu_count() or 1
    with (
        tempfile.TemporaryDirectory() as directory,
        _cluster(cores) as cluster,
        ProcessPoolExecutor(cores, mp_context=get_context("spawn")) as pool,
    ):
        _by_campaign(directory, cluster, "warm", 4 * cores)
        _by_pool(directory, pool, "warm_pool", 4 * cores)
        names = count()
        ours, theirs = interleaved(
            (
                lambda: _by_campaign(directory, cluster, f"ours_{next(names)}", CASES),
                lambda: _by_pool(directory, pool, f"theirs_{next(names)}", CASES),
            ),
            ROUNDS,
        )
    with tempfile.TemporaryDirectory() as directory, _cluster(1) as one:
        _by_campaign(directory, one, "warm", 4)
        alone = _by_campaign(directory, one, "alone", CASES // cores)
        campaign, results = _prepared(directory, "empty", MILLION, 100)
        before, started = _memory(), perf_counter()
        with patch.object(engine, "fly_range", empty):
            engine.fly(campaign, results, Cluster(scheduler=one.scheduler_address), lambda done, workers: None)
        elapsed, more = perf_counter() - started, _memory() - before
    return [
        Result("campaign beside a pool of processes", ours, theirs, "cases/s", ours / theirs, ">= 0.95"),
        Result(f"campaign on {cores} workers beside one", ours, alone, "cases/s", ours / alone, ""),
        Result("a million empty cases: memory added, client and scheduler", more, before, "MB", more / before, ""),
        Result(
            "a million empty cases scheduled, beside one in 10 s",
            MILLION / elapsed,
            0.1,
            "cases/s",
            MILLION / elapsed / 0.1,
            "",
        ),
    ]
