"""Drift of every formation in free flight, what assignment and phase save, and a fleet on the graph.

`main` writes `guidance.md` and its plots, and returns the number of figures outside their tolerance.
"""

import math
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from bench import fleet as bench
from formation_gnc.analysis.compare import gnc_topics
from formation_gnc.analysis.figures import figures as figures_of
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.analysis.separation import predicted_approach
from formation_gnc.analysis.trajectory import trajectories
from formation_gnc.cli import main as command
from formation_gnc.common import CommonParameters, Orbit
from formation_gnc.guidance.assignment import assign, assign_with_phase, transfer_costs
from formation_gnc.guidance.registry import FORMATIONS
from formation_gnc.guidance.targets import TARGET_MODELS, TargetPath
from formation_gnc.orbit.elements import Elements, state_from_elements
from formation_gnc.orbit.forces.model import Forces
from formation_gnc.orbit.frames import inertial_from_relative, relative_from_inertial
from formation_gnc.orbit.propagation import Propagator
from formation_gnc.recording import Bag, identical
from formation_gnc.relative.hill import HillModel
from verification.figure import TABLE, Figure, failures

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]

ORBITS, POINTS = 10, 32
CIRCULAR = CommonParameters(Orbit(7078136.3, 0.0, 1.7104, 0.0, 0.0, 0.0))
ECCENTRIC = CommonParameters(Orbit(7078136.3 / 0.9, 0.1, 1.7104, 0.0, 0.5, 0.0))
CHIEFS = (("circular, 700 km, i = 98 deg", CIRCULAR), ("e = 0.1, perigee 700 km", ECCENTRIC))
CASES = 100
MODELS = ("hill", "yamanaka_ankersen", "j2_mean_motion")
"""Of the target, in the tables."""

CHANGE = 8890.0
"""When the scenario tetrahedral changes its formation, s."""


def times(common: CommonParameters) -> Array:
    """Instants of ten orbits, s."""
    return math.tau / common.mean_motion / POINTS * np.arange(ORBITS * POINTS + 1)


def path(name: str, slot: int, model: str, common: CommonParameters) -> TargetPath:
    """Target of a slot of a formation with its default parameters."""
    formation = FORMATIONS[name]
    return TARGET_MODELS[model](formation(formation.Parameters(), common.mean_motion, slot), 0.0, common)


def flown_slots(name: str) -> range:
    """Slots that are flown: all, or the first four of a formation without end."""
    formation = FORMATIONS[name]
    return range(formation.slot_count(formation.Parameters()) or 4)


def flown(starts: Array, common: CommonParameters, forces: Forces) -> Array:
    """(satellites, N, 6) relative states of satellites that start at `starts` (satellites, 6), unthrusted."""
    chief = state_from_elements(Elements(**vars(common.chief)))
    states = np.array([chief, *(inertial_from_relative(chief, start) for start in starts)])
    step = math.tau / common.mean_motion / POINTS
    propagator = Propagator(step, substeps=20, forces=forces)
    none, history = np.zeros_like(states[:, :3]), []
    for index in range(ORBITS * POINTS + 1):
        history.append([relative_from_inertial(states[0], deputy) for deputy in states[1:]])
        states = propagator.propagate(index * step, states, none)
    return np.array(history).transpose(1, 0, 2)


def own_flight(starts: Array, common: CommonParameters, carried: list[TargetPath]) -> Array:
    """(satellites, N, 6) free flight of `starts` under the target's own model, step by step."""
    instants = times(common)
    states, history = starts, [starts]
    for instant in instants[:-1]:
        states = carried[0].coast(states, float(instant), instants[1:2])[0]
        history.append(states)
    return np.array(history).transpose(1, 0, 2)


