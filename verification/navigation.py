"""The navigation filter: consistent, unobservable where it says so, near the bound, and robust.

`main` writes `navigation.md` and its plots, and returns the number of figures outside their tolerance.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import radians, sqrt
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from formation_gnc.common import Orbit
from formation_gnc.navigation.kernels.measurement import measure_relative
from formation_gnc.navigation.measurement import measurement_model
from formation_gnc.navigation.observability import orbit_period, predicted_unobservable_direction
from formation_gnc.navigation.parameters import NavigationParameters
from formation_gnc.navigation.process import Interval, NonlinearProcess, process_noise, substeps
from formation_gnc.orbit.frames import hill_transform
from formation_gnc.records import Estimate, EstimateStatus, Measurement, Rejection
from formation_gnc.sil.monte_carlo import START, Sample, navigation_filter, nees, simulate_measurements
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from verification.figure import Figure, failures
from verification.omniscient import Omniscient

mpl.use("Agg")
import matplotlib.pyplot as plt

Array = NDArray[np.float64]

RUNS = 200
THREE = ("radius", "range_rate", "latitude")
FOUR = (*THREE, "right_ascension")
AXES = ("x", "y", "z")
LABELS = ("radial x", "along-track y", "cross-track z")

LEO = Orbit(6978100.0, inclination=radians(50.0))
GEO = Orbit(42164000.0)

WIDE = {"fix_position_sigma": 50.0, "fix_velocity_sigma": 0.02}
"""A start uncertain enough to see what converges and what does not."""

ORBITS: dict[str, Callable[..., NavigationParameters]] = {
    "LEO, i = 50 deg": partial(NavigationParameters, chief=LEO, tick=10.0, acceleration_density=1e-10, **WIDE),
    "GEO": partial(NavigationParameters, chief=GEO, tick=120.0, acceleration_density=1e-14, **WIDE),
}
TICKS = {"LEO, i = 50 deg": 584, "GEO": 719}
"""One orbit each."""


@dataclass(frozen=True)
class Campaign:
    """Many flights through one filter: R runs of N ticks with k readings each."""

    error: Array
    """(R, N, 6) estimate minus truth."""
    nees: Array
    """(R, N)."""
    nis: Array
    """(R, N)."""
    innovation: Array
    """(R, N, k) in standard deviations."""
    sigma: Array
    """(N, 6) of the last run."""
    rejected: int
    chief: Array
    """(6,) inertial state at the end."""
    final: Estimate


def campaign(parameters: NavigationParameters, ticks: int, runs: int, start: Array = START) -> Campaign:
    """Fly `runs` independent truths, as uncertain as the parameters say, through the filter."""
    count = len(parameters.sensors)
    error, sigma = np.empty((runs, ticks, 6)), np.empty((ticks, 6))
    squared, nis, innovation = (
        np.empty((runs, ticks)),
        np.empty((runs, ticks)),
        np.zeros((runs, ticks, count)),
    )
    rejected = 0
    for run in range(runs):
        filter = navigation_filter(parameters)
        for tick, sample in enumerate(
            simulate_measurements(parameters, ticks, np.random.default_rng([4, run]), start=start)
        ):
            estimate = filter.on_tick(sample.measurement)
            assert estimate is not None
            error[run, tick] = estimate.relative_state - sample.truth
            squared[run, tick] = nees(estimate, sample.truth)
            nis[run, tick] = estimate.nis
            used = [each for each in estimate.innovations if not each.rejection]
            if len(used) == count:
                innovation[run, tick] = [each.values[0] / each.standard_deviations[0] for each in used]
            if run == runs - 1:
                sigma[tick] = np.sqrt(np.diag(estimate.covariance))
        rejected += sum(each.count for each in estimate.rejections)
    return Campaign(error, squared, nis, innovation, sigma, rejected, sample.measurement.chief_state, estimate)


def cramer_rao(parameters: NavigationParameters, ticks: int) -> Array:
    """Posterior Cramer-Rao bound, (N, 6) standard deviations: information along the truth (Tichavsky 1998).

    With additive Gaussian noise it is J+ = (Q + F J^-1 F')^-1 + H' R^-1 H, its expectations over the truth
    taken at the undisturbed one, from which the disturbances take it by metres in thousands of kilometres.
    """
    still = replace(parameters, acceleration_density=0.0)
    covariance = np.diag(np.repeat([parameters.fix_position_sigma**2, parameters.fix_velocity_sigma**2], 3))
    noise = process_noise(parameters.acceleration_density, parameters.tick)
    process = NonlinearProcess()
    codes = measurement_model(tuple(parameters.sigmas)).codes
    sigmas = np.concatenate(list(parameters.sigmas.values()))
    bound = np.empty((ticks, 6))
    last: Sample | None = None
    for tick, sample in enumerate(simulate_measurements(still, ticks, np.random.default_rng(0))):
        chief = sample.measurement.chief_state
        if last is not None:
            start, step = last.measurement.chief_state, parameters.tick
            interval = Interval(start, chief, np.zeros(3), step, substeps(step))
            covariance = process.predict(interval, last.truth, covariance, noise)[1]
        rows = measure_relative(codes, chief, sample.truth)[1] / sigmas[:, None]
        gain = covariance @ rows.T @ np.linalg.inv(rows @ covariance @ rows.T + np.eye(len(rows)))
        keep = np.eye(6) - gain @ rows
        covariance = keep @ covariance @ keep.T + gain @ gain.T
        bound[tick] = np.sqrt(np.diag(covariance))
        last = sample
    return bound


def inside(values: Array, degrees: int) -> tuple[float, float, float]:
    """Share of instants at which the mean over runs, (R, N), is inside its 95 % bounds, and these."""
    runs = len(values)
    low, high = chi2.ppf([0.025, 0.975], degrees * runs) / runs
    mean = values.mean(axis=0)
    return float(np.mean((mean >= low) & (mean <= high))), float(low), float(high)


def consistency(directory: Path) -> tuple[str, list[Figure]]:
    """Points 1 and 2: 200 runs on two orbits, with and without right ascension."""
    figures: list[Figure] = []
    rows: list[str] = []
    blind_rows: list[str] = []
    for orbit, build in ORBITS.items():
        stem = "leo" if orbit.startswith("LEO") else "geo"
        for sensors in (THREE, FOUR):
            parameters = build(sensors=sensors)
            ticks = TICKS[orbit]
            flown, bound = campaign(parameters, ticks, RUNS), cramer_rao(parameters, ticks)
            name = f"{orbit}, {len(sensors)} sensors"
            k = len(sensors)
            rms = np.sqrt(np.mean(flown.error**2, axis=0))
            ratio = np.sqrt(np.mean(rms[ticks // 2 :] ** 2, axis=0) / np.mean(bound[ticks // 2 :] ** 2, axis=0))
            share_nees, *nees_bounds = inside(flown.nees, 6)
            share_nis, *nis_bounds = inside(flown.nis, k)
            lagged = flown.innovation[:, 2:] * flown.innovation[:, 1:-1]
            correlation = lagged.mean(axis=(0, 1)) / (flown.innovation[:, 1:] ** 2).mean(axis=(0, 1))
            white = float(np.abs(correlation).max()) * sqrt(lagged.shape[0] * lagged.shape[1])
            final = flown.nees[:, -1].mean()
            rows.append(
                f"| {name} | {flown.nees.mean():.3f} | {100 * share_nees:.1f} % | {flown.nis.mean():.4f} "
                f"| {100 * share_nis:.1f} % | {np.abs(correlation).max():.4f} | "
                + " | ".join(f"{rms[-1, i]:.3f} / {bound[-1, i]:.3f}" for i in range(3))
                + " |"
            )
            spread = 1.96 * sqrt(2.0 * 6.0 * RUNS) / RUNS
            figures += [
                Figure(f"{name}: NEES at the end, mean of {RUNS} runs", "6", final, "", 6 - spread, 6 + spread),
                Figure(f"{name}: instants with NEES inside 95 %", "95 %", 100 * share_nees, "%", 80.0, 100.0),
                Figure(f"{name}: instants with NIS inside 95 %", "95 %", 100 * share_nis, "%", 92.0, 98.0),
                Figure(f"{name}: largest lag-1 correlation, in sigma", "below 3", white, "", 0.0, 3.0),
                *(
                    Figure(f"{name}: RMS error of {axis} over the bound", "1", float(ratio[i]), "", 0.85, 1.15)
                    for i, axis in enumerate(AXES)
                ),
            ]
            if sensors is THREE:
                figures += _blind(parameters, flown, name, blind_rows)
            else:
                shrunk = float((bound[-1, :3] / parameters.fix_position_sigma).max())
                figures.append(
                    Figure(f"{name}: largest position sigma over its start", "below 1", shrunk, "", 0.0, 0.2)
                )
                figures.append(
                    Figure(
                        f"{name}: unobservable directions left",
                        "0",
                        float(flown.final.unobservable != ""),
                        "",
                        0.0,
                        0.0,
                    )
                )
            _plot_campaign(
                directory / f"navigation_{stem}_{k}.png",
                name,
                parameters,
                flown,
                bound,
                nees_bounds,
                nis_bounds,
            )
    text = f"""## Consistency, and the bound

{RUNS} flights each, over one orbit, from a fix of 50 m and 2 cm/s on each axis; 5 m, 1 cm/s, 1e-6 rad (and
1e-6 rad of right ascension) every 10 s in LEO and every 120 s at GEO. Truth and filter have the same process
noise, 1e-10 and 1e-14 m^2/s^3. NEES should be 6, NIS the number of readings; dashed in the plots are the
two-sided 95 % bounds of the mean over the runs. NEES changes slowly, and what the fix left along the unobservable
direction stays in it, so that its instants are inside or outside together; NIS is new at every instant. RMS
error at the end, over the runs, beside the posterior Cramer-Rao bound, m.

| flight | NEES | inside 95 % | NIS | inside 95 % | lag-1 correlation | x: error / bound | y | z |
|---|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}

