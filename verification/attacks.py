"""Attacks on a live graph: what was sent, what the flight did, what was said, and whether its bag is whole and replays.

`python -m verification.attacks [WORDS ...]` makes those whose names contain one of the words, or all, and keeps what
they did in `verification/attacks.csv`; `python -m verification attacks` writes docs/verification/attacks.md of it.
"""

import csv
import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from threading import Thread
from time import sleep

from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.analysis.figures import figures
from formation_gnc.commands.replay import differences_of_replay
from formation_gnc.errors import BagError, ConfigurationError
from formation_gnc.flight import topics
from formation_gnc.flight.topics import QUEUE_DEPTH
from formation_gnc.recording import Bag, identical
from formation_gnc.recording.recover import recover
from formation_gnc.records import EventKind
from formation_gnc.sil.recorded_flight import fly
from formation_gnc.sil.report import Report
from formation_gnc.sil.scenario import Scenario, load_scenario
from formation_gnc.transport.launcher import LaunchOptions, fly_graph
from formation_gnc.transport.processes import NodeDied
from verification.attack_kinds.kinds import ATTACKS
from verification.attack_kinds.raid import raiding

TICKS = 300
BEGIN = 20
"""Tick from which a stranger acts."""

AFTER = 2.0
"""Wall time (s) that a stranger stays."""

PACE = 30.0
"""Ticks a second."""

KEPT = Path(__file__).with_name("attacks.csv")
PAGE = "attacks.md"
NAME = "formation_gnc"

ENDED = ("the bag deleted",)
"""After which there is no bag to look at."""


@dataclass(frozen=True)
class Outcome:
    """What a flight did under an attack."""

    attack: str
    ticks: int
    misses: int
    error_m: str
    """Final control error of the deputy."""
    bits: str
    """Whether the flight is that of the same seed alone, to the bit."""
    bag: str
    replay: str
    said: str
    trouble: str = ""
    """What falls short: a node that died, an attack that could not be made."""

    @property
    def is_stood(self) -> bool:
        """Whether the flight went on to its end, with a bag that is whole and replays."""
        has_bag = self.attack in ENDED or (self.bag == "whole" and self.replay == "same bits")
        return not self.trouble and self.ticks == TICKS and has_bag

    @property
    def row(self) -> str:
        """Line of the table."""
        verdict = "stood" if self.is_stood else "**not stood**" + (f": {self.trouble}" if self.trouble else "")
        said = self.said.replace("|", "\\|").replace("<", "&lt;")
        cells = (self.attack, self.ticks, self.misses, self.error_m, self.bits, self.bag, self.replay, said, verdict)
        return f"| {' | '.join(map(str, cells))} |"


def scenario(seed: int, factor: float = 0.0) -> Scenario:
    """What is flown; paced by a factor where there has to be time for an attack."""
    plant = {"duration": float(TICKS), "seed": seed, "on_recorder_loss": "continue", "deadline": 10.0}
    return load_scenario("leader_follower", {"/plant": plant | {"real_time_factor": factor}})


def attacked(name: str, place: Path, other: Bag, alone: Bag) -> Outcome:
    """Fly once, under an attack."""
    place.mkdir()
    domain, last, troubles, failures = 0, Report("starting", {}), dict[str, None](), list[str]()
    bag = place / "bag"
    raid = Thread(target=lambda: _raid(name, domain, bag, other, failures), daemon=True)

    def announce(line: str) -> None:
        nonlocal domain
        if line.startswith("ROS_DOMAIN_ID="):
            domain = int(line.partition("=")[2])
        else:
            troubles[line.partition("; ")[0]] = None

    def show(report: Report) -> None:
        nonlocal last
        if "tick" in report.figures:
            last = report
        troubles.update(dict.fromkeys(report.troubles))
        if report.figures.get("tick", 0.0) >= BEGIN and not raid.ident:
            raid.start()

    try:
        fly_graph(scenario(1, PACE), LaunchOptions(bag, respawn=True), show, announce)
    except (NodeDied, ConfigurationError) as error:
        failures.append(str(error))
    if raid.ident:
        raid.join(20.0)
    return _looked_at(name, bag, alone, last, list(troubles), failures)


def _raid(name: str, domain: int, bag: Path, other: Bag, failures: list[str]) -> None:
    try:
        with raiding(domain, bag, other) as raid:
            ATTACKS[name](raid)
            sleep(AFTER)
    except Exception as error:  # a row of the table, whatever it is
        failures.append(f"attack not made: {type(error).__name__}: {error}")