def drifts(directory: Path) -> tuple[str, list[Figure]]:
    """Distance from the target after ten orbits of free flight, by formation, model and truth."""
    point_mass, oblate = Forces(zonal_degree=0), Forces()
    lines, figures = ["## Free flight over ten orbits", ""], []
    lines += [
        "Greatest distance, m, of any satellite of the formation from its target, over ten orbits without",
        "thrust from a start on it. Own: the target's own model, step by step. Two-body and J2: two",
        "integrated inertial orbits. Formations with their default parameters (mostly a kilometre). The",
        "start of j2_mean_motion leaves out the short-period terms of J2; under a point mass it is that",
        "model that has the wrong rates. Hill's and J2's mean motion are for circular chiefs: about the",
        "ellipse they stand for what not to do, and the guidance says so in an event.",
        "",
    ]
    plot, charts = plt.subplots(1, 2, figsize=(14, 5.5))
    for chart, (title, common) in zip(charts, CHIEFS, strict=True):
        lines += [
            f"### Chief: {title}",
            "",
            "| formation | model | own | two-body | J2 |",
            "|---|---|---|---|---|",
        ]
        for name in FORMATIONS:
            for model in MODELS:
                carried = [path(name, slot, model, common) for slot in flown_slots(name)]
                targets = np.array([each.states(times(common)) for each in carried])
                size = float(np.linalg.norm(targets[..., :3], axis=2).max())
                off = {
                    label: np.linalg.norm((flight - targets)[..., :3], axis=2).max(axis=0)
                    for label, flight in (
                        ("own", own_flight(targets[:, 0], common, carried)),
                        ("two-body", flown(targets[:, 0], common, point_mass)),
                        ("J2", flown(targets[:, 0], common, oblate)),
                    )
                }
                worst = {label: float(values.max()) for label, values in off.items()}
                lines.append(f"| {name} | {model} | {worst['own']:.1e} | {worst['two-body']:.3g} | {worst['J2']:.3g} |")
                figures.append(
                    Figure(
                        f"{name}, {model}, {title}, own model",
                        "0",
                        worst["own"] / size,
                        "of the size",
                        0,
                        1e-6,
                    )
                )
                if name == "projected_circular_orbit":
                    chart.semilogy(times(common)[1:] * common.mean_motion / math.tau, off["J2"][1:], label=model)
        chart.set(title=f"projected circular orbit under J2; {title}", xlabel="orbits", ylabel="off its target, m")
        chart.grid(alpha=0.3, which="both")
        chart.legend()
        lines.append("")
    plot.tight_layout()
    plot.savefig(directory / "guidance_drift.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    worst_own = max(figures, key=lambda figure: figure.ours)
    lines += [TABLE, worst_own.row, "", "![Drift of a projected circular orbit](guidance_drift.png)", ""]
    return "\n".join(lines), figures


def assignments(directory: Path) -> tuple[str, list[Figure]]:
    """Delta-v of fixed order, best slots, and best slots with the best phase."""
    rate = CIRCULAR.mean_motion
    duration = 2.0 * math.tau / rate

    def goal(phase: float) -> Array:
        at = np.array([phase / rate])
        formation = FORMATIONS["three_in_plane_one_out"]
        return np.array([formation(formation.Parameters(), rate, k).states(at)[0] for k in range(4)])

    tetrahedron = FORMATIONS["tetrahedral"]
    start = np.array([tetrahedron(tetrahedron.Parameters(), rate, k).states(np.zeros(1))[0] for k in range(4)])
    generator = np.random.default_rng(1)
    cases = [start]
    for _ in range(CASES):  # bounded relative orbits of some hundred metres
        state = generator.normal(0.0, 500.0, (4, 6)) * np.repeat([1.0, rate], 3)
        cases.append(np.asarray(HillModel(rate).bounded(0.0, state)))
    spent = []
    for states in cases:
        costs = transfer_costs(states, goal, duration, rate)
        table = costs(0.0)
        slots = assign(table)
        best = assign_with_phase(costs)
        spent.append([float(np.trace(table)), float(table[range(4), list(slots)].sum()), float(sum(best.delta_v))])
    ours = np.array(spent)
    saved = 1.0 - ours[:, 1:] / ours[:, :1]
    random = saved[1:]
    lines = [
        "## Places and phase",
        "",
        "Predicted delta-v of four satellites to three-in-plane-one-out in two orbits, all together, m/s:",
        "in the order they come, with the best slots, and with the best phase too. From the tetrahedron,",
        f"and from {CASES} random sets of relative orbits without drift (500 m, one sigma).",
        "",
        "| start | fixed order | best slots | slots and phase | saved by slots | by both |",
        "|---|---|---|---|---|---|",
        f"| tetrahedron | {ours[0, 0]:.3f} | {ours[0, 1]:.3f} | {ours[0, 2]:.3f} | {saved[0, 0]:.1%} | "
        f"{saved[0, 1]:.1%} |",
        f"| random, mean | {ours[1:, 0].mean():.3f} | {ours[1:, 1].mean():.3f} | {ours[1:, 2].mean():.3f} | "
        f"{random[:, 0].mean():.1%} | {random[:, 1].mean():.1%} |",
        f"| random, least saved | | | | {random[:, 0].min():.1%} | {random[:, 1].min():.1%} |",
        f"| random, most saved | | | | {random[:, 0].max():.1%} | {random[:, 1].max():.1%} |",
        "",
    ]
    never = "never a loss"
    beyond = (saved[:, 1] - saved[:, 0]).min()
    figures = [
        Figure("least saved by slots", never, 100.0 * float(saved[:, 0].min()), "%", -1e-9, 100.0),
        Figure("least saved by phase beyond slots", never, 100.0 * float(beyond), "%", -1e-9, 100.0),
    ]
    lines += [TABLE, *(figure.row for figure in figures), "", "![Savings](guidance_assignment.png)", ""]
    plot, chart = plt.subplots(figsize=(8, 5))
    chart.hist(100.0 * random, bins=20, label=["best slots", "slots and phase"])
    chart.set(xlabel="predicted delta-v saved against the fixed order, %", ylabel=f"cases of {CASES}")
    chart.legend()
    plot.tight_layout()
    plot.savefig(directory / "guidance_assignment.png", dpi=110, metadata={"Software": None})
    plt.close(plot)
    return "\n".join(lines), figures


def fleet(directory: Path) -> tuple[str, list[Figure]]:
    """The scenario tetrahedral on the node graph, a process for each satellite, and in-process."""
    with tempfile.TemporaryDirectory() as folder:
        bags = []
        for way in ("--composed", "--in-process"):
            path = Path(folder) / way.strip("-")
            if command(["sil", "tetrahedral", way, "--json", "--bag", str(path)]) != 0:
                raise RuntimeError(f"formation-gnc sil tetrahedral {way} failed")
            bags.append(Bag(path))
        return of_fleet(*bags)


def of_fleet(graph: Bag, process: Bag) -> tuple[str, list[Figure]]:
    """What the two runs show: who arrives, how near they came, and whether the bits are the same."""
    topics = gnc_topics(graph, process)
    differences = identical(graph, process, topics)
    flown, orbit = figures_of(graph), math.tau / CIRCULAR.mean_motion
    lines = [
        "## Four satellites on the node graph",
        "",
        "`formation-gnc sil tetrahedral --composed`: from a tetrahedron to three in the plane and one out at",
        "8890 s, by LQR on estimates, J2 truth, six orbits, a process for each satellite, recorded; and the",
        "same `--in-process`. Off: true distance from the target; last: the most over the last orbit.",
        "",
        "| satellite | to go, m | off after an orbit, m | last, m | delta-v, m/s |",
        "|---|---|---|---|---|",
    ]
    latest = 0.0
    for name, deputy in flown.deputies.items():
        path = trajectories(graph)[name]
        off = np.linalg.norm(path.error, axis=1)
        last = float(off[path.time > path.time[-1] - orbit].max())
        latest = max(latest, last)
        to_go, later = (float(np.interp(CHANGE + wait, path.time, off)) for wait in (1.0, orbit))
        lines.append(f"| {name} | {to_go:.0f} | {later:.1f} | {last:.2f} | {deputy.delta_v_m_s:.3f} |")
    lines += ["", "| nearest approach | m | who | when, s |", "|---|---|---|---|"]
    nearest = RunHistory(graph).nearest
    foreseen = {kind: predicted_approach(graph, kind) for kind in ("planned", "passive")}
    words = {
        "planned": "predicted, one on target and the others coasting",
        "passive": "predicted, all coasting",
    }
    for label, each in {"flown": nearest, **{words[kind]: foreseen[kind] for kind in words}}.items():
        assert each is not None, "four satellites have a nearest approach"
        lines.append(f"| {label} | {each.distance:.1f} | {' and '.join(each.pair)} | {each.time:.0f} |")
    assert nearest is not None
    figures = [
        Figure("off target over the last orbit, the worst of four", "(required)", latest, "m", 0.0, 5.0),
        Figure("nearest approach flown", "(required)", nearest.distance, "m", 100.0, math.inf),
        Figure("ticks missed", "(required)", float(flown.misses), "", 0.0, 0.0),
        Figure("topics that differ in-process", "(required)", float(len(differences)), "", 0.0, 0.0),
    ]
    lines += ["", TABLE, *(figure.row for figure in figures), ""]
    return "\n".join(lines), figures


def eight(_: Path) -> tuple[str, list[Figure]]:
    """Eight satellites on the node graph beside one: what a tick takes, and of whom."""
    lines = [
        "## Eight satellites on two cores",
        "",
        f"`python -m bench fleet`: {bench.SCENARIO} on the node graph, a process for each satellite,",
        f"all on {bench.CORES} cores, no recorder; means of {bench.ROUNDS} flights of some seconds. Work:",
        "processor time a tick. Cores: how many were busy, work times ticks/s; what is missing was waited",
        "for, or taken by others on the machine. Alone: work of plant and satellites without a graph, in",
        "one process.",
        "",
        "| satellites | ticks/s | of all | plant, ms | a satellite, ms | all work, ms | cores | alone, ms |",
        "|---|---|---|---|---|---|---|---|",
    ]
    flown = bench.flights()
    for name, each in flown.items():
        lines.append(
            f"| {name} | {each.speed:.0f} | {each.deputies * each.speed:.0f} | {1e3 * each.plant:.2f} | "
            f"{1e3 * each.satellites / each.deputies:.2f} | {1e3 * each.work:.2f} | {each.cores:.2f} | "
            f"{1e3 * each.arithmetic:.2f} |"
        )
    figures = [Figure(f"ticks missed, {name}", "(required)", each.misses, "", 0.0, 0.0) for name, each in flown.items()]
    lines += ["", TABLE, *(figure.row for figure in figures), ""]
    return "\n".join(lines), figures


def main(directory: Path) -> int:
    """Write the page and its plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    sections, figures = [], []
    for part in (drifts, assignments, fleet, eight):
        text, limits = part(directory)
        sections.append(text)
        figures += limits
    heading = "# Guidance\n\nWritten by `verification/guidance.py`; theory: [guidance](../theory/guidance.md).\n\n"
    (directory / "guidance.md").write_text(heading + "\n".join(sections))
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
