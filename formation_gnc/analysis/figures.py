"""Figures of merit of a recorded run."""

from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import gammaincinv

from formation_gnc.analysis.trajectory import Trajectory, event_kinds, has_messages, trajectories
from formation_gnc.analysis.verdict import ErrorHistory, Verdict
from formation_gnc.flight import topics
from formation_gnc.recording.fields import Fields
from formation_gnc.recording.reader import Bag
from formation_gnc.records import EventKind, kind_name
from formation_gnc.types import Vector


@dataclass(frozen=True)
class DeputyFigures:
    """Figures of one deputy, by the names that `formation-gnc sil --json` prints."""

    verdict: Verdict
    final_error_m: float
    rms_error_m: float
    error_trend: float
    """Largest error of the last orbit over that of the orbit before; halves of the run if it is shorter."""
    estimate_rms_m: float
    mean_nis: float
    nis_ratio: float
    """Sum of the normalised innovations squared over its expectation, the number of innovations."""
    nis_band: list[float]
    """Bounds of `nis_ratio` for a consistent filter, with 99.73 %."""
    divergences: int
    """Number of times the filter diverged or its estimate was lost."""
    delta_v_m_s: float
    delta_v_axes_m_s: list[float]
    commanded_delta_v_m_s: float
    saturated: float
    """Share of the ticks on which the thrust limit cut the demand."""
    fallbacks: int
    """Ticks on which the law's own answer could not be used."""
    law: str
    """Name of the control law of the last command; empty without one."""
    mode: str
    """Mode at the end; empty without a supervisor."""

    def by_name(self) -> dict[str, float | str]:
        """Figures by name, each axis and each bound in words of its own."""
        values = asdict(self)
        for axis, value in zip("xyz", values.pop("delta_v_axes_m_s"), strict=True):
            values[f"delta_v_{axis}_m_s"] = value
        values["nis_band"] = " to ".join(f"{bound:.3f}" for bound in self.nis_band)
        return values

    def shown(self) -> dict[str, float | str | None]:
        """Figures by name as tables show them: no NIS where no innovation says one, rather than one of zero."""
        return self.by_name() | ({} if any(self.nis_band) else {"nis_ratio": None, "nis_band": "no innovations"})


@dataclass(frozen=True)
class RunFigures:
    """Figures of a whole run."""

    ticks: int
    misses: int
    deputies: dict[str, DeputyFigures]

    @property
    def verdict(self) -> Verdict:
        """That of the deputy which is worst off."""
        return max((each.verdict for each in self.deputies.values()), key=list(Verdict).index)


@np.errstate(all="ignore")  # what a bag holds may be as large as a float
def figures(bag: Bag) -> RunFigures:
    """Figures of a run.

    Raises:
        BagError: as for `trajectories`.
    """
    events = bag.arrays(topics.EVENTS.name, ("kind", "node")) if has_messages(bag, topics.EVENTS.name) else None
    deputies = {name: deputy_figures(name, path, events) for name, path in trajectories(bag).items()}
    misses = 0 if events is None else event_kinds(events).count(kind_name(EventKind.MISS))
    return RunFigures(bag.topics[topics.TRUTH.name].count, misses, deputies)


def deputy_figures(name: str, path: Trajectory, events: Fields | None) -> DeputyFigures:
    """Figures of one deputy from its trajectory and the events of the run, with kind, node and time; None without."""
    error = np.linalg.norm(path.error, axis=1)
    estimation = np.linalg.norm(path.estimation_error[:, :3], axis=1)
    measured = path.nis[path.nis > 0.0]
    count = float(path.innovations.sum())
    changes = _times_of(events, name, EventKind.RECONFIGURATION, EventKind.INFEASIBLE)
    size = np.linalg.norm(path.target[:, :3], axis=1)
    history = ErrorHistory(
        path.time,
        error,
        size,
        float(path.applied_time[-1] if len(path.applied_time) else 0.0),
        path.period,
        float(changes[-1]) if len(changes) else 0.0,
        path.mode,
    )
    commanded = path.commanded_delta_v
    return DeputyFigures(
        verdict=history.verdict,
        final_error_m=float(error[-1]),
        rms_error_m=float(np.sqrt(np.mean(error**2))),
        error_trend=history.trend,
        estimate_rms_m=float(np.sqrt(np.mean(estimation**2))),
        mean_nis=float(measured.mean()) if len(measured) else 0.0,
        nis_ratio=float(path.nis.sum()) / count if count else 0.0,
        nis_band=(2.0 * gammaincinv(count / 2.0, [0.00135, 0.99865]) / count).tolist() if count else [0.0, 0.0],
        divergences=len(_times_of(events, name, EventKind.DIVERGED, EventKind.LOST)),
        delta_v_m_s=float(path.delta_v.sum()),
        delta_v_axes_m_s=path.delta_v.tolist(),
        commanded_delta_v_m_s=float(commanded[-1]) if len(commanded) else 0.0,
        saturated=path.saturated,
        fallbacks=path.fallbacks,
        law=path.law,
        mode=path.mode,
    )


def _times_of(events: Fields | None, deputy: str, *kinds: EventKind) -> Vector:
    """Times (s) of a deputy's events of some kinds."""
    if events is None:
        return np.zeros(0)
    own = np.array([str(node).startswith(f"/{deputy}/") for node in events["node"]])
    return np.asarray(events["time"][own & np.isin(event_kinds(events), [kind_name(kind) for kind in kinds])])
