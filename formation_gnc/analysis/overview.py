"""Pictures of a recorded run, for a README or a paper."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from formation_gnc.analysis.matplotlib_renderer import draw
from formation_gnc.analysis.panels.panel import Panel
from formation_gnc.analysis.panels.registry import DEPUTY_PANELS, FLEET_PANELS
from formation_gnc.analysis.plot import Plot
from formation_gnc.analysis.run_history import RunHistory


def draw_overview(run: RunHistory, path: Path, title: str) -> Path:
    """Draw the overview panels of the deputy; for a fleet those of all together, then a row for each deputy.

    Args:
        run: to draw.
        path: PNG file to write.
        title: of the picture.

    Returns:
        The path.
    """
    rows = [_overview_plots(deputy, DEPUTY_PANELS) for deputy in run.deputies.values()]
    if len(rows) == 1:  # a single deputy in two columns
        rows = [rows[0][start : start + 2] for start in range(0, len(rows[0]), 2)]
    else:
        rows.insert(0, _overview_plots(run, FLEET_PANELS))
    columns = max(len(row) for row in rows)
    figure = _figure(5.5 * columns, 4.4 * len(rows) + 0.4, 100)
    figure.suptitle(title)
    grid = figure.add_gridspec(len(rows), columns)
    for number, row in enumerate(rows):
        for column, plot in enumerate(row):
            cells = slice(column * columns // len(row), (column + 1) * columns // len(row))
            draw(figure, grid[number, cells], plot)
    figure.savefig(path)
    return path


def draw_panels(run: RunHistory, directory: Path) -> list[Path]:
    """Draw each panel as a picture of its own, `DEPUTY_PANEL.png` or `fleet_PANEL.png`.

    Returns:
        The paths of the files; a panel that has nothing to show has none.
    """
    pictures = {f"fleet_{panel.name}": panel.plots(run) for panel in FLEET_PANELS}
    for deputy in run.deputies.values():
        pictures |= {f"{deputy.name}_{panel.name}": panel.plots(deputy) for panel in DEPUTY_PANELS}
    return [draw_column(plots, directory / f"{name}.png") for name, plots in pictures.items() if plots]


def _overview_plots[H](history: H, panels: Sequence[Panel[H]]) -> list[Plot]:
    return [plot for panel in panels if panel.in_overview for plot in panel.plots(history)]


def draw_column(plots: Sequence[Plot], path: Path) -> Path:
    """Draw plots below one another as a picture; returns its path."""
    figure = _figure(6.0, 4.5 * len(plots), 150)
    grid = figure.add_gridspec(len(plots), 1)
    for row, plot in enumerate(plots):
        draw(figure, grid[row, 0], plot)
    figure.savefig(path)
    return path


def _figure(width: float, height: float, dpi: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained", dpi=dpi)
    FigureCanvasAgg(figure)
    return figure
