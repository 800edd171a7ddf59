"""What a design is, before it flies: gains, poles, margins, bounds and sizes, as numbers and as a picture."""

from dataclasses import dataclass, field
from functools import reduce
from math import asin, inf
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.control.controller import Controller, Vehicle
from formation_gnc.control.linear import LinearController
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.relative.model import RelativeModel
from formation_gnc.types import NANOSECONDS, Matrix, Vector

FREQUENCIES = 200
"""Frequencies at which singular values are taken, up to half the sampling rate."""

PLACES = 360
"""Places of the orbit at which a loop that varies along it is closed."""


@dataclass(frozen=True)
class Design:
    """A designed law, looked at from outside; its loop is the sampled one, without limits.

    A loop that varies along the orbit has characteristic exponents for poles; its singular values and margins
    are those of the loop as it is at the start.
    """

    algorithm: str
    figures: dict[str, Any]
    """Name, with unit, and value: numbers, or lists of them."""
    poles: Vector = field(default_factory=lambda: np.empty(0, dtype=complex))
    """(n,) continuous equivalents of the closed loop's poles, 1/s."""
    frequency: Vector = field(default_factory=lambda: np.empty(0))
    """(N,) rad/s."""
    singular_values: dict[str, Matrix] = field(default_factory=dict)
    """Name and (N, 3) singular values; "gamma / ..." are bounds."""
    recovery: Matrix = field(default_factory=lambda: np.empty((0, 4)))
    """(N, 4) time, s, and position error, m, after an offset of 1 m in every axis."""


def design(parameters: Any) -> Design:
    """Design the law that the controller node's parameters name, and describe it.

    Raises:
        ConfigurationError: it cannot be designed.
    """
    name, tick = parameters.algorithm, parameters.tick
    own = getattr(parameters, name)
    law = ALGORITHMS[name](own, parameters, Vehicle(parameters.mass, np.array(parameters.thrust_limit)))
    figures = law.figures()
    controller = law.linear(0)
    if controller is None:
        return Design(name, figures)
    model = DESIGN_MODELS[own.model](parameters)
    loops, repeats = _loops(law, model, tick)
    turn = reduce(lambda before, loop: np.linalg.matrix_power(loop, repeats) @ before, loops, np.eye(len(loops[0])))
    poles = np.log(np.linalg.eigvals(turn).astype(complex)) / (tick * repeats * len(loops))
    poles = poles[np.argsort(-poles.real)]
    frequency = np.geomspace(1e-2 * parameters.mean_motion, np.pi / tick, FREQUENCIES)
    values = _input_loop(controller, *model.discretise(0.0, tick), frequency * tick)
    figures |= _margins(values) | {"slowest time constant [s]": _or_none(-1.0 / poles.real.max())}
    own_values = law.singular_values(frequency)
    figures |= {f"largest {key}": float(each.max()) for key, each in own_values.items() if not _is_bound(key)}
    return Design(name, figures, poles, frequency, values | own_values, _recovery(loops, repeats, tick, poles))


def _is_bound(name: str) -> bool:
    return name.startswith("gamma /")


def _loops(law: Controller, model: RelativeModel, tick: float) -> tuple[list[Matrix], int]:
    """Loops closed over a tick, at one place of the orbit or at `PLACES`, and for how many ticks each
    stands."""
    places = 1 if model.is_time_invariant else PLACES
    repeats = 1 if model.is_time_invariant else max(1, round(model.period / places / tick))
    loops = []
    for place in range(places):
        time = (place + 0.5) * repeats * tick if places > 1 else 0.0
        controller = law.linear(round(time * NANOSECONDS))
        assert controller is not None, "a law that is linear once always is"
        loops.append(controller.closed_loop(*model.discretise(time, tick)))
    return loops, repeats


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) and value > 0.0 else None


def _input_loop(controller: LinearController, phi: Matrix, gamma: Matrix, angle: Vector) -> dict[str, Matrix]:
    """Singular values (N, 3) of S_I = (I + K G)^-1 and T_I of the loop cut at the thrusters, at angles (N,)
    of z."""
    seen = np.eye(6)[: controller.b.shape[1]]
    sensitivity, complement = [], []
    for each in angle:
        z = np.exp(1j * each)
        plant = seen @ np.linalg.solve(z * np.eye(6) - phi, gamma)
        size = len(controller.a)
        law = controller.c @ np.linalg.solve(z * np.eye(size) - controller.a, controller.b) + controller.d
        s = np.linalg.inv(np.eye(3) - law @ plant)
        sensitivity.append(np.linalg.svd(s, compute_uv=False))
        complement.append(np.linalg.svd(np.eye(3) - s, compute_uv=False))
    return {"S_I": np.array(sensitivity), "T_I": np.array(complement)}


def _margins(values: dict[str, Matrix]) -> dict[str, Any]:
    """What all three thrusters' gains, or phases, may be off by at once, each on its own, without loss of
    stability."""
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
    """Draw singular values, poles and recovery to a PNG file."""
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
    plane.set(xlabel="real part [1/s]", ylabel="imaginary part [rad/s]", title="poles of the closed loop")
    for axis, label in enumerate(("x radial", "y along-track", "z cross-track")):
        time.plot(designed.recovery[:, 0] / 60.0, designed.recovery[:, axis + 1], label=label)
    time.set(xlabel="time [min]", ylabel="position error [m]", title="after 1 m in every axis, without limits")
    time.legend(fontsize="small")
    for axes in (values, plane, time):
        axes.grid(alpha=0.3)
    figure.savefig(path)
    return path
