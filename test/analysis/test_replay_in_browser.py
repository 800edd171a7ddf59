"""The page in a real browser: everything moves with one slider, offline and without a word on the console."""

import json
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.analysis.report import Origin, write_report
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

from .browser import CHROMIUM, Browser, in_browser

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed"),
    pytest.mark.thorough,
]

COAST = {"/**/controller": {"schedule": ["{at: 100.0, algorithm: coast}"]}}
CHANGE = {"/**/guidance": {"schedule": ["{at: 100.0, formation: three_in_plane_one_out}"]}}

SHOW = """(async (share) => {
  const slider = document.querySelector('.time input');
  slider.value = Number(slider.min) + share * (slider.max - slider.min);
  slider.dispatchEvent(new Event('input'));
  for (const each of document.querySelectorAll('.deputy[open] .figure')) await page.drawFigure(each);
  const satellites = (view) => [...document.querySelectorAll(`.view[aria-label=${view}] [data-satellite]`)];
  const places = (view) => Object.fromEntries(satellites(view)
    .map((each) => [each.dataset.satellite, [each.getAttribute('cx'), each.getAttribute('cy')].join()]));
  return {
    time: page.time,
    orbit: places('orbit'),
    formation: places('formation'),
    cursors: [...document.querySelectorAll('.cursor')].map((each) => parseFloat(each.style.left)),
    targets: document.querySelectorAll('[data-target]').length,
    ellipsoids: document.querySelectorAll('[data-ellipsoid]').length,
    thrusts: document.querySelectorAll('[data-thrust]').length,
    keepOut: document.querySelectorAll('[data-keep-out]').length,
    fits: document.documentElement.scrollWidth <= innerWidth,
    paper: getComputedStyle(document.body).backgroundColor,
  };
})(%g)"""

SAVE = """(async () => {
  const saved = {};
  page.save = (svg, name) => { saved[name] = svg; };
  document.querySelectorAll('.view .save').forEach((each) => each.click());
  const figures = [...document.querySelectorAll('.deputy[open] .figure')];
  figures.forEach((each) => each.querySelector('.svg').click());
  while (Object.keys(saved).length < 2 + figures.length) await new Promise((done) => setTimeout(done, 20));
  return saved;
})()"""


def page_of(directory: Path, scenario: str, change: dict[str, dict[str, Any]], hostile: str = "") -> Path:
    keep_out = {"parameters /deputy1/guidance": {"separation_warning": "30.0"}, "run": {"name": hostile}}
    with BagWriter(directory, keep_out) as writer:
        Run(load_scenario(scenario, {"/plant": {"duration": 300.0}} | change)).fly(InProcessRecorder(writer))
    bag = Bag(directory)
    return write_report(bag, RunHistory(bag), directory / "report.html", hostile or scenario, Origin(hostile, "0"))


@pytest.mark.parametrize(
    ("scenario", "change", "deputies", "width", "scheme"),
    [("leader_follower", COAST, 1, 1400, "light"), ("tetrahedral", CHANGE, 4, 400, "dark")],
)
def test_one_slider_moves_orbit_formation_and_curves(
    tmp_path: Path, scenario: str, change: dict[str, dict[str, Any]], deputies: int, width: int, scheme: str
) -> None:
    page = page_of(tmp_path / "bag", scenario, change)

    async def look(browser: Browser) -> None:
        await browser.open(page, width=width, scheme=scheme)
        before, after = await browser.run(SHOW % 0.2), await browser.run(SHOW % 0.8)
        assert before["time"] == pytest.approx(60.0, abs=1.0)
        names = {f"deputy{number}" for number in range(1, deputies + 1)}
        assert set(before["formation"]) == names
        assert set(before["orbit"]) == names | {"chief"}
        for view in ("orbit", "formation"):
            assert all(before[view][name] != after[view][name] for name in names), view
        assert before["cursors"], "the curves have a cursor"
        assert len(before["cursors"]) == len(after["cursors"])
        assert all(one < other for one, other in zip(before["cursors"], after["cursors"], strict=True))
        assert before["targets"] == before["ellipsoids"] == deputies
        assert before["thrusts"] == deputies
        assert before["keepOut"] == 1
        assert before["fits"], "nothing is wider than the screen"
        assert (before["paper"] == "rgb(255, 255, 255)") == (scheme == "light")
        assert browser.problems == []

    in_browser(tmp_path / "profile", look)


def test_play_moves_on_and_figures_are_saved_as_svg(tmp_path: Path) -> None:
    hostile = "</script><script>throw 1</script><img src=x onerror=\"throw 2\"> & 'it'"
    page = page_of(tmp_path / "bag", "leader_follower", COAST, hostile)

    async def play(browser: Browser) -> None:
        await browser.open(page)
        button = "document.querySelector('.time > button')"
        await browser.run(f"{button}.click()")
        moved = (
            "new Promise((done) => { const look = () => page.time > 5 ? done(true) : setTimeout(look, 10); look(); })"
        )
        assert await browser.run(moved)
        await browser.run(f"{button}.click()")
        at = await browser.run("document.querySelector('tr[data-time]').click() || page.time")
        assert at == await browser.run("Number(document.querySelector('tr[data-time]').dataset.time)")
        saved = await browser.run(SAVE)
        assert len(saved) == 2 + 3
        parses = "(text) => !new DOMParser().parseFromString(text, 'image/svg+xml').querySelector('parsererror')"
        for svg in saved.values():
            assert await browser.run(f"({parses})({json.dumps(svg)})")
            assert "<image" not in svg, "vectors, also of points that WebGL draws on the page"
        assert await browser.run("document.querySelector('h1').textContent") == hostile
        assert await browser.run("document.querySelectorAll('img').length") == 0
        assert browser.problems == []

    in_browser(tmp_path / "profile", play)