def _looked_at(name: str, path: Path, alone: Bag, last: Report, troubles: list[str], failures: list[str]) -> Outcome:
    """What a flight that is over has left."""
    said, error, bits, whole, replay = list(troubles), "", "", "none", ""
    with suppress(BagError, ConfigurationError):
        bag = Bag(path)
        recovery = recover(path, None)
        whole = "whole" if recovery.status == 0 and not bag.damage else "; ".join(recovery.reasons) or "damaged"
        whole += f", {bag.lost} messages known to be lost" if bag.lost else ""
        error = f"{figures(bag).deputies['deputy1'].final_error_m:.3f}"
        events = bag.arrays(topics.EVENTS.name)
        rows = zip(events["kind"].tolist(), events["subject"].tolist(), events["detail"].tolist(), strict=True)
        said += [f"{subject}: {detail}" for kind, subject, detail in rows if kind == EventKind.WARNING]
        names = [topic for topic in gnc_topics(alone, bag) if topic != topics.EVENTS.name]
        bits = "same" if not identical(alone, bag, names) else "other"
        differences = differences_of_replay(bag)
        replay = "same bits" if not differences else f"differs: {differences[0]}"
    ticks, misses = (int(last.figures.get(each, 0.0)) for each in ("tick", "misses"))
    words = "; ".join(dict.fromkeys(each.removeprefix(": ")[:160] for each in said))
    whole = re.sub(r"/tmp/\S*/", "", whole)[:200]
    return Outcome(name, ticks, misses, error, bits, whole, replay, words[:400], "; ".join(failures)[:200])


def kept() -> dict[str, Outcome]:
    """Outcomes that are on record."""
    if not KEPT.exists():
        return {}
    with KEPT.open(newline="", encoding="utf-8") as stream:
        rows = [row | {name: int(row[name]) for name in ("ticks", "misses")} for row in csv.DictReader(stream)]
    return {row["attack"]: Outcome(**row) for row in rows}  # type: ignore[arg-type]


def keep(outcomes: dict[str, Outcome]) -> None:
    """Put outcomes on record, in the order of the attacks."""
    with KEPT.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, [each.name for each in fields(Outcome)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(outcomes[name]) for name in ATTACKS if name in outcomes)


def make(words: Sequence[str]) -> Iterator[Outcome]:
    """Make the attacks whose names contain one of some words, or all, one after the other."""
    with tempfile.TemporaryDirectory(prefix=f"{NAME}-verify-") as directory:
        place = Path(directory)
        alone, other = (fly(scenario(seed), place / f"seed{seed}") for seed in (1, 2))
        for number, name in enumerate(ATTACKS):
            if not words or any(word in name for word in words):
                yield attacked(name, place / f"flight{number}", other, alone)


def page(outcomes: Sequence[Outcome]) -> str:
    """The page of all attacks."""
    stood = sum(each.is_stood for each in outcomes)
    table = "\n".join(each.row for each in outcomes)
    return f"""# Attacks on a live graph

`python -m verification.attacks [WORDS ...]` makes them again, and `python -m verification attacks` writes this page.

Each flies `leader_follower` for {TICKS} ticks, {PACE:g} a second, with `--respawn` and `on_recorder_loss: continue`,
a process for each node. From tick {BEGIN} on, a stranger in the same ROS domain does what the table says. *Bits*:
whether the flight is, on every topic but `/events`, that of the same seed in-process without a stranger. *Said*:
warnings on `/events`, troubles of the run on `/diagnostics`, and nodes that were started again. A flight has stood an
attack if it flew all its ticks, its bag is whole, and its replay has its bits.

A flood of 20,000 messages at once may push one that counts out of a reader's queue of {QUEUE_DEPTH}: out of the plant's
or a module's, which is a miss after the deadline, or out of the recorder's, without which the replay cannot give what
that message led to. Such a flight goes on, and is in the table as not stood.

**{stood} of {len(outcomes)} flights have stood.**

| attack | ticks | misses | final error, m | bits | bag | replay | said | verdict |
|---|---|---|---|---|---|---|---|---|
{table}
"""


def main(directory: Path) -> int:
    """Write the page of what is on record; returns how many flights did not reach their end."""
    outcomes = list(kept().values())
    (directory / PAGE).write_text(page(outcomes), encoding="utf-8")
    return sum(bool(each.trouble) or each.ticks < TICKS for each in outcomes)


if __name__ == "__main__":
    found = kept()
    for outcome in make(sys.argv[1:]):
        found[outcome.attack] = outcome
        keep(found)
        print(outcome.row, flush=True)
