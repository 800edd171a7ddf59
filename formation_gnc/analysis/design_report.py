"""Report of a designed control law: gains, poles, margins, bounds and sizes, as figures and as a picture."""

from dataclasses import dataclass, field
from functools import reduce
from math import asin, inf
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.plot import HILL_AXES
from formation_gnc.control.controller import Controller, Vehicle
from formation_gnc.control.controller_manager import ControllerParameters
from formation_gnc.control.linear import LinearController
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.relative.model import RelativeModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

FREQUENCIES = 200
"""Number of frequencies for singular values, up to half the sampling rate."""

PLACES = 360
"""Number of places along the orbit at which a periodic loop is closed."""


@dataclass(frozen=True)
class Design:
    """A designed law, seen from outside: its sampled loop without thrust limits.

    The poles of a periodic loop are its characteristic exponents; its singular values and margins are those
    of the loop at the start.
    """

    algorithm: str
    figures: dict[str, Any]
    """Value, a number or a list, by name with unit."""
    poles: Vector = field(default_factory=lambda: np.empty(0, dtype=complex))
    """(n,) continuous-time equivalents of the closed-loop poles, 1/s."""
    frequency: Vector = field(default_factory=lambda: np.empty(0))
    """(N,) rad/s."""
    singular_values: dict[str, Matrix] = field(default_factory=dict)
    """(N, 3) singular values by name; "gamma / ..." are bounds."""
    recovery: Matrix = field(default_factory=lambda: np.empty((0, 4)))
    """(N, 4) time, s, and position error, m, from an initial offset of 1 m in every axis."""


def design(parameters: ControllerParameters) -> Design:
    """Design the law that parameters of a controller select, and report it.

    Raises:
        DesignError: the parameters admit no law.
    """
    name, tick = parameters.algorithm, parameters.tick
    own = parameters.laws[name]
    law = ALGORITHMS[name](own, parameters, Vehicle(parameters.mass, np.array(parameters.thrust_limit)))
    figures = law.figures()
    controller = law.linear(0)
    if controller is None:
        return Design(name, figures)
    model = DESIGN_MODELS[own.model](parameters)
    loops, repeats = _loops(law, model, tick)
    monodromy = reduce(
        lambda before, loop: np.linalg.matrix_power(loop, repeats) @ before, loops, np.eye(len(loops[0]))
    )
    poles = np.log(np.linalg.eigvals(monodromy).astype(complex)) / (tick * repeats * len(loops))
    poles = poles[np.argsort(-poles.real)]
    frequency = np.geomspace(1e-2 * parameters.mean_motion, np.pi / tick, FREQUENCIES)
    values = _input_loop(controller, *model.discretise(0.0, tick), frequency * tick)
    figures |= _margins(values) | {"slowest time constant [s]": _or_none(-1.0 / poles.real.max())}
    own_values = law.singular_values(frequency)
    figures |= {f"largest {key}": float(each.max()) for key, each in own_values.items() if not _is_bound(key)}
    return Design(name, figures, poles, frequency, values | own_values, _recovery(loops, repeats, tick, poles))


def _is_bound(name: str) -> bool:
    return name.startswith("gamma /")


def _loops(law: Controller[Any], model: RelativeModel, tick: float) -> tuple[list[Matrix], int]:
    """Closed-loop transition matrices over a tick, at one place of the orbit or at `PLACES`, and the number
    of ticks for which each holds."""
    places = 1 if model.is_time_invariant else PLACES
    repeats = 1 if model.is_time_invariant else max(1, round(model.period / places / tick))
    loops = []
    for place in range(places):
        time = (place + 0.5) * repeats * tick if places > 1 else 0.0
        controller = law.linear(round(time * NANOSECONDS))
        assert controller is not None, "a law is linear at all times or never"
        loops.append(controller.closed_loop(*model.discretise(time, tick)))
    return loops, repeats


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) and value > 0.0 else None


def _input_loop(controller: LinearController, phi: Matrix, gamma: Matrix, angle: Vector) -> dict[str, Matrix]:
    """Singular values (N, 3) of S_I = (I + K G)^-1 and T_I of the loop broken at the thrusters.

    Args:
        controller: K.
        phi, gamma: of the plant G, (6, 6) and (6, 3).
        angle: (N,) of z on the unit circle, rad.
    """
    output = np.eye(6)[: controller.b.shape[1]]
    sensitivity, complement = [], []
    for each in angle:
        z = np.exp(1j * each)
        plant = output @ np.linalg.solve(z * np.eye(6) - phi, gamma)
        size = len(controller.a)
        law = controller.c @ np.linalg.solve(z * np.eye(size) - controller.a, controller.b) + controller.d
        s = np.linalg.inv(np.eye(3) - law @ plant)
        sensitivity.append(np.linalg.svd(s, compute_uv=False))
        complement.append(np.linalg.svd(np.eye(3) - s, compute_uv=False))
    return {"S_I": np.array(sensitivity), "T_I": np.array(complement)}


def _margins(values: dict[str, Matrix]) -> dict[str, Any]:
    """Multivariable margins: simultaneous, independent errors of all thrusters' gains, or phases, that the
    loop tolerates."""
    s, t = float(values["S_I"].max()), float(values["T_I"].max())
    up = max(s / (s - 1.0) if s > 1.0 else inf, 1.0 + 1.0 / t)
    down = min(s / (s + 1.0), max(1.0 - 1.0 / t, 0.0))
    phase = 2.0 * asin(min(1.0, max(0.5 / s, 0.5 / t)))
    return {
        "largest S_I": s,
        "largest T_I": t,
        "gain margin, up": _or_none(up),
        "gain margin, down": down,
        "phase margin [deg]": float(np.degrees(phase)),
        "multiplicative uncertainty of thrust": 1.0 / t,
    }


def _recovery(loops: list[Matrix], repeats: int, tick: float, poles: Vector) -> Matrix:
    slowest = -1.0 / poles.real.max()
    steps = int(min(max(6.0 * slowest / tick, 10.0), 20_000.0)) if slowest > 0.0 else 1000
    state = np.zeros(len(loops[0]))
    state[:3] = 1.0
    rows = np.empty((steps, 4))
    for step in range(steps):
        rows[step] = step * tick, *state[:3]
        state = loops[step // repeats % len(loops)] @ state
    return rows


def draw(designed: Design, path: Path) -> Path:
    """Draw singular values, poles and recovery to a picture."""
    figure = Figure(figsize=(17.0, 5.0), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    values, plane, time = figure.subplots(1, 3)
    for index, (name, curve) in enumerate(designed.singular_values.items()):
        style = "--" if _is_bound(name) else "-"
        colour = f"C{index}"
        values.loglog(designed.frequency, curve.max(axis=1), style, color=colour, label=name)
    values.set(xlabel="frequency [rad/s]", ylabel="largest singular value", title=designed.algorithm)
    if designed.singular_values:
        values.legend(fontsize="small")
    plane.plot(designed.poles.real, designed.poles.imag, "x")
    plane.set_xscale("symlog", linthresh=1e-3)
    plane.set(xlabel="real part [1/s]", ylabel="imaginary part [rad/s]", title="closed-loop poles")
    for axis, label in enumerate(HILL_AXES):
        time.plot(designed.recovery[:, 0] / 60.0, designed.recovery[:, axis + 1], label=label)
    time.set(xlabel="time [min]", ylabel="position error [m]", title="from 1 m in every axis, without limits")
    time.legend(fontsize="small")
    for axes in (values, plane, time):
        axes.grid(alpha=0.3)
    figure.savefig(path)
    return path
