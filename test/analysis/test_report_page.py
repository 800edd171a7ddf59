"""The report page: what is in it, how large it may get, and that a browser shows it."""

import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formation_gnc.analysis.metrics import figures
from formation_gnc.analysis.report import write_report
from formation_gnc.analysis.run_history import POINTS, RunHistory, Thinned
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.in_process_recorder import InProcessRecorder

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


def test_the_page_is_self_contained_and_says_what_was_flown(page: Path, bag: Bag) -> None:
    text = page.read_text()
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)=["\']https?:', text), "nothing from the network"
    assert "algorithm: lqr -&gt; coast" in text
    assert "a &lt;title&gt;" in text
    assert "&lt;b&gt;bold&lt;/b&gt;" in text, "what a bag says is text, never markup"
    spent = 1e3 * figures(bag).deputies["deputy1"].delta_v_m_s
    (said,) = re.findall(r"delta-v of deputy1</th><td>([\d.]+) mm/s", text)
    assert float(said) == pytest.approx(spent, abs=0.0006), "summed over every tick, not over the drawn ones"


def test_a_curve_never_has_more_than_twice_the_points_and_keeps_even_steps() -> None:
    thinned = Thinned(1)
    for start in range(0, 50_000, 777):
        thinned.add(np.arange(start, start + 777, dtype=float)[:, None])
        assert len(thinned.rows) <= 2 * POINTS
    steps = np.unique(np.diff(thinned.rows[:, 0]))
    assert len(steps) == 1
    assert math.log2(steps[0]).is_integer()


@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
@pytest.mark.parametrize(
    ("scenario", "change", "deputies", "plots"),
    # in space, and two of each deputy; of several also how far apart they are
    [("leader_follower", COAST, 1, 1 + 2), ("tetrahedral", CHANGE, 4, 1 + 1 + 4 * 2)],
)
def test_a_browser_shows_the_page_without_errors_and_its_slider_moves_every_deputy(
    tmp_path: Path, scenario: str, change: dict[str, dict[str, Any]], deputies: int, plots: int
) -> None:
    page = page_of(fly(tmp_path / "bag", scenario, change))
    # what the page does is written into its title, which the dumped document shows
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
        document.title = `shown ${[all.length, steps.length, drawn, moved, all[1].data[0].visible]}`;
      }, 2000);
    }, 1000));</script></body>"""
    probe.write_text(page.read_text().replace("</body>", script))
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader"]
    flags += [
        "--enable-unsafe-swiftshader",
        "--enable-logging=stderr",
        "--v=0",
        "--virtual-time-budget=60000",
    ]
    result = subprocess.run(
        [str(BROWSER), *flags, f"--user-data-dir={page.parent / 'profile'}", "--dump-dom", probe.as_uri()],
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
    )
    said = [line for line in result.stderr.splitlines() if ":CONSOLE" in line]
    wrong = [line for line in said if ":INFO:CONSOLE" not in line or "Uncaught" in line]
    assert not wrong
    assert "slider-container" in result.stdout
    title = re.search(r"<title>shown (.*)</title>", result.stdout)
    assert title is not None, said
    assert title[1] == f"{plots},120,true,{deputies},legendonly"
