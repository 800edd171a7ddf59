"""Campaigns on a real scheduler and workers over TCP: the same data set, whoever flies it and whatever dies."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from formation_gnc.campaign import engine
from formation_gnc.campaign.dataset import CASES, ERRORS, Dataset
from formation_gnc.campaign.definition import load_campaign
from formation_gnc.campaign.version import software_version
from formation_gnc.campaign.worker import fly_range
from formation_gnc.cli import main

RUNS = 16
PATIENCE = 240.0  # s of wall time, for a machine that is busy with other things

pytestmark = pytest.mark.thorough


def wait_until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"{what}: not in {PATIENCE:g} s"
        time.sleep(0.05)


def start(*words: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-m", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


class RunningCluster:
    """A scheduler and workers, each a process."""

    def __init__(self, directory: Path) -> None:
        self.file = directory / "scheduler.json"
        words = ("dask", "scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0")
        self.scheduler = start(*words, "--scheduler-file", str(self.file))
        self.workers = [self.add_worker(), self.add_worker()]

    def add_worker(self) -> subprocess.Popen[bytes]:
        words = (
            "dask",
            "worker",
            "--scheduler-file",
            str(self.file),
            "--nthreads",
            "1",
            "--no-nanny",
            "--no-dashboard",
        )
        return start(*words, "--host", "127.0.0.1")

    def stop(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[RunningCluster]:
    running = RunningCluster(tmp_path_factory.mktemp("cluster"))
    yield running
    running.stop()


@pytest.fixture(scope="module")
def file(tmp_path_factory, small) -> Path:
    path = tmp_path_factory.mktemp("campaign") / "small.yaml"
    path.write_text(small)
    return path


@pytest.fixture(scope="module")
def flown_alone(file, tmp_path_factory) -> Dataset:
    """Results of one process without Dask, in one part."""
    campaign, results = load_campaign(file, RUNS), Dataset(tmp_path_factory.mktemp("alone") / "results")
    results.create(campaign, software_version(), "", RUNS)
    fly_range(str(results.directory), campaign.identity, software_version(), (0, RUNS))
    return results


def same(one: Dataset, other: Dataset) -> bool:
    """Whether two data sets have the same bits, once sorted."""
    names = one.names()
    tables = [[each.table(names), each.table(["deputy", "x", "y", "z"], ERRORS)] for each in (one, other)]
    return names == other.names() and tables[0] == tables[1]


def fly(file, cluster, out, *more):
    return main(
        ["campaign", str(file), "--runs", str(RUNS), "--scheduler-file", str(cluster.file), "--out", str(out), *more]
    )


@pytest.fixture(autouse=True)
def without_check(monkeypatch):
    """Dispersions are checked in test_application."""
    monkeypatch.setattr("formation_gnc.campaign.application.check_application", lambda *_: None)
    monkeypatch.setattr("formation_gnc.campaign.report.write_report", lambda flights, outcomes, path: path)


def parts(out):
    return len(list((out / CASES).glob("part-*")))


def test_killed_worker_leaves_no_hole(file, cluster, flown_alone, tmp_path, monkeypatch, capsys):
    out, killed, finish = tmp_path / "results", [], engine._finish

    def finish_and_kill(*arguments):
        if not killed:
            killed.append(cluster.workers.pop())
            killed[0].send_signal(signal.SIGKILL)
            killed[0].wait()
        return finish(*arguments)

    monkeypatch.setattr(engine, "_finish", finish_and_kill)
    assert fly(file, cluster, out, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert killed
    assert told["runs"] == RUNS
    assert {each["verdict"] for each in told["requirements"]} <= {"met", "not enough runs"}
    assert same(Dataset(out), flown_alone)


@pytest.mark.parametrize("killed_by", [signal.SIGTERM, signal.SIGKILL])
def test_killed_client_goes_on_with_what_is_done(killed_by, file, cluster, flown_alone, tmp_path, capsys):
    out = tmp_path / "results"
    words = ["campaign", str(file), "--runs", str(RUNS), "--scheduler-file", str(cluster.file), "--out", str(out)]
    code = (
        "import sys; from formation_gnc.campaign import application; application.check_application = lambda *_: None; "
        "from formation_gnc.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    client = subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: parts(out) >= 1, "a part")
    os.kill(client.pid, killed_by)
    error = client.communicate(timeout=PATIENCE)[1]
    if killed_by == signal.SIGTERM:
        assert client.returncode == 130
        assert f"of {RUNS} cases kept in {out}, --resume goes on" in error
        assert len(error.splitlines()) == 1
    assert 1 <= parts(out) < RUNS
    assert fly(file, cluster, out) == 2
    assert "exist already; --resume goes on" in capsys.readouterr().err
    assert fly(file, cluster, out, "--resume") == 0
    assert same(Dataset(out), flown_alone)


def test_worker_of_another_version_is_refused(file, cluster, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(engine, "software_version", lambda: "9.9.9")
    assert fly(file, cluster, tmp_path / "results") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"has formation_gnc {software_version()}, the campaign 9.9.9" in line


def test_results_that_cannot_be_written_end_the_flights(file, cluster, tmp_path, monkeypatch, capsys):
    out = tmp_path / "results"
    create = Dataset.create

    def create_without_room(self, *arguments):
        create(self, *arguments)
        (self.directory / CASES).rmdir()
        (self.directory / CASES).write_text("")

    monkeypatch.setattr(Dataset, "create", create_without_room)
    assert fly(file, cluster, out) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be written" in line


def test_scheduler_that_does_not_answer_is_named(file, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(engine, "PATIENCE", 0.5)
    words = ["campaign", str(file), "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "results")]
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("formation-gnc: scheduler tcp://127.0.0.1:9: cannot be reached")


def test_workers_that_do_not_start_are_told_in_one_line(file, tmp_path, monkeypatch, capsys):
    def late(*_, **__):
        raise TimeoutError

    monkeypatch.setattr("distributed.LocalCluster", late)
    assert main(["campaign", str(file), "--out", str(tmp_path / "results")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("formation-gnc: workers cannot be started (TimeoutError); 0 of 6 cases kept")