![LEO, three sensors](navigation_leo_3.png)
![LEO, with right ascension](navigation_leo_4.png)
![GEO, three sensors](navigation_geo_3.png)
![GEO, with right ascension](navigation_geo_4.png)

## The unobservable direction

With three sensors, the errors of the {RUNS} runs at the end of the orbit lie along one direction (their
largest principal component, rates divided by the mean motion), which should be the predicted one, a turn of
the orbit about the Earth's axis. Along it nothing is learnt: the RMS error there over the one that the fix
left is 1.

| flight | cosine between both | error along it over its start | estimate calls it |
|---|---|---|---|
{chr(10).join(blind_rows)}

"""
    return text, figures


def _blind(parameters: NavigationParameters, flown: Campaign, name: str, rows: list[str]) -> list[Figure]:
    rate = 2.0 * np.pi / orbit_period(flown.chief)
    scaled = flown.error[:, -1] / np.repeat([1.0, rate], 3)
    principal = np.linalg.svd(scaled - scaled.mean(axis=0))[2][0]
    cosine = float(abs(principal @ predicted_unobservable_direction(flown.chief)))
    # The angle of the turn that best explains an error, by the covariance at the start and at the end.
    first = next(iter(simulate_measurements(parameters, 1, np.random.default_rng(0)))).measurement.chief_state
    covariance = np.diag(np.repeat([parameters.fix_position_sigma**2, parameters.fix_velocity_sigma**2], 3))
    start = np.std(_turn(first, covariance, parameters, RUNS))
    end = np.std(_angle(flown.error[:, -1], flown.chief, flown.final.covariance))
    rows.append(f"| {name} | {cosine:.6f} | {end / start:.3f} | {flown.final.unobservable} |")
    return [
        Figure(f"{name}: cosine to the predicted unobservable direction", "1", cosine, "", 0.99, 1.0 + 1e-9),
        Figure(f"{name}: error along it over its start", "1", float(end / start), "", 0.9, 1.1),
    ]


def _turn(chief: Array, covariance: Array, parameters: NavigationParameters, runs: int) -> Array:
    errors = []
    for run in range(runs):
        sample = next(iter(simulate_measurements(parameters, 1, np.random.default_rng([4, run]))))
        errors.append(sample.measurement.fix - sample.truth)
    return _angle(np.array(errors), chief, covariance)


def _angle(errors: Array, chief: Array, covariance: Array) -> Array:
    turn = hill_transform(chief) @ np.array([-chief[1], chief[0], 0.0, -chief[4], chief[3], 0.0])
    weight = np.linalg.solve(covariance, turn)
    angle: Array = errors @ weight / (turn @ weight)
    return angle


def _plot_campaign(
    path: Path,
    name: str,
    parameters: NavigationParameters,
    flown: Campaign,
    bound: Array,
    nees_bounds: Sequence[float],
    nis_bounds: Sequence[float],
) -> None:
    hours = np.arange(len(bound)) * parameters.tick / 3600.0
    figure, axes = plt.subplots(5, 1, figsize=(8, 9), sharex=True, constrained_layout=True)
    rms = np.sqrt(np.mean(flown.error**2, axis=0))
    for i in range(3):
        axes[i].plot(hours, np.abs(flown.error[:12, :, i]).T, color="0.8", lw=0.5)
        axes[i].plot(hours, rms[:, i], color="tab:blue", label=f"RMS of {RUNS} runs")
        axes[i].plot(hours, bound[:, i], "k--", lw=1.0, label="Cramer-Rao bound")
        axes[i].set_yscale("log")
        axes[i].set_ylim(max(1e-2, rms[:, i].min() / 5), rms[:, i].max() * 5)
        axes[i].set_ylabel(f"{LABELS[i]} [m]")
    axes[0].legend(loc="upper right", fontsize=8)
    for axis, values, bounds, label in (
        (axes[3], flown.nees, nees_bounds, "NEES"),
        (axes[4], flown.nis, nis_bounds, "NIS"),
    ):
        axis.plot(hours, values.mean(axis=0), color="tab:blue", lw=0.8)
        for limit in bounds:
            axis.axhline(limit, color="k", ls="--", lw=0.8)
        axis.set_ylabel(label)
    axes[4].set_xlabel("time [h]")
    figure.suptitle(name)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def neokleous(directory: Path) -> tuple[str, list[Figure]]:
    """Figs. 3.3 to 3.6: measured and estimated x, y, z and radius at GEO, with his pseudo-measurements."""
    parameters = NavigationParameters(chief=GEO, tick=6.0, pseudo_measurements=True, acceleration_density=1e-14, **WIDE)
    start = np.array([500.0, 1000.0, 300.0, 0.0, -2.0 * 7.292e-5 * 500.0, 0.0])
    filter = navigation_filter(parameters)
    truth, state, sigma, radius = [], [], [], []
    for sample in simulate_measurements(parameters, 10000, np.random.default_rng(33), start=start):
        estimate = filter.on_tick(sample.measurement)
        assert estimate is not None
        truth.append(sample.truth)
        state.append(estimate.relative_state)
        sigma.append(np.sqrt(np.diag(estimate.covariance)))
        expected = [
            measure_relative(measurement_model(("radius",)).codes, estimate.chief_state, each)[0][0]
            for each in (sample.truth, estimate.relative_state)
        ]
        radius.append([sample.measurement.readings[0].values[0], *expected])
    true, found, known, radii = map(np.array, (truth, state, sigma, radius))
    minutes = np.arange(len(true)) * 0.1
    figure, axes = plt.subplots(4, 2, figsize=(11, 10), sharex=True, constrained_layout=True)
    for i in range(3):
        axes[i, 0].plot(minutes, true[:, i], "k", lw=1.2, label="true")
        axes[i, 0].plot(minutes, found[:, i], "tab:blue", lw=0.9, label="estimated")
        axes[i, 0].set_ylabel(f"{LABELS[i]} [m]")
        axes[i, 1].plot(minutes, found[:, i] - true[:, i], "tab:blue", lw=0.9, label="estimate - truth")
        for side in (-3.0, 3.0):
            axes[i, 1].plot(minutes, side * known[:, i], "k--", lw=0.8)
        reach = 3.0 * known[len(known) // 20 :, i].max() * 1.5
        axes[i, 1].set_ylim(-reach, reach)
    axes[3, 0].plot(minutes, radii[:, 0] - 42164e3, ".", color="0.7", ms=1, label="measured")
    axes[3, 0].plot(minutes, radii[:, 2] - 42164e3, "tab:blue", lw=0.9, label="estimated")
    axes[3, 0].set_ylabel("r2 - 42164 km [m]")
    axes[3, 1].plot(minutes, radii[:, 0] - radii[:, 1], ".", color="0.7", ms=1)
    axes[3, 1].plot(minutes, radii[:, 2] - radii[:, 1], "tab:blue", lw=0.9)
    axes[0, 0].legend(fontsize=8)
    axes[0, 1].legend(fontsize=8)
    axes[3, 0].legend(fontsize=8)
    for column in (0, 1):
        axes[3, column].set_xlabel("time [min]")
    figure.suptitle("Neokleous, Figs. 3.3 to 3.6: left the states, right the errors with 3 sigma")
    figure.savefig(directory / "navigation_neokleous.png", dpi=110)
    plt.close(figure)
    error = found - true
    last = slice(len(true) // 2, None)
    rms = np.sqrt(np.mean(error[last, :3] ** 2, axis=0))
    noise = np.std(radii[last, 0] - radii[last, 1])
    left = np.sqrt(np.mean((radii[last, 2] - radii[last, 1]) ** 2))
    kept = float(error[-1, 1] / error[0, 1])
    off = ", ".join(f"{each:.1f}" for each in error[0, :3])
    text = f"""## Neokleous, Figs. 3.3 to 3.6

