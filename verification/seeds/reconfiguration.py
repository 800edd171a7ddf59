"""A reconfiguration in flight, on estimates: what a final time is good for."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from formation_gnc.control.registry import FINITE_HORIZONS
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from verification.figure import Figure, save
from verification.seeds.accepted import Ours

TICK, BEGIN, FINAL, END = 10.0, 4500.0, 4000.0, 10_500.0
"""s: ticks, when the target changes, the time for it, and when the flight is over."""
LAWS = ("lqr", "adaptive_lqr", "sdre", "sliding_mode", "dynamic_inversion", "sdre_finite", "asre", "mpsp", "gmpsp")


def fly(law: str) -> tuple[Any, Any, set[str]]:
    """Distance from the target (N,), m, forces (N, 3), N, and what failed."""
    own = {f"{law}.final_time": FINAL} if law in FINITE_HORIZONS else {}
    run = Run(
        load_scenario(
            "eccentric_leo",
            {
                "/**": {"tick": TICK},
                "/plant": {"duration": END},
                "/**/controller": {"algorithm": law, **own},
                "/**/guidance": {
                    "model": "yamanaka_ankersen",
                    "preview_steps": round(FINAL / 50.0),
                    "preview_step": 50.0,
                    "schedule": [f"{{at: {BEGIN}, relative_orbit.rho: 500.0}}"],
                },
            },
        )
    )
    records: dict[str, list[Any]] = {}
    run.fly(lambda topic, record: records.setdefault(topic, []).append(record))
    true = np.array([truth.deputies[0].relative_state for truth in records["/truth"]])
    aims = np.array([target.relative_state for target in records["/deputy1/target"]])
    failures = {status.fallback for status in records["/deputy1/status"]} - {""}
    return (
        np.linalg.norm((true - aims)[:, :3], axis=1),
        np.array([thrust.force for thrust in records["/deputy1/thrust"]]),
        failures,
    )


def section(directory: Path) -> tuple[str, list[Figure]]:
    """Every law of these documents on one change of formation."""
    lines = [
        "## A reconfiguration in flight",
        "",
        f"Scenario `eccentric_leo` (e = 0.08, J2 to J6, drag, 100 mN) on estimates, ticks of {TICK:g} s;",
        f"the target on the ellipse of Yamanaka and Ankersen. At {BEGIN:g} s the relative orbit grows",
        f"from 100 to 500 m, 460 m away. The laws with a final time have {FINAL:g} s for it, with a",
        "preview as long. Delta-v from then on, summed over the axes; errors of the true position, the",
        "last over 1000 s of holding.",
        "",
        "| law | delta-v, mm/s | peak, mN | error at the final time, m | greatest in the 1000 s after, m |",
        "|---|---|---|---|---|",
    ]
    figures, plot, ours = list[Figure](), plt.figure(figsize=(13, 5)), Ours()
    distance, thrust = plot.subplots(1, 2)
    change, arrival, later = (round(time / TICK) for time in (BEGIN, BEGIN + FINAL, BEGIN + FINAL + 1000.0))
    for law, width in zip(LAWS, np.linspace(4.0, 1.0, len(LAWS)), strict=True):
        error, force, failures = fly(law)
        spent = TICK / 100.0 * 1e3 * float(np.abs(force[change:]).sum())
        peak = 1e3 * float(np.abs(force[change:]).max())
        words = [
            ours(f"{law}: delta-v", spent, ".0f", "mm/s"),
            ours(f"{law}: peak", peak, ".1f", "mN"),
            ours(f"{law}: error at the final time", error[arrival], ".2f", "m"),
            ours(f"{law}: greatest error later", error[arrival:later].max(), ".2f", "m"),
        ]
        lines.append(f"| {law} | {' | '.join(words)} |")
        times = TICK * np.arange(len(error))
        distance.semilogy(times, error, lw=width, label=law)
        thrust.plot(times, 1e3 * np.abs(force).max(axis=1), lw=width, label=law)
        if law in FINITE_HORIZONS:
            figures += [
                Figure(f"{law}: error at the final time", "", float(error[arrival]), "m", 0.0, MISS[law]),
                Figure(f"{law}: plans that failed", "", len(failures), "", 0, 0),
            ]
    lines += [
        "",
        "A regulator is asked for more than twice the thrust there is, so that it flies a trajectory of",
        "recovery first, 2500 s at 80 % of the limit and less, the same for all of them, and then regulates:",
        "that is where they differ. A plan takes its 4000 s, spends five eighths of that, and is there",
        "at the time. What it misses is the estimate's error at its last plan, 600 s before, and what grew",
        "from it. Afterwards LQR holds. The networks of adaptive LQR still unlearn the leap.",
        "",
        "![A reconfiguration in flight](seeds_reconfiguration.png)",
        "",
    ]
    distance.set(xlabel="time, s", ylabel="distance from the target, m")
    distance.legend(fontsize=8)
    thrust.set(xlabel="time, s", ylabel="largest force on an axis, mN")
    save(plot, directory / "seeds_reconfiguration.png")
    return "\n".join(lines), [*figures, *ours.cells]


MISS = dict.fromkeys(FINITE_HORIZONS, 2.0)
"""Greatest error at the final time, m: what the estimate allows."""
