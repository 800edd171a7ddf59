"""Campaigns flown by other workers, killed and resumed, and cases flown alone: the same bits, or what differs.

Each takes minutes; `python -m verification.campaigns bits` makes them, and keeps what came of them.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.campaign.dataset import CASES, ERRORS, Dataset
from formation_gnc.campaign.definition import find_campaign
from formation_gnc.recording import Bag, identical

RUNS = 40
DURATION = 1450.0
"""Of each flight, s: a quarter of an orbit."""

KILLED_AT = 6
"""Parts that are there when a worker or the client is killed."""

ALONE = (3, 17, 31)
"""Cases flown again alone."""

PATIENCE = 1800.0
"""Wall time (s) for a campaign."""

Row = tuple[str, str, str]
"""What was done, how it went, and whether the bits are the same ("" or what differs)."""


def command(*words: str) -> list[str]:
    """Command line of `formation-gnc`, without what costs time here: the page, and the check before the flights."""
    code = (
        "import sys; from formation_gnc.campaign import application, report; from formation_gnc.cli import main; "
        "application.check_application = lambda *_: None; report.write_report = lambda flights, outcomes, path: path; "
        "sys.exit(main(sys.argv[1:]))"
    )
    return [sys.executable, "-c", code, *words]


def digests(results: Path) -> dict[str, str]:
    """Digest of the sorted rows of each data set but `timing/`."""
    data = Dataset(results)
    tables = {CASES: data.table(data.names()), ERRORS: data.table(["deputy", "x", "y", "z"], ERRORS)}
    return {name: sha256(repr(table.to_pylist()).encode()).hexdigest() for name, table in tables.items()}


class Campaigns:
    """Flights of a shortened `leader_follower` in a directory."""

    def __init__(self, place: Path) -> None:
        """Write its file."""
        self.place, self.file = place, place / "short.yaml"
        text = find_campaign("leader_follower").read_text()
        self.file.write_text(text.replace("set:\n", f"set:\n  plant.duration: {DURATION}\n", 1))

    def words(self, name: str, *more: str) -> list[str]:
        """Command line of a campaign with results of this name."""
        out = str(self.place / name)
        return command("campaign", str(self.file), "--runs", str(RUNS), "--out", out, *more)

    def fly(self, name: str, *more: str) -> None:
        """Fly to the end; raises RuntimeError when it does not get there."""
        done = subprocess.run(self.words(name, *more), capture_output=True, text=True, timeout=PATIENCE, check=False)
        if done.returncode not in (0, 3):  # 3: a requirement is not met, as may be of half an orbit
            raise RuntimeError(f"{name}: status {done.returncode}: {done.stderr}")

    def parts(self, name: str) -> int:
        """Parts that are there."""
        return len(list((self.place / name / CASES).glob("part-*")))

    def fly_and(self, name: str, act: Callable[[psutil.Process], None], *more: str) -> int:
        """Fly, and act on the client's process once some parts are there; its exit status."""
        client = subprocess.Popen(self.words(name, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + PATIENCE
        while self.parts(name) < KILLED_AT and client.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        act(psutil.Process(client.pid))
        return client.wait(PATIENCE)


def kill_worker(client: psutil.Process) -> None:
    """Kill one of the processes that fly."""
    workers = [each for each in client.children(recursive=True) if "dask worker" in " ".join(each.cmdline())]
    os.kill(workers[0].pid, signal.SIGKILL)


def kill_client(client: psutil.Process) -> None:
    """Kill the client, and wait until its workers, which notice, are gone."""
    workers = client.children(recursive=True)
    os.kill(client.pid, signal.SIGKILL)
    psutil.wait_procs(workers, timeout=60.0)


def by_workers(campaigns: Campaigns) -> Iterator[Row]:
    """One, two and four workers; a killed worker; a killed client that goes on."""
    campaigns.fly("one", "--workers", "1")
    asked = digests(campaigns.place / "one")
    yield "1 worker", f"{campaigns.parts('one')} parts", ""

    def compared(name: str, how: str, words: str) -> Row:
        found = digests(campaigns.place / name)
        return how, words, ", ".join(each for each in asked if found[each] != asked[each])

    for count, name in ((2, "two"), (4, "four")):
        campaigns.fly(name, "--workers", str(count))
        yield compared(name, f"{count} workers", f"{campaigns.parts(name)} parts")
    status = campaigns.fly_and("worker", kill_worker, "--workers", "2")
    yield compared("worker", "2 workers, one killed by SIGKILL", f"status {status}, {campaigns.parts('worker')} parts")
    status = campaigns.fly_and("client", kill_client, "--workers", "2")
    left = campaigns.parts("client")
    campaigns.fly("client", "--workers", "2", "--resume")
    words = f"status {status} with {left} of {RUNS} parts, then all"
    yield compared("client", "client killed by SIGKILL, then `--resume`", words)


def alone(campaigns: Campaigns) -> Iterator[Row]:
    """Cases flown again alone, in-process and on the node graph, beside each other and the data set `one`."""
    for case in ALONE:
        bags = []
        for name, more in (("in-process", []), ("on the node graph", ["--on-graph"])):
            bags.append(campaigns.place / f"{case} {name}")
            words = campaigns.words("one", "--only", str(case), "--bag", str(bags[-1]), *more)
            done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
            told = [line for line in done.stderr.splitlines() if "figures" in line]
            same = len(told) == 1 and told[0].endswith("bit for bit")
            differs = "" if same else " ".join(told) or done.stderr[-300:]
            yield f"case {case} {name}, its figures beside the data set's", f"status {done.returncode}", differs
        pair = [Bag(bag) for bag in bags]
        topics = gnc_topics(*pair)
        apart = [each.topic for each in identical(*pair, topics)]
        yield f"case {case}, both bags", f"{len(topics)} topics", ", ".join(apart)


def make() -> Iterator[Row]:
    """Fly all."""
    with TemporaryDirectory() as directory, suppress(KeyboardInterrupt):
        campaigns = Campaigns(Path(directory))
        yield from by_workers(campaigns)
        yield from alone(campaigns)
