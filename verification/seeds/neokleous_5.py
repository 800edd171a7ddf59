"""Chapter 5 of Neokleous in the frequency domain: singular values, limits, robustness and mu. Minutes throughout."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals
from scipy.optimize import minimize_scalar

from formation_gnc.control.controller import Vehicle
from formation_gnc.control.hinf import HInfinityController, HinfParameters
from formation_gnc.relative.hill import HillModel
from verification.control import GEO, GEO_MASS, GEO_RATE, MINUTE
from verification.coverage.marker import covers
from verification.figure import Figure, save
from verification.seeds.accepted import Ours

PAGE = "neokleous"

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RATE = GEO_RATE * MINUTE
"""rad/min."""
TICK = 0.1
"""min."""
FREQUENCIES = np.logspace(-4, 3, 281)
"""rad/min."""
MODEL = HillModel(RATE)
SHIFT = 0.1
"""1/min; 5.6."""
WORST = 1e-5 * MINUTE**2
"""m/min^2: more than Sun, Moon and J2 move a satellite at GEO against the point."""
BOUNDARY = 0.1
"""m; 6.2."""


@dataclass(frozen=True)
class Design:
    """One set of weights: M_s = 2, r_0 = 0.3 and r_inf = 2 in both."""

    name: str
    bandwidth: float
    steady: float
    time: float
    effort: float

    @cached_property
    def law(self) -> HInfinityController:
        """The flight software's, in seconds, with the pole shift of 5.6."""
        parameters = HinfParameters(
            bandwidth=(self.bandwidth / MINUTE,) * 3,
            steady_error=(self.steady,) * 3,
            uncertainty_time=(self.time * MINUTE,) * 3,
            thrust=(GEO_MASS / (self.effort * MINUTE**2),) * 3,
            pole_shift=SHIFT / MINUTE,
            disturbance=0.0,
            gamma_margin=0.05,
        )
        return HInfinityController(parameters, GEO, Vehicle(GEO_MASS, np.full(3, np.inf)))

    def performance(self, s: complex) -> complex:
        """w_P."""
        return (s / 2.0 + self.bandwidth) / (s + self.bandwidth * self.steady)

    def uncertainty(self, s: complex) -> complex:
        """w_I."""
        return (self.time * s + 0.3) / (self.time / 2.0 * s + 1.0)

    def plant(self, s: complex) -> Complex:
        """G (3, 3), m per m/min^2, without the shift."""
        return np.asarray(np.linalg.solve(s * np.eye(6) - MODEL.dynamics(0.0), MODEL.INPUT.astype(complex))[:3])

    def controller(self, s: complex) -> Complex:
        """K (3, 3) of u = -K y."""
        own = self.law.continuous
        states = np.linalg.solve(s / MINUTE * np.eye(len(own.a)) - own.a, own.b.astype(complex))
        return np.asarray(-(own.c @ states + own.d) * MINUTE**2)

    def loop(self, s: complex) -> dict[str, Complex]:
        """G, K, S, T by (I + L)^-1 L, and N of (5.22) with input uncertainty and performance at the output."""
        g, k, eye = self.plant(s), self.controller(s), np.eye(3)
        s_out, s_in = np.linalg.inv(eye + g @ k), np.linalg.inv(eye + k @ g)
        wp, wi = self.performance(s), self.uncertainty(s)
        n = np.block([[-wi * s_in @ k @ g, -wi * k @ s_out], [wp * s_out @ g, wp * s_out]])
        return {"G": g, "K": k, "S": s_out, "T": np.linalg.solve(eye + g @ k, g @ k), "N": n}

    @cached_property
    def loops(self) -> dict[str, Complex]:
        """The same over all frequencies."""
        each = [self.loop(1j * w) for w in FREQUENCIES]
        return {name: np.array([one[name] for one in each]) for name in each[0]}

    @cached_property
    def weights(self) -> tuple[Array, Array]:
        """abs(w_P) and abs(w_I) over all frequencies."""
        return tuple(np.abs([f(1j * w) for w in FREQUENCIES]) for f in (self.performance, self.uncertainty))  # type: ignore[return-value]


