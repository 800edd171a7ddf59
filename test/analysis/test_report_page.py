"""The report page: its contents, and that a browser shows it."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.report import write_report
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

BROWSER = shutil.which("chromium")


COAST = {"/**/controller": {"schedule": ["{at: 100.0, algorithm: coast}"]}}
CHANGE = {"/**/guidance": {"schedule": ["{at: 100.0, formation: three_in_plane_one_out}"]}}


def fly(directory: Path, scenario: str, change: dict[str, dict[str, Any]]) -> Bag:
    overrides = {"/plant": {"duration": 300.0}} | change
    with BagWriter(directory, {"run": {"name": "<b>bold</b>"}}) as writer:
        Run(load_scenario(scenario, overrides)).fly(InProcessRecorder(writer))
    return Bag(directory)


def page_of(bag: Bag) -> Path:
    return write_report(bag, RunHistory(bag), bag.path / "report.html", "a <title>")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    return fly(tmp_path_factory.mktemp("report") / "bag", "leader_follower", COAST)


@pytest.fixture(scope="module")
def page(bag: Bag) -> Path:
    return page_of(bag)


def test_the_page_is_self_contained_and_describes_the_run(page: Path, bag: Bag) -> None:
    text = page.read_text()
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)=["\']https?:', text), "no request to the network"
    assert "algorithm: lqr -&gt; coast" in text
    assert "a &lt;title&gt;" in text
    assert "&lt;b&gt;bold&lt;/b&gt;" in text, "text of a bag is never markup"
    delta_v = 1e3 * figures(bag).deputies["deputy1"].delta_v_m_s
    (shown,) = re.findall(r"delta-v \[mm/s\]</th><td>([\d.]+)<", text)
    assert float(shown) == pytest.approx(delta_v, abs=0.006), "the sum over all ticks, not over the drawn ones"
    assert "control law at the end</th><td>coast" in text
    assert "formation</th><td>held" in text


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
@pytest.mark.parametrize(
    ("scenario", "change", "deputies", "plots"),
    # the trajectory, for a fleet the distances, and three figures of each deputy
    [("leader_follower", COAST, 1, 1 + 3), ("tetrahedral", CHANGE, 4, 1 + 1 + 4 * 3)],
)
@pytest.mark.thorough
def test_a_browser_shows_the_page_and_its_slider_moves_every_deputy(
    tmp_path: Path, scenario: str, change: dict[str, dict[str, Any]], deputies: int, plots: int
) -> None:
    page = page_of(fly(tmp_path / "bag", scenario, change))
    # a script writes the state of the page into its title
    probe = page.with_name("probe.html")
    script = """<script>window.addEventListener('load', () => setTimeout(() => {
      const all = document.querySelectorAll('.js-plotly-plot'), first = all[0];
      const steps = first.layout.sliders[0].steps, drawn = first.querySelector('canvas') !== null;
      const where = () => first.data.filter(each => each.name.endsWith('at time')).map(each => each.y[0]);
      const before = where();
      Plotly.animate(first, ...steps[steps.length - 1].args);
      Plotly.restyle(all[1], {visible: 'legendonly'}, [0]);
      setTimeout(() => {
        const moved = where().filter((y, deputy) => y !== before[deputy]).length;
        const fits = document.documentElement.scrollWidth <= window.innerWidth;
        document.title = `shown ${[all.length, steps.length, drawn, moved, all[1].data[0].visible, fits]}`;
      }, 2000);
    }, 1000));</script></body>"""
    probe.write_text(page.read_text().replace("</body>", script))
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"]
    flags += [
        "--enable-unsafe-swiftshader",
        "--enable-logging=stderr",
        "--v=0",
        "--window-size=400,800",
        "--virtual-time-budget=60000",
    ]
    result = subprocess.run(
        [str(BROWSER), *flags, f"--user-data-dir={page.parent / 'profile'}", "--dump-dom", probe.as_uri()],
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
    )
    console = [line for line in result.stderr.splitlines() if ":CONSOLE" in line]
    errors = [line for line in console if ":INFO:CONSOLE" not in line or "Uncaught" in line]
    assert not errors
    assert "slider-container" in result.stdout
    title = re.search(r"<title>shown (.*)</title>", result.stdout)
    assert title is not None, console
    assert title[1] == f"{plots},120,true,{deputies},legendonly,true"
