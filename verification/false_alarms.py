"""Clean flights: how often supervision finds a fault where there is none.

A thousand flights, dispersed in start, mass, thrust and noise as far as the flight software is to stand silently.
`python -m verification.false_alarms SHARE` flies a share of them, the first ones of each scenario, as the page says.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from scipy.stats import binom

from formation_gnc.campaign import engine
from formation_gnc.campaign.case import CASE, REASON
from formation_gnc.campaign.dataset import Dataset
from formation_gnc.campaign.definition import load_campaign
from formation_gnc.campaign.version import software_version
from formation_gnc.sil.scenario import load_scenario
from verification.figure import TABLE, Figure, failures

RUNS = {"leader_follower": 400, "eccentric_leo": 300, "geostationary": 150, "tetrahedral": 100, "projected_circle": 50}
"""Flights of each scenario: more of those with fewer satellites."""

TICK, LONGEST = 10.0, 86400.0
"""Ticks of the flights, unless the scenario's are longer, and their duration at most, s."""

FLEETS = 12_000.0
"""The same of several satellites: acquisition, two revolutions, the reconfiguration of one."""

CONFIDENCE = 0.99
"""With which more alarms than allowed show that their probability is higher than stated."""

HEADING = f"""# False alarms

Flights without a fault, on ticks of {TICK:g} s, of a day at most, those of several satellites of {FLEETS:g} s: each
with its own noise, start (2 m and 2 mm/s of standard deviation on each axis), mass (1 %), misalignment (up to 0.02 rad)
and noise of the thrust (up to 5 %). {{flown}} of {sum(RUNS.values())} were flown.

Supervision states a probability of a false alarm for each satellite and flight (`false_alarm`); as many alarms are
allowed as that gives with {CONFIDENCE:.0%}.
"""


@dataclass(frozen=True)
class Clean:
    """What came of a scenario's flights."""

    scenario: str
    satellites: int
    probability: float
    """Of a false alarm, for each satellite and flight, as stated."""
    alarms: list[int]
    """Faults detected, by flight."""
    worst: float
    """Largest final error, m."""

    @property
    def allowed(self) -> int:
        """Flights with an alarm that the stated probability allows."""
        any_of_them = 1.0 - (1.0 - self.probability) ** self.satellites
        return int(binom.ppf(CONFIDENCE, len(self.alarms), any_of_them))


def document(scenario: str) -> str:
    """File of the campaign of a scenario."""
    plant = load_scenario(scenario).plant
    tick, longest = max(TICK, plant.tick), FLEETS if len(plant.deputies) > 1 else LONGEST
    duration = tick * int(min(plant.duration, longest) / tick)
    lines = [f"scenario: {scenario}", "seed: 15", "set:", f"  plant.tick: {tick}", f"  plant.duration: {duration}"]
    lines.append("dispersions:")
    for name in plant.deputies:
        lines += [
            f"  plant.{name}.relative_state: {{hill_normal: {{sigma: [2.0, 2.0, 2.0, 0.002, 0.002, 0.002]}}}}",
            f"  plant.{name}.mass: {{normal: {{mean: 1.0, sigma: 0.01}}, within: [0.95, 1.05], as: factor}}",
            f"  plant.{name}.thrusters.misalignment: {{uniform: {{low: 0.0, high: 0.02}}}}",
            f"  plant.{name}.thrusters.magnitude_noise: {{uniform: {{low: 0.0, high: 0.05}}}}",
        ]
    return "\n".join(lines) + "\n"


def fly_all(scenario: str, count: int, directory: Path) -> Clean:
    """The first flights of a scenario, with their results in a directory; raises RuntimeError for one that fails."""
    path = directory / f"clean_{scenario}.yaml"
    path.write_text(document(scenario))
    campaign, results = load_campaign(path, count), Dataset(directory / scenario)
    results.create(campaign, software_version(), "", 1)
    engine.fly(campaign, results, engine.Cluster(), lambda done, workers: None)
    given = load_scenario(scenario)
    names = [f"{name}.final_error_m" for name in given.plant.deputies]
    rows = results.table([REASON, "detections", *names]).to_pylist()
    for row in rows:
        if row[REASON]:
            raise RuntimeError(f"{scenario}, case {row[CASE]}: {row[REASON]}")
    supervisors = [modules["supervisor"] for modules in given.deputies.values()]
    worst = max(row[name] for row in rows for name in names)
    alarms = [row["detections"] for row in rows]
    return Clean(scenario, len(supervisors), max(each.false_alarm for each in supervisors), alarms, worst)


def main(output: Path, share: float = 1.0) -> int:
    """Fly a share of all and write the page; the number of scenarios with more alarms than allowed."""
    figures, counts = list[Figure](), {scenario: max(1, round(share * runs)) for scenario, runs in RUNS.items()}
    with TemporaryDirectory() as directory:
        for scenario, count in counts.items():
            clean = fly_all(scenario, count, Path(directory))
            alarmed = sum(each > 0 for each in clean.alarms)
            satellites = "1 satellite" if clean.satellites == 1 else f"{clean.satellites} satellites"
            words = f"{scenario}, {satellites}: flights with an alarm of {count}"
            figures.append(Figure(words, f"{clean.probability:g}", alarmed, "flights", 0.0, clean.allowed))
            print(f"{scenario}: {alarmed} of {count}, worst final error {clean.worst:.3g} m", flush=True)
    lines = [HEADING.format(flown=sum(counts.values())), TABLE.replace("printed", "stated")]
    (output / "false_alarms.md").write_text("\n".join([*lines, *(figure.row for figure in figures)]) + "\n")
    return failures(figures)


if __name__ == "__main__":
    sys.exit(main(Path("docs/verification"), float(sys.argv[1]) if len(sys.argv) > 1 else 1.0) > 0)