CHAPTER_5 = Design("(5.41), (5.42)", 10.0, 0.003, 0.1, 0.01)
CHAPTER_6 = Design("(6.4)-(6.6)", 1.0, 0.03, 0.05, 1.5)
DESIGNS = (CHAPTER_5, CHAPTER_6)


def largest(matrices: Complex) -> Array:
    """(N,) largest singular value of each."""
    return np.asarray(np.linalg.norm(matrices, 2, axis=(1, 2)))


def upper_mu(n: Complex) -> tuple[float, float]:
    """mu's upper bound for two full 3 x 3 blocks by D-scaling, and the scaling d: exact for two blocks."""

    def scaled(log: float) -> float:
        d = np.exp(log)
        return float(
            np.linalg.norm(
                n * np.block([[np.ones((3, 3)), np.full((3, 3), d)], [np.full((3, 3), 1 / d), np.ones((3, 3))]]), 2
            )
        )

    centre = 0.5 * np.log(np.linalg.norm(n[3:, :3], 2) / np.linalg.norm(n[:3, 3:], 2))
    found = minimize_scalar(scaled, bounds=(centre - 5.0, centre + 5.0), method="bounded", options={"xatol": 1e-9})
    return float(found.fun), float(np.exp(found.x))


def lower_mu(n: Complex, d: float) -> tuple[float, Complex]:
    """mu's lower bound by power iteration, and the perturbation of size one that attains it.

    From the dominant singular vectors of the scaled matrix; each block of Delta aligns what leaves a block with what
    enters it, so that rho(Delta N) is a lower bound whatever the iteration did.
    """
    unscale = np.repeat([1.0, d], 3)
    left, _, right = np.linalg.svd(n * np.outer(1.0 / unscale, unscale))
    b, w = unscale * right[0].conj(), left[:, 0] / unscale
    best, kept = 0.0, np.eye(6, dtype=complex)
    for _ in range(50):
        a = n @ b
        blocks = [slice(0, 3), slice(3, 6)]
        delta = np.zeros((6, 6), dtype=complex)
        for each in blocks:
            size = np.linalg.norm(w[each]) * np.linalg.norm(a[each])
            delta[each, each] = np.outer(w[each], a[each].conj()) / size
        value = float(np.abs(np.linalg.eigvals(delta @ n)).max())
        if not value > best * (1.0 + 1e-12):
            break
        best, kept = value, delta
        z = np.concatenate([np.linalg.norm(w[each]) / np.linalg.norm(a[each]) * a[each] for each in blocks])
        w = n.conj().T @ z
        w /= np.linalg.norm(w)
        b = np.concatenate([np.linalg.norm(a[each]) / np.linalg.norm(w[each]) * w[each] for each in blocks])
        b /= np.linalg.norm(b)
    return best, kept


def sampled_plant() -> tuple[Array, Array, Array, Array]:
    """A, B, C, D of the plant of (3.19), an Euler step, brought back to continuous time by the bilinear transform.

    Each axis is an Euler step twice, T^2 / (z - 1)^2 but for terms of n T, and z - 1 is w T / (1 - w T / 2): two zeros
    at 2 / T for each. They are those of the system matrix of the transformed realisation.
    """
    a, b, c = np.eye(6) + TICK * MODEL.dynamics(0.0), TICK * MODEL.INPUT, np.eye(3, 6)
    inverse = np.linalg.inv(a + np.eye(6))
    aw, bw = 2.0 / TICK * (a - np.eye(6)) @ inverse, 2.0 / np.sqrt(TICK) * inverse @ b
    cw, dw = 2.0 / np.sqrt(TICK) * c @ inverse, -c @ inverse @ b
    return aw, bw, cw, dw


def response(system: tuple[Array, Array, Array, Array], s: complex) -> Complex:
    """Transfer function of A, B, C, D at s."""
    a, b, c, d = system
    return np.asarray(c @ np.linalg.solve(s * np.eye(len(a)) - a, b.astype(complex)) + d)


