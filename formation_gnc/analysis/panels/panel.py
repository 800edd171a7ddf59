"""What a panel is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.plot import Plot
from formation_gnc.analysis.run_history import RunHistory

HISTORY = "errors, thrust, solver and timing"
"""Section of the page whose panels share a time axis."""

MEASUREMENTS = "measurements and innovations"
"""Section of the page with readings on the left and innovations on the right."""


@dataclass(frozen=True)
class Panel[H]:
    """Plots of a history `H`, drawn as a picture and on the page."""

    name: str
    """File name of its picture, after the deputy's."""
    plots: Callable[[H], Sequence[Plot]]
    """Plots of a history, from top to bottom; none where it has nothing to show."""
    section: str = ""
    """Section of the page, which panels may share; empty for one of its own."""
    column: int = 0
    """Column within the section."""
    in_overview: bool = True
    """Whether the overview picture has it."""

    @property
    def heading(self) -> str:
        """Heading of its section of the page."""
        return self.section or self.name.replace("_", " ")


class DeputyPanel(Panel[DeputyHistory]):
    """Drawn for every deputy."""


class FleetPanel(Panel[RunHistory]):
    """Drawn once, for all deputies."""