GEO, equatorial, radius, range rate and latitude every 0.1 min over 1000 min, taken as his pseudo-measurements
(3.13), from a fix that is off by ({off}) m. The text gives no start, no noise and no
numbers, so these are ours (500, 1000, 300 m from the ideal point; 5 m, 1 cm/s, 1e-6 rad).

| | x | y | z | r2 |
|---|---|---|---|---|
| RMS error of the estimate, second half, m | {rms[0]:.3f} | {rms[1]:.3f} | {rms[2]:.3f} | {left:.3f} |
| measured | | | | {noise:.3f} |

![Figs. 3.3 to 3.6](navigation_neokleous.png)

x, z and the radius come out as in his figures: the filter follows, far better than the readings. y does not:
its error at the end is {kept:.3f} times what it was at the start, because none of the three readings depends
on it. A simulated filter that starts from the true y shows a y that follows, which says nothing.

"""
    return text, [
        Figure(
            "Fig. 3.3, RMS error of x over 3 sigma of a reading",
            "follows (below 1)",
            float(rms[0] / 15.0),
            "",
            0.0,
            0.2,
        ),
        Figure("Fig. 3.4, error of y at the end over its start", "follows (towards 0)", kept, "", 0.95, 1.05),
        Figure(
            "Fig. 3.5, RMS error of z over a reading's noise",
            "follows (below 1)",
            float(rms[2] / 42.2),
            "",
            0.0,
            0.2,
        ),
        Figure(
            "Fig. 3.6, RMS error of r2 over a reading's noise",
            "follows (below 1)",
            float(left / noise),
            "",
            0.0,
            0.2,
        ),
    ]


def fourth_sensors() -> tuple[str, list[Figure]]:
    """What each further measurement buys, and what filters and process models differ in."""
    rows = []
    for orbit, build in ORBITS.items():
        for extra in ((), ("right_ascension",), ("chief_range",)):
            bound = cramer_rao(build(sensors=(*THREE, *extra)), TICKS[orbit])[-1]
            rows.append(
                f"| {orbit} | {extra[0].replace('_', ' ') if extra else 'none'} | "
                + " | ".join(f"{value:.3f}" for value in bound[:3])
                + " | "
                + " | ".join(f"{1e3 * value:.3f}" for value in bound[3:])
                + " |"
            )
    variants: dict[str, dict[str, Any]] = {
        "EKF, nonlinear with J2": {},
        "UKF, nonlinear with J2": {"filter": "ukf"},
        "EKF, pseudo-measurements (3.13)": {"pseudo_measurements": True},
        "EKF, Schweighart-Sedwick, 1e-9 m^2/s^3": {
            "process_model": "schweighart_sedwick",
            "acceleration_density": 1e-9,
        },
        "EKF, Hill, 1e-9 m^2/s^3": {"process_model": "hill", "acceleration_density": 1e-9},
    }
    build = ORBITS["LEO, i = 50 deg"]
    truth = build(sensors=FOUR)
    table, figures = [], []
    for name, changes in variants.items():
        errors, squares = [], []
        for run in range(10):
            filter = navigation_filter(replace(truth, **changes))
            for tick, sample in enumerate(simulate_measurements(truth, 400, np.random.default_rng([6, run]))):
                estimate = filter.on_tick(sample.measurement)
                assert estimate is not None
                if tick >= 200:
                    errors.append(estimate.relative_state - sample.truth)
                    squares.append(nees(estimate, sample.truth))
        rms = np.sqrt(np.mean(np.square(errors), axis=0))
        table.append(f"| {name} | " + " | ".join(f"{each:.3f}" for each in rms[:3]) + f" | {np.mean(squares):.2f} |")
        # Ten runs of 200 correlated ticks: the mean NEES of a right model is known to about one.
        figures.append(Figure(f"{name}: NEES, 10 runs", "6", float(np.mean(squares)), "", 1.0, 8.0))
    text = f"""## What a fourth measurement buys