def norms_on(design: Design, plant: tuple[Array, Array, Array, Array]) -> tuple[float, float]:
    """Largest w_P S and w_I T of a design on another plant, whose loop must be stable for them to mean anything."""
    own = design.law.continuous
    a, b, c, d = plant
    assert not own.d.any()
    ak, bk, ck = own.a * MINUTE, own.b * MINUTE, own.c * MINUTE**2
    loop = np.block([[a, b @ ck], [bk @ c, ak + bk @ d @ ck]])
    assert (np.linalg.eigvals(loop).real < 0.0).all()
    performed, complementary = [], []
    for w in FREQUENCIES:
        through = response(plant, 1j * w) @ design.controller(1j * w)
        s = np.linalg.inv(np.eye(3) + through)
        performed.append(abs(design.performance(1j * w)) * np.linalg.norm(s, 2))
        complementary.append(abs(design.uncertainty(1j * w)) * np.linalg.norm(through @ s, 2))
    return float(max(performed)), float(max(complementary))


covers(
    "Neokleous (5.41); Fig. 5.8",
    "control/mixed_sensitivity.py",
    figures=("(5.41): largest w_P S", "(5.41): largest S"),
    differs="w_u is not printed (0.01 min² here); w_P S stays above 1 for any; the plot is lost in the "
    "text; ours is neokleous_5.png",
)
covers(
    "Neokleous (5.42); Fig. 5.9",
    "control/mixed_sensitivity.py",
    figures=("(5.42): largest w_I T",),
    differs="T is below 1/w_I, as there; the plot is lost in the text; ours is neokleous_5.png",
)
covers(
    "Neokleous (5.1), (5.2)", "control/mixed_sensitivity.py", figures=("(5.2): norm of T with p = 1000, over its peak",)
)
covers("Neokleous (5.3), (5.4)", figures=("(5.4): S of the scaled loop less S",))
covers("Neokleous (5.5)", figures=("(5.5): largest error under 1e-5 m/s² of any frequency, over 0.1 m",))
covers(
    "Neokleous (5.11), (5.12)",
    figures=(
        "(5.11): largest entry of S + T - I",
        "(5.12c): largest difference of the largest singular values of S and T",
    ),
)
covers(
    "Neokleous (5.13)-(5.15)",
    figures=("(5.14): largest w_P S over w_P at the zero", "(5.15): largest w_I T over w_I at the pole"),
)
covers(
    "Neokleous (5.16)-(5.19)",
    figures=(
        "(5.17): greatest bandwidth with zeros at 20",
        "(5.19): bandwidth of T over the least with the shifted poles",
    ),
)
covers(
    "Neokleous 5.3.3, poles and zeros",
    figures=("5.3.3: imaginary part of the poles", "5.3.3: zeros", "5.3.3: number of zeros"),
)
covers("Neokleous 5.3.4", figures=("5.3.4: normal rank of G",))
covers("Neokleous (5.22), (5.23)", figures=("(5.22): upper LFT less w_P S_p of the perturbed plant",))
covers(
    "Neokleous (5.24)-(5.32)",
    "control/mixed_sensitivity.py",
    figures=(
        "(5.32), (6.4)-(6.6): largest w_I T_I",
        "(5.28): det(I - M Delta) at the least uncertainty that destabilises",
    ),
)
covers(
    "Neokleous (5.33)-(5.37)",
    figures=(
        "(5.33), (6.4)-(6.6): largest w_P S",
        "(5.37), (6.4)-(6.6): largest sum, axis z",
        "(5.37): mu of axis z over the sum",
    ),
    differs="(5.36) lacks its < 1; the printed weights meet neither nominal nor robust performance",
)
covers(
    "Neokleous (5.38)-(5.40)",
    figures=(
        "(5.40), (5.41): largest mu",
        "(5.40), (6.4)-(6.6): largest mu",
        "(5.38): lower over upper bound, least",
        "(5.39): norm of F at the worst uncertainty of size 1/mu, over mu",
    ),
    differs="mu is above 1 with either set of weights: no robust performance; the document gives no value",
)


