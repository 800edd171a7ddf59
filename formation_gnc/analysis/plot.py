"""Declarative description of a plot, which the renderers draw for pictures and for the page."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from formation_gnc.types import Matrix, Vector

BLACK, GREY, RED, BROWN = "#222222", "#7f7f7f", "#d62728", "#8c564b"
AXIS_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c")
"""Colours of the three Hill axes."""

HILL_AXES = ("x radial", "y along-track", "z cross-track")

COLOURS = (
    *("#2e91e5", "#e15f99", "#1ca71c", "#fb0d0d", "#da16ff", "#222a2a", "#b68100", "#750d86"),
    *("#eb663b", "#511cfb", "#00a08b", "#fb00d1", "#fc0080", "#b2828d", "#6c7c32", "#778aae"),
    *("#862a16", "#a777f1", "#620042", "#1616a7", "#da60ca", "#6c4516", "#0d2a63", "#af0038"),
)
"""Colours of deputies, sensors and whatever else is told apart by number."""


@dataclass(frozen=True)
class Style:
    """Look of a curve; width and size in points."""

    colour: str = BLACK
    line: Literal["solid", "dashed", "dotted", "none"] = "solid"
    width: float = 1.0
    marker: Literal["none", "dot", "star", "diamond"] = "none"
    size: float = 2.0


@dataclass(frozen=True)
class Axis:
    """Quantity, unit and scale of an axis."""

    label: str
    unit: str = ""
    log: bool = False
    reversed: bool = False
    lower_limit: float | None = None
    """Least value shown; None for the least of the curves."""

    @property
    def title(self) -> str:
        """Label with unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


TIME = Axis("time", "h")
"""Time axis: events and eclipses are marked on it."""


@dataclass(frozen=True)
class Curve:
    """A curve or a set of points; the legend shows every label once."""

    label: str
    x: Vector
    y: Vector
    style: Style = Style()
    z: Vector | None = None
    """Of a plot in space."""
    right: bool = False
    """Whether y is on the right axis."""


@dataclass(frozen=True)
class Track:
    """A point that moves in space."""

    label: str
    time: Vector
    """(N,) h."""
    position: Matrix
    """(N, 3) along the x, y and z axes of the plot."""
    style: Style = Style()


@dataclass(frozen=True)
class Plot:
    """Curves over common axes."""

    title: str
    x: Axis
    y: Axis
    curves: Sequence[Curve]
    right: Axis | None = None
    """Second y axis."""
    z: Axis | None = None
    """Third axis: the plot is in space."""
    equal: bool = False
    """Whether x and y have the same scale."""
    tracks: Sequence[Track] = field(default=())
    """Moving points of a plot in space, all at the same times."""

    @property
    def over_time(self) -> bool:
        """Whether events and eclipses are marked."""
        return self.x == TIME
