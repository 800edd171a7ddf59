"""Panels are drawn as pictures and on the page, from one registry."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from formation_gnc.analysis import overview
from formation_gnc.analysis.deputy_history import DeputyHistory
from formation_gnc.analysis.matplotlib_renderer import draw
from formation_gnc.analysis.overview import draw_overview, draw_panels
from formation_gnc.analysis.panels.panel import DeputyPanel, FleetPanel
from formation_gnc.analysis.panels.registry import DEPUTY_PANELS, FLEET_PANELS, guarded
from formation_gnc.analysis.plot import TIME, Axis, Curve, Plot, Track
from formation_gnc.analysis.report import Origin, write_report
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario


def recorded(directory: Path, scenario: str) -> Bag:
    with BagWriter(directory, {}) as writer:
        Run(load_scenario(scenario, {"/plant": {"duration": 40.0}})).fly(InProcessRecorder(writer))
    return Bag(directory)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    return recorded(tmp_path_factory.mktemp("panels") / "bag", "leader_follower")


@pytest.fixture(scope="module")
def history(bag: Bag) -> RunHistory:
    return RunHistory(bag)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> RunHistory:
    return RunHistory(recorded(tmp_path_factory.mktemp("panels") / "fleet", "tetrahedral"))


def radius(deputy: DeputyHistory) -> list[Plot]:
    """A toy plot."""
    distance = np.linalg.norm(deputy.truth[:, :3], axis=1)
    curves = [Curve("distance of the toy", deputy.time, distance)]
    return [Plot("toy title", TIME, Axis("toy axis", "m", log=True), curves)]


@pytest.fixture
def toy() -> Iterator[DeputyPanel]:
    """A panel in the registry, as its file and its line put it there."""
    panel = DeputyPanel("toy", radius)
    DEPUTY_PANELS.append(panel)
    yield panel
    DEPUTY_PANELS.remove(panel)


@pytest.mark.thorough
def test_a_new_panel_is_in_overview_pictures_and_page(
    toy: DeputyPanel, bag: Bag, history: RunHistory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []
    draw = overview.draw
    monkeypatch.setattr(
        overview, "draw", lambda figure, place, plot: drawn.append(plot.title) or draw(figure, place, plot)
    )
    draw_overview(history, tmp_path / "overview.png", "one")
    assert "toy title" in drawn
    assert tmp_path / "deputy1_toy.png" in draw_panels(history, tmp_path)
    page = write_report(bag, history, tmp_path / "report.html", "one", Origin("bag", "0")).read_text()
    assert "<h2>deputy1: toy</h2>" in page
    assert "distance of the toy" in page
    assert "toy axis [m]" in page


@pytest.mark.parametrize("panel", DEPUTY_PANELS, ids=lambda panel: panel.name)
def test_curves_of_a_panel_are_numbers_of_equal_length(panel: DeputyPanel, fleet: RunHistory) -> None:
    for deputy in fleet.deputies.values():
        for curve in (curve for plot in panel.plots(deputy) for curve in plot.curves):
            assert curve.x.shape == curve.y.shape
            assert np.isfinite(curve.x).all()
            assert np.isfinite(curve.y).all()


@pytest.mark.parametrize("rows", [slice(1, 3), slice(-1, None), slice(None)], ids=["inner", "last", "all"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308])
def test_a_picture_leaves_out_points_it_has_no_place_for(value: float, rows: slice, tmp_path: Path) -> None:
    good, bad = np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5)
    bad[rows] = value
    axis = Axis("toy", "m")
    tracks = [Track("now", good, np.column_stack((good, bad, good)))]
    space = Plot("space", axis, axis, [Curve("path", bad, good, z=good)], z=axis, equal=True, tracks=tracks)
    plane = Plot("plane", axis, axis, [Curve("path", good, bad), Curve("whole", good, good)], equal=True)
    figure = Figure()
    grid = figure.add_gridspec(1, 2)
    for column, plot in enumerate((space, plane)):
        draw(figure, grid[0, column], plot)
    figure.savefig(tmp_path / "picture.png")


def test_every_panel_has_a_name_of_its_own() -> None:
    names = [panel.name for panel in (*FLEET_PANELS, *DEPUTY_PANELS)]
    assert len(set(names)) == len(names)
    assert all(name.isidentifier() for name in names)


def test_a_single_deputy_has_no_distances(history: RunHistory, fleet: RunHistory) -> None:
    distances: FleetPanel = next(panel for panel in FLEET_PANELS if panel.name == "distances")
    assert distances.plots(history) == []
    assert len(distances.plots(fleet)[0].curves) == 6


@pytest.mark.thorough
def test_each_panel_with_data_has_a_picture(history: RunHistory, tmp_path: Path) -> None:
    pictures = draw_panels(history, tmp_path)
    without_data = {"solver", "timing"}  # of LQR, in-process
    names = {panel.name for panel in DEPUTY_PANELS} - without_data
    assert {picture.name for picture in pictures} == {
        "fleet_trajectory.png",
        *(f"deputy1_{name}.png" for name in names),
    }
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)


def test_the_overview_has_all_deputies_and_the_fleet(
    fleet: RunHistory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []
    monkeypatch.setattr(overview, "draw", lambda _figure, _place, plot: drawn.append(plot.title))
    assert draw_overview(fleet, tmp_path / "overview.png", "four").read_bytes().startswith(b"\x89PNG")
    assert drawn.count("control error") == drawn.count("acceleration by thrust, and delta-v") == 4
    assert drawn[:2] == ["relative trajectory", "distances between deputies"]


def test_a_figure_of_a_plug_in_that_raises_is_left_out_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    def plots(_: DeputyHistory) -> list[Plot]:
        raise KeyError("temperature")

    panel = guarded("thermal", DeputyPanel("thermal", plots))
    assert isinstance(panel, DeputyPanel)
    assert panel.plots(None) == []
    assert capsys.readouterr().err == "formation-gnc: figure thermal is left out: KeyError: 'temperature'\n"