def section(directory: Path) -> tuple[str, list[Figure]]:
    """Figs. 5.8 and 5.9, the limits of 5.3, and robust performance."""
    ours = Ours()
    lines = [
        "## Chapter 5: singular values, limits, robustness",
        "",
        "Time in minutes. Plant without the pole shift, which is in the controller; (5.41), (5.42) with w_u =",
        "0.01 min²,",
        "which is not printed, and the weights of the comparison, (6.4)-(6.6). Uncertainty at the input, a full",
        "complex block, performance at the output. mu: upper bound by D-scaling, lower by power iteration.",
        "",
        "| weights | best gamma | largest S | w_P S | w_I T_I | mu, upper | lower | at rad/min |",
        "|---|---|---|---|---|---|---|---|",
    ]
    figures: list[Figure] = []
    plot, panels = plt.subplots(2, 3, figsize=(17, 9))
    for design, row in zip(DESIGNS, panels, strict=True):
        text, more = robustness(design, row, ours)
        lines.append(text)
        figures += more
    save(plot, directory / "neokleous_5.png")
    figures += [*limits(), *uncertainty()]
    lines += [
        "",
        "![Singular values](neokleous_5.png)",
        "",
        "T keeps below 1/w_I: whatever the thrusters do within w_I, the loop is stable. S does not keep below",
        "1/w_P with",
        "either set, and so mu is above 1: performance is not robust, since it is not there nominally.",
        "",
        "**Poles and zeros.** His plant is (3.19), an Euler step, brought back to continuous time by the bilinear",
        "transform: six zeros at 2/T = 20 for six at infinity. They set the bound ω_B < 10 from which ω_B of (5.41) is",
        "taken; the satellite itself has no zero. (5.14) is that of the comparison's controller on that plant,",
        "(5.15) on",
        "the plant with its poles shifted.",
        "",
    ]
    return "\n".join(lines), [*figures, *ours.cells]


def robustness(design: Design, row: NDArray[np.object_], ours: Ours) -> tuple[str, list[Figure]]:
    """A line of the table, the panels and the figures of one set of weights."""
    loops, (wp, wi) = design.loops, design.weights
    s, t, name = largest(loops["S"]), largest(loops["T"]), design.name
    bounds = [upper_mu(n) for n in loops["N"]]
    upper = np.array([bound for bound, _ in bounds])
    lower = np.array([lower_mu(n, d)[0] for n, (_, d) in zip(loops["N"], bounds, strict=True)])
    at, inner = int(upper.argmax()), largest(loops["N"][:, :3, :3])
    third = loops["N"][:, 2::3, 2::3]
    siso = wp * np.abs(loops["S"][:, 2, 2]) + wi * np.abs(loops["T"][:, 2, 2])
    ratio = mu_of_axis(third) / siso
    cells = [
        ours(f"{name}: best gamma", design.law.optimal_gamma, ".4g"),
        ours(f"{name}: largest S", float(s.max()), ".4g"),
        ours(f"{name}: largest w_P S", float((wp * s).max()), ".4g"),
        ours(f"{name}: largest w_I T_I", float(inner.max()), ".4g"),
        ours(f"{name}: mu, upper bound", float(upper.max()), ".4g"),
        ours(f"{name}: mu, lower bound", float(lower.max()), ".4g"),
        ours(f"{name}: frequency of the largest mu", float(FREQUENCIES[at]), ".4g", "rad/min", 0.05 * FREQUENCIES[at]),
    ]
    for panel, singular, bound, label in (
        (row[0], loops["S"], 1.0 / wp, "1/w_P"),
        (row[1], loops["T"], 1.0 / wi, "1/w_I"),
    ):
        panel.loglog(FREQUENCIES, np.linalg.svd(singular, compute_uv=False))
        panel.loglog(FREQUENCIES, bound, "k--", label=label)
        panel.set(xlabel="rad/min", ylim=(1e-4, 10.0))
        panel.legend()
    row[0].set_title(f"Fig. 5.8: S, weights {name}")
    row[1].set_title("Fig. 5.9: T")
    row[2].semilogx(FREQUENCIES, upper, label="mu, upper bound")
    row[2].semilogx(FREQUENCIES, lower, "--", label="mu, lower bound")
    row[2].semilogx(FREQUENCIES, wp * s, lw=0.8, label="w_P S")
    row[2].semilogx(FREQUENCIES, inner, lw=0.8, label="w_I T_I")
    row[2].axhline(1.0, color="k", ls=":")
    row[2].set(xlabel="rad/min", title="robust performance asks for mu below 1")
    row[2].legend()
    short = "(5.41)" if design is CHAPTER_5 else name
    figures = [
        Figure(f"(5.40), {short}: largest mu", "below 1 asked", float(upper.max()), "", 1.0, 3.0),
        Figure(f"(5.33), {name}: largest w_P S", "below 1 asked", float((wp * s).max()), "", 1.0, 2.0),
        Figure(f"(5.32), {name}: largest w_I T_I", "at most 1", float(inner.max()), "", 0.0, 1.0),
        Figure(f"(5.37), {name}: largest sum, axis z", "below 1 asked", float(siso.max()), "", 1.0, 3.0),
    ]
    if design is CHAPTER_5:
        peak = float(t.max())
        power = float(np.trapezoid((t / peak) ** 1000, FREQUENCIES) ** 1e-3)
        figures += [
            Figure("(5.41): largest w_P S", "below 1 asked", float((wp * s).max()), "", 1.0, 2.0),
            Figure("(5.41): largest S", "at most M_s = 2", float(s.max()), "", 1.0, 2.0),
            Figure("(5.42): largest w_I T", "at most 1", float((wi * t).max()), "", 0.0, 1.0),
            Figure(
                "(5.38): lower over upper bound, least",
                "1 (two full blocks)",
                float((lower / upper).min()),
                "",
                0.99,
                1.0 + 1e-6,
            ),
            Figure(
                "(5.37): mu of axis z over the sum",
                "1",
                float(ratio[np.abs(ratio - 1.0).argmax()]),
                "",
                1.0 - 1e-6,
                1.0 + 1e-6,
            ),
            Figure("(5.2): norm of T with p = 1000, over its peak", "1 for p to infinity", power, "", 0.98, 1.02),
        ]
    return f"| {name} | " + " | ".join(cells) + " |", figures