Cramer-Rao bound after one orbit, with 1e-6 rad of right ascension or 1 m of range to the chief:

| orbit | fourth measurement | x [m] | y [m] | z [m] | vx [mm/s] | vy [mm/s] | vz [mm/s] |
|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}

The range to the chief sees the unobservable direction only through the geometry of the relative orbit: at 90 m it
tells mostly of the along-track distance.

## Filters and process models

LEO, four sensors, 10 flights, RMS error over the second half and NEES (6 is consistent; less is cautious):

| filter | x [m] | y [m] | z [m] | NEES |
|---|---|---|---|---|
{chr(10).join(table)}

"""
    return text, figures


def troubles(directory: Path) -> tuple[str, list[Figure]]:
    """Point 3: 30 % dropouts, ten minutes without any reading, 1 % outliers of 50 sigma."""
    parameters = ORBITS["LEO, i = 50 deg"](sensors=THREE)
    ticks, outage = 1168, slice(600, 660)
    counted, planted, statuses = 0, 0, []
    within, squares, after = [], [], []
    for run in range(20):
        rng = np.random.default_rng([5, run])
        filter = navigation_filter(parameters)
        error, sigma = np.empty((ticks, 6)), np.empty((ticks, 6))
        for tick, sample in enumerate(simulate_measurements(parameters, ticks, np.random.default_rng([7, run]))):
            spoilt, outliers = _spoil(sample.measurement, parameters, rng, outage.start <= tick < outage.stop)
            planted += outliers
            estimate = filter.on_tick(spoilt)
            assert estimate is not None
            error[tick] = estimate.relative_state - sample.truth
            sigma[tick] = np.sqrt(np.diag(estimate.covariance))
            squares.append(nees(estimate, sample.truth))
            statuses.append(estimate.status)
        counted += sum(each.count for each in estimate.rejections if each.reason == Rejection.GATE)
        within.append(np.mean(np.abs(error) <= 3.0 * sigma))
        after.append(np.abs(error[outage.stop + 30, :3] / sigma[outage.stop + 30, :3]).max())
        if run == 0:
            _plot_troubles(directory / "navigation_troubles.png", parameters.tick, error, sigma, outage)
    diverged = statuses.count(EstimateStatus.DIVERGED)
    share = 100.0 * float(np.mean(within))
    text = f"""## Dropouts, outage, outliers

