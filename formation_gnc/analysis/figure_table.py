"""Names, units and digits of figures of merit, the same wherever they are shown."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """How a figure of `DeputyFigures` is shown.

    Attributes:
        name: of the field, in SI units.
        title: for people.
        unit: shown; empty for a ratio, a count or a word.
        digits: after the point.
        factor: from SI to the unit shown.
    """

    name: str
    title: str
    unit: str = ""
    digits: int = 0
    factor: float = 1.0

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def text(self, value: float | str | None, sign: str = "") -> str:
        """A value in the unit shown; empty for None, and a word as it is."""
        if isinstance(value, str) or value is None:
            return value or ""
        return f"{value * self.factor:{sign}.{self.digits}f}"

    def difference(self, value: float | str | None, reference: float | str | None) -> str:
        """A value minus that of the reference in the unit shown; empty without both numbers."""
        if isinstance(value, str | None) or isinstance(reference, str | None):
            return ""
        return self.text(value - reference, "+")


FIGURES = (
    Figure("verdict", "formation"),
    Figure("final_error_m", "final position error", "m", 3),
    Figure("rms_error_m", "RMS position error", "m", 3),
    Figure("error_trend", "error trend", "-", 2),
    Figure("estimate_rms_m", "RMS estimation error", "m", 3),
    Figure("nis_ratio", "NIS over expected", "-", 3),
    Figure("nis_band", "99.73 % band of it", "-"),
    Figure("divergences", "divergences"),
    Figure("delta_v_x_m_s", "delta-v x", "mm/s", 2, 1e3),
    Figure("delta_v_y_m_s", "delta-v y", "mm/s", 2, 1e3),
    Figure("delta_v_z_m_s", "delta-v z", "mm/s", 2, 1e3),
    Figure("delta_v_m_s", "delta-v", "mm/s", 2, 1e3),
    Figure("commanded_delta_v_m_s", "delta-v commanded", "mm/s", 2, 1e3),
    Figure("saturated", "saturated ticks", "%", 1, 100.0),
    Figure("fallbacks", "fallback ticks"),
)
"""Figures of a deputy, in the order shown."""

RUN_FIGURES = (Figure("ticks", "ticks"), Figure("misses", "misses"))
"""Figures of a run as a whole."""