def mu_of_axis(n: Complex) -> Array:
    """mu (N,) of 2 x 2 matrices with two scalar blocks: the largest singular value at the best scaling."""
    balanced = n.copy()
    d = np.sqrt(np.abs(n[:, 1, 0]) / np.abs(n[:, 0, 1]))
    balanced[:, 0, 1] *= d
    balanced[:, 1, 0] /= d
    return largest(balanced)


def limits() -> list[Figure]:
    """What 5.3 says of S, T and the bandwidth."""
    loops = CHAPTER_5.loops
    s, t, eye = largest(loops["S"]), largest(loops["T"]), np.eye(3)
    scale_u, scale_e = np.diag([0.5, 1.0, 2.0]), np.diag([0.1, 0.2, 0.3])
    scaled = [
        np.linalg.inv(eye + np.linalg.inv(scale_e) @ g @ scale_u @ np.linalg.inv(scale_u) @ k @ scale_e)
        for g, k in zip(loops["G"], loops["K"], strict=True)
    ]
    plain = np.array([np.linalg.inv(scale_e) @ each @ scale_e for each in loops["S"]])
    disturbed = WORST * largest(loops["S"] @ loops["G"]) / BOUNDARY
    sampled = sampled_plant()
    a, b, c, d = sampled
    poles, zeros = np.linalg.eigvals(a), eigvals(np.block([[a, b], [c, d]]), np.diag([*np.ones(6), *np.zeros(3)]))
    zeros = zeros[np.isfinite(zeros)]
    shifted_plant = (MODEL.dynamics(0.0) + SHIFT * np.eye(6), MODEL.INPUT, np.eye(3, 6), np.zeros((3, 3)))
    shifted = complex(SHIFT, RATE)
    at_zero, at_pole = abs(CHAPTER_6.performance(20.0)), abs(CHAPTER_6.uncertainty(shifted))
    crossing = float(FREQUENCIES[np.flatnonzero(t > np.sqrt(0.5))[-1]])
    least = 0.67 * (SHIFT + np.sqrt(4.0 * SHIFT**2 + 3.0 * RATE**2))
    ranks = [np.linalg.matrix_rank(g) for g in loops["G"]]
    imaginary = float(np.abs(poles.imag).max())
    return [
        Figure("(5.4): S of the scaled loop less S", "0", float(np.abs(np.array(scaled) - plain).max()), "", 0.0, 1e-6),
        Figure(
            "(5.5): largest error under 1e-5 m/s² of any frequency, over 0.1 m",
            "at most 1",
            float(disturbed.max()),
            "",
            0.0,
            1.0,
        ),
        Figure(
            "(5.11): largest entry of S + T - I", "0", float(np.abs(loops["S"] + loops["T"] - eye).max()), "", 0.0, 1e-6
        ),
        Figure(
            "(5.12c): largest difference of the largest singular values of S and T",
            "at most 1",
            float(np.abs(s - t).max()),
            "",
            0.0,
            1.0 + 1e-9,
        ),
        Figure(
            "(5.14): largest w_P S over w_P at the zero",
            "at least 1",
            norms_on(CHAPTER_6, sampled)[0] / at_zero,
            "",
            1.0,
            10.0,
        ),
        Figure(
            "(5.15): largest w_I T over w_I at the pole",
            "at least 1",
            norms_on(CHAPTER_6, shifted_plant)[1] / at_pole,
            "",
            1.0,
            10.0,
        ),
        Figure(
            "(5.17): greatest bandwidth with zeros at 20",
            "10",
            20.0 * (1.0 - 0.5) / (1.0 - 0.003),
            "rad/min",
            9.9,
            10.1,
        ),
        Figure(
            "(5.19): bandwidth of T over the least with the shifted poles",
            "at least 1",
            crossing / float(least),
            "",
            1.0,
            np.inf,
        ),
        Figure("5.3.3: imaginary part of the poles", "0.0044", imaginary, "rad/min", 0.00435, 0.00445),
        Figure("5.3.3: zeros", "20", float(zeros.real.mean()), "1/min", 19.999, 20.001),
        Figure("5.3.3: number of zeros", "6", len(zeros), "", 6, 6),
        Figure("5.3.4: normal rank of G", "3", float(min(ranks)), "", 3, 3),
    ]