LEO over two orbits, 20 flights: 30 % of the readings are lost, none arrives for ten minutes, and 1 % of those
that arrive are off by 50 standard deviations.

| outliers | rejected by gates | ticks diverged | NEES | errors within 3 sigma | largest 5 min later |
|---|---|---|---|---|---|
| {planted} | {counted} | {diverged} | {np.mean(squares):.2f} | {share:.2f} % | {max(after):.2f} |

![Dropouts, outage, outliers](navigation_troubles.png)

"""
    return text, [
        Figure("troubles: readings rejected over outliers", "1", counted / planted, "", 0.999, 1.01),
        Figure("troubles: ticks called diverged", "0", float(diverged), "", 0.0, 0.0),
        Figure("troubles: errors within 3 sigma", "99.7 %", share, "%", 98.5, 100.0),
        Figure(
            "troubles: largest error 5 min after the outage",
            "below 3 sigma",
            float(max(after)),
            "sigma",
            0.0,
            3.0,
        ),
    ]


def _spoil(
    measurement: Measurement, parameters: NavigationParameters, rng: np.random.Generator, outage: bool
) -> tuple[Measurement, int]:
    """The measurement with readings lost and outliers among the rest, and how many these are."""
    readings, outliers = [], 0
    for reading in measurement.readings:
        lost, stray, side = rng.random(3)
        if lost < 0.3 or outage:
            continue
        if stray < 0.01:
            (sigma,), (value,) = parameters.sigmas[reading.sensor], reading.values
            reading = replace(reading, values=[value + (50.0 * sigma if side < 0.5 else -50.0 * sigma)])
            outliers += 1
        readings.append(reading)
    return replace(measurement, readings=readings), outliers


def _plot_troubles(path: Path, tick: float, error: Array, sigma: Array, outage: slice) -> None:
    hours = np.arange(len(error)) * tick / 3600.0
    figure, axes = plt.subplots(3, 1, figsize=(8, 6), sharex=True, constrained_layout=True)
    for i in range(3):
        axes[i].plot(hours, error[:, i], "tab:blue", lw=0.9)
        for side in (-3.0, 3.0):
            axes[i].plot(hours, side * sigma[:, i], "k--", lw=0.8)
        axes[i].axvspan(hours[outage.start], hours[outage.stop], color="0.9")
        reach = 3.3 * sigma[60:, i].max()
        axes[i].set_ylim(-reach, reach)
        axes[i].set_ylabel(f"{LABELS[i]} [m]")
    axes[2].set_xlabel("time [h]")
    axes[0].set_title("error and 3 sigma; shaded: no readings")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def closed_loop(directory: Path) -> tuple[str, list[Figure]]:
    """Point 5: the default scenario on estimates, and on the truth."""
    scenario = load_scenario("leader_follower")
    results = {}
    for name in ("filter", "truth"):
        run = Run(scenario)
        if name == "truth":
            run.instances["/deputy1/navigation"].module = Omniscient(run.plant, "deputy1")  # type: ignore[assignment]
        records: dict[str, list[Any]] = {"truth": [], "target": [], "thrust": []}

        def sink(topic: str, record: Any, records: dict[str, list[Any]] = records) -> None:
            if topic == "/truth":
                records["truth"].append(record.deputies[0].relative_state)
            elif topic.endswith("target"):
                records["target"].append(record.relative_state)
            elif topic.endswith("thrust"):
                records["thrust"].append(record.force)

        run.fly(sink)
        error = np.array(records["truth"]) - np.array(records["target"])
        delta_v = np.abs(np.array(records["thrust"])).sum() * scenario.plant.tick / 100.0
        results[name] = error, delta_v
    orbit = round(2.0 * np.pi / scenario.plant.mean_motion / scenario.plant.tick)
    rms = {name: np.sqrt(np.mean(np.sum(error[-orbit:, :3] ** 2, axis=1))) for name, (error, _) in results.items()}
    figure, axis = plt.subplots(figsize=(8, 3.5), constrained_layout=True)
    for name, (error, _) in results.items():
        distance = np.linalg.norm(error[:, :3], axis=1)
        axis.plot(np.arange(len(error)) * scenario.plant.tick / 3600.0, distance, label=f"on the {name}")
    axis.set_yscale("log")
    axis.set_xlabel("time [h]")
    axis.set_ylabel("true position - target [m]")
    axis.legend()
    figure.savefig(directory / "navigation_closed_loop.png", dpi=110)
    plt.close(figure)
    text = f"""## Closed loop

