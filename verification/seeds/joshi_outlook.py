"""Joshi's outlook: two other nonlinear laws, sliding mode and dynamic inversion, beside MPSP and G-MPSP."""

from pathlib import Path

import numpy as np

from formation_gnc.control.controller import Controller
from verification.coverage.marker import covers
from verification.figure import Figure
from verification.seeds.accepted import NOISE, RELATIVE, Ours
from verification.seeds.cases import Array, effort
from verification.seeds.over_optimum import (
    CASES,
    FINAL,
    MASS,
    TICK,
    Case,
    ellipse,
    fly_law,
    label,
    law_for,
    least,
    model_of,
    orbit,
    planner,
    row,
)

PAGE = "joshi"

RATES = (0.004, 0.008)
"""rad/s, of the error: 2000 s are 8 and 16 time constants."""
REACHING_TIME = 500.0
"""Time to the sliding surface against no disturbance, s."""
UNLIMITED = 1e9
"""N; as of `law_for`."""

covers(
    "Joshi outlook: other nonlinear laws",
    "control/sliding_mode.py",
    "control/dynamic_inversion.py",
    figures=(
        "outlook: least effort of sliding mode and inversion over that of MPSP",
        "outlook: greatest miss of MPSP and G-MPSP",
    ),
    differs="asked for there, without a figure: flown on the cases of chapters 6 and 7",
)


def inverting(name: str, rate: float, case: Case) -> Controller[object]:
    """One of the two laws, with all of its rates set by one, rad/s."""
    eccentricity, oblate, rho = case
    own = {"model": model_of(oblate), "feed_forward": "nonlinear"}
    if name == "dynamic_inversion":
        return law_for(name, eccentricity, natural_frequency=rate, **own)
    reaching = rate * 1e3 * rho / REACHING_TIME * MASS / UNLIMITED
    return law_for(name, eccentricity, sliding_rate=rate, layer_rate=2.0 * rate, reaching=reaching, **own)


def spent(law: Controller[object], case: Case) -> tuple[float, float, float]:
    """Effort, m^2/s^3, delta-v, m/s, and miss, m, of a transfer."""
    eccentricity, oblate, rho = case
    states, accelerations, _ = fly_law(law, eccentricity, oblate, ellipse(rho), FINAL)
    miss: Array = (states[-1] - orbit(rho, 60.0, 1.5).states(np.array([FINAL]))[0])[:3]
    speed = TICK * float(np.linalg.norm(accelerations, axis=1).sum())
    return effort(accelerations, TICK), speed, float(np.linalg.norm(miss))


def flights(case: Case) -> dict[str, tuple[float, float, float]]:
    """What each law spends in a case, by its name in the table."""
    laws = {name: planner(name, *case[:2]) for name in ("mpsp", "gmpsp")}
    for name in ("sliding_mode", "dynamic_inversion"):
        laws |= {f"{name}, {rate:g} rad/s": inverting(name, rate, case) for rate in RATES}
    return {name: spent(law, case) for name, law in laws.items()}


def section(_: Path) -> tuple[str, list[Figure]]:
    """Effort, delta-v and miss of the four laws."""
    ours, flown = Ours(), {case: flights(case) for case in CASES}
    names = list(flown[CASES[0]])
    lines = [
        "## Outlook: sliding mode and dynamic inversion",
        "",
        "*These nonlinear control techniques should be explored and evaluated in comparison*: the transfers of",
        "[effort over the optimum](seeds.md#effort-over-the-optimum), 0.5 to 5 or 100 km in 2000 s, by the laws of the",
        "registry with nonlinear feed-forward and no thrust limit. Each cell: effort ∫|u|² dt over the optimum,",
        "delta-v ∫|u| dt, m/s, miss after 2000 s, m. The rate is ω of the inversion at ζ = 1, and Λ = β/2 of the",
        f"sliding mode, whose η would reach the surface in {REACHING_TIME:g} s.",
        "",
        "| e | J2 | to | " + " | ".join(names) + " |",
        "|---" * (3 + len(names)) + "|",
    ]
    for case in CASES:
        which, best, cells = label("outlook", case), least(*case), []
        for name, (cost, speed, miss) in flown[case].items():
            words = [
                ours(f"{which}, {name}: over the optimum", cost / best, ".4g"),
                ours(f"{which}, {name}: delta-v", speed, ".4g", "m/s"),
                ours(f"{which}, {name}: miss", miss, ".2g", "m", RELATIVE * miss + NOISE[0]),
            ]
            cells.append(", ".join(words))
        lines.append(row(case, cells))
    lines += ["", *VERDICT, ""]
    return "\n".join(lines), [*claims(flown), *ours.cells]


def claims(flown: dict[Case, dict[str, tuple[float, float, float]]]) -> list[Figure]:
    """What the text says, over all cases and rates."""
    effort_over, speed_over = (
        [own[name][which] / own["mpsp"][which] for own in flown.values() for name in own if "rad/s" in name]
        for which in (0, 1)
    )
    saved = [
        own[f"sliding_mode, {rate:g} rad/s"][0] / own[f"dynamic_inversion, {rate:g} rad/s"][0]
        for own in flown.values()
        for rate in RATES
    ]
    missed = max(own[name][2] for own in flown.values() for name in ("mpsp", "gmpsp"))
    return [
        Figure(
            "outlook: least effort of sliding mode and inversion over that of MPSP", "", min(effort_over), "", 5.0, 7.0
        ),
        Figure("outlook: least delta-v of both over that of MPSP", "", min(speed_over), "", 1.7, 2.3),
        Figure("outlook: greatest effort of sliding mode over inversion", "", max(saved), "", 0.1, 0.7),
        Figure("outlook: greatest miss of MPSP and G-MPSP", "", missed, "m", 0.0, 1e-3),
    ]


VERDICT = (
    "Neither law knows a final time. Inversion pulls hardest at the start, with ω² times the way: twice the rate",
    "is eight times the effort, for less of the way left. The bounded reaching spares the sliding mode 40 to 80 %",
    "of that. A plan that ends at the time spends a sixth of the effort and half of the delta-v, and misses",
    "nothing. What is left beside the transient, exp(−ωt): about an eccentric chief the target is no free motion,",
    "and its acceleration changes within a tick; under J2 the relative velocity leaves out that the orbit plane",
    "turns, and the target's path does not. In exchange both hold what they have reached, and the sliding mode",
    "says which disturbance it withstands.",
)