def uncertainty() -> list[Figure]:
    """The upper LFT, and the uncertainties that attain what (5.32) and (5.40) say."""
    design, rng, off = CHAPTER_6, np.random.default_rng(5), 0.0
    eye = np.eye(3)
    for w in (0.01, 0.3, 3.0):
        each = design.loop(1j * w)
        n, wi, wp = each["N"], design.uncertainty(1j * w), design.performance(1j * w)
        delta = rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))
        delta /= np.linalg.norm(delta, 2)
        plant = each["G"] @ (eye + wi * delta)
        direct = wp * np.linalg.inv(eye + plant @ each["K"])
        off = max(off, float(np.abs(upper_lft(n, delta) - direct).max()))
    uppers = [upper_mu(n)[0] for n in design.loops["N"]]
    at = int(np.argmax(uppers))
    n = design.loops["N"][at]
    mu, worst = lower_mu(n, upper_mu(n)[1])
    attained = float(np.linalg.norm(upper_lft(n, worst[:3, :3] / mu), 2)) / mu
    inner = design.loops["N"][:, :3, :3]
    sizes = largest(inner)
    left, values, right = np.linalg.svd(inner[int(sizes.argmax())])
    critical = np.outer(right[0].conj(), left[:, 0].conj()) / values[0]
    singular = float(np.abs(np.linalg.det(eye - inner[int(sizes.argmax())] @ critical)))
    return [
        Figure("(5.22): upper LFT less w_P S_p of the perturbed plant", "0", off, "", 0.0, 1e-9),
        Figure("(5.39): norm of F at the worst uncertainty of size 1/mu, over mu", "1", attained, "", 0.999, 1.001),
        Figure("(5.28): det(I - M Delta) at the least uncertainty that destabilises", "0", singular, "", 0.0, 1e-9),
    ]


def upper_lft(n: Complex, delta: Complex) -> Complex:
    """F_u(N, Delta), (5.22)."""
    inner = np.linalg.inv(np.eye(3) - n[:3, :3] @ delta)
    return np.asarray(n[3:, 3:] + n[3:, :3] @ delta @ inner @ n[:3, 3:])