The default scenario, three orbits, flown by the LQR on estimates only and on the truth:

| controller sees | RMS position error over the last orbit [m] | delta-v [mm/s] |
|---|---|---|
| the filter | {rms["filter"]:.3f} | {1e3 * results["filter"][1]:.2f} |
| the truth | {rms["truth"]:.4f} | {1e3 * results["truth"][1]:.2f} |

![Closed loop](navigation_closed_loop.png)

What the filter adds is its own error, most of it along the unobservable direction, where the fix left half a metre.

"""
    return text, [
        Figure(
            "closed loop on estimates: RMS position error, last orbit",
            "below 2 m",
            float(rms["filter"]),
            "m",
            0.0,
            2.0,
        ),
        Figure(
            "closed loop on the truth: RMS position error, last orbit",
            "less",
            float(rms["truth"]),
            "m",
            0.0,
            float(rms["filter"]),
        ),
    ]


def main(directory: Path) -> int:
    """Write the page and its plots; return how many figures are outside their tolerance."""
    directory.mkdir(parents=True, exist_ok=True)
    sections, figures = [], []
    for part in (
        partial(consistency, directory),
        partial(neokleous, directory),
        fourth_sensors,
        partial(troubles, directory),
        partial(closed_loop, directory),
    ):
        text, limits = part()
        sections.append(text)
        figures += limits
    table = "\n".join(figure.row for figure in figures)
    page = f"""# Navigation

Written by `verification/navigation.py`; the theory is in [navigation](../theory/navigation.md).

{"".join(sections)}## All figures

| figure | expected | ours | stated tolerance | holds |
|---|---|---|---|---|
{table}
"""
    (directory / "navigation.md").write_text(page)
    return failures(figures)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/verification")) else 0)
