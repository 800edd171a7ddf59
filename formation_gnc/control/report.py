"""What a design is, before it flies: gains, poles, margins, bounds and sizes, as numbers and as a picture."""

from dataclasses import dataclass, field
from math import asin, inf
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.control.controller import Controller, Vehicle
from formation_gnc.control.hinf import HInfinityController
from formation_gnc.control.lqr import LinearQuadraticRegulator
from formation_gnc.control.mixed_sensitivity import LinearController
from formation_gnc.control.models import DESIGN_MODELS
from formation_gnc.control.mpc import ModelPredictiveController
from formation_gnc.control.registry import ALGORITHMS
from formation_gnc.interface import Matrix, Vector

FREQUENCIES = 200
"""Frequencies at which singular values are taken, up to half the sampling rate."""


@dataclass(frozen=True)
class Design:
    """A designed law, looked at from outside; its loop is the sampled one, without limits."""

    algorithm: str
    figures: dict[str, Any]
    """Name, with unit, and value: numbers, or lists of them."""
    poles: Vector = field(default_factory=lambda: np.empty(0, dtype=complex))
    """(n,) continuous equivalents of the closed loop's poles, 1/s."""
    frequency: Vector = field(default_factory=lambda: np.empty(0))
    """(N,) rad/s."""
    singular_values: dict[str, Matrix] = field(default_factory=dict)
    """Name and (N, 3) singular values; "1 / ..." are the bounds that gamma allows them."""
    recovery: Matrix = field(default_factory=lambda: np.empty((0, 4)))
    """(N, 4) time, s, and position error, m, after an offset of 1 m in every axis."""


def design(parameters: Any) -> Design:
    """Design the law that the controller node's parameters name, and describe it.

    Raises:
        ConfigurationError: it cannot be designed.
    """
    name = parameters.algorithm
    own = getattr(parameters, name)
    law = ALGORITHMS[name](own, parameters, Vehicle(parameters.mass, np.array(parameters.thrust_limit)))
    figures = _figures(law, own, parameters.mass)
    controller = _linear(law)
    if controller is None:
        return Design(name, figures)
    tick = parameters.tick
    phi, gamma = DESIGN_MODELS[own.model](parameters).discretise(0.0, tick)
    loop = controller.closed_loop(phi, gamma)
    poles = np.log(np.linalg.eigvals(loop).astype(complex)) / tick
    poles = poles[np.argsort(-poles.real)]
    frequency = np.geomspace(1e-2 * parameters.mean_motion, np.pi / tick, FREQUENCIES)
    values = _input_loop(controller, phi, gamma, frequency * tick)
    figures |= _margins(values) | {"slowest time constant [s]": _or_none(-1.0 / poles.real.max())}
    if isinstance(law, HInfinityController):
        values |= law.problem.singular_values(law.continuous, frequency)
        values["1 / w_P"] = law.gamma / law.problem.performance.at(frequency)
        values["1 / w_T"] = law.gamma / law.problem.uncertainty.at(frequency)
        figures |= {f"largest {each}": float(values[each].max()) for each in ("S", "T")}
        figures["largest KS [N/m]"] = parameters.mass * float(values["KS"].max())
    return Design(name, figures, poles, frequency, values, _recovery(loop, tick, poles))


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) and value > 0.0 else None


def _figures(law: Controller, own: Any, mass: float) -> dict[str, Any]:
    if isinstance(law, LinearQuadraticRegulator):
        return {
            "gain [N/m, N/(m/s), N/(m s)]": (mass * law.gain).tolist(),
            "gains along the orbit": len(law.gains),
        }
    if isinstance(law, HInfinityController):
        return {
            "best gamma": law.best_gamma,
            "gamma": law.gamma,
            "states": len(law.sampled.a),
            "controller poles [1/s]": sorted(np.linalg.eigvals(law.continuous.a).real.tolist()),
        }
    if isinstance(law, ModelPredictiveController):
        variables, rows, entries = law.size
        return {
            "horizon [s]": own.step * own.horizon,
            "steps": own.horizon,
            "variables": variables,
            "constraints": rows,
            "entries of Hessian and constraints": entries,
            "gain without limits [N/m, N/(m/s)]": (mass * law.reserve.gain).tolist(),
        }
    return {}


def _linear(law: Controller) -> LinearController | None:
    """The law without limits, per tick; a gain along the orbit as its mean, MPC as the LQR it becomes."""
    if isinstance(law, HInfinityController):
        return law.sampled
    if isinstance(law, ModelPredictiveController):
        law = law.reserve
    if not isinstance(law, LinearQuadraticRegulator):
        return None
    gain = law.gain
    integral = np.eye(gain.shape[1] - 6)
    inputs = law.tick * np.eye(len(integral), 6)
    return LinearController(integral, inputs, -gain[:, 6:], -gain[:, :6])


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


def _recovery(loop: Matrix, tick: float, poles: Vector) -> Matrix:
    slowest = -1.0 / poles.real.max()
    steps = int(min(max(6.0 * slowest / tick, 10.0), 20_000.0)) if slowest > 0.0 else 1000
    state = np.zeros(len(loop))
    state[:3] = 1.0
    rows = np.empty((steps, 4))
    for step in range(steps):
        rows[step] = step * tick, *state[:3]
        state = loop @ state
    return rows


def draw(designed: Design, path: Path) -> Path:
    """Draw singular values, poles and recovery to a PNG file."""
    figure = Figure(figsize=(17.0, 5.0), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    values, plane, time = figure.subplots(1, 3)
    for index, (name, curve) in enumerate(designed.singular_values.items()):
        style = "--" if name.startswith("1 /") else "-"
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
    time.set(
        xlabel="time [min]", ylabel="position error [m]", title="after 1 m in every axis, without limits"
    )
    time.legend(fontsize="small")
    for axes in (values, plane, time):
        axes.grid(alpha=0.3)
    figure.savefig(path)
    return path
