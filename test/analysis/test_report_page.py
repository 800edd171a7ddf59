"""The report page: its contents, and what it claims of the bag and its replay."""

import re
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from formation_gnc.analysis.figures import figures
from formation_gnc.analysis.report import Origin, write_report
from formation_gnc.analysis.run_history import RunHistory
from formation_gnc.cli import main
from formation_gnc.commands.sil import open_page
from formation_gnc.recording.files import digest_of
from formation_gnc.recording.in_process_recorder import InProcessRecorder
from formation_gnc.recording.reader import Bag
from formation_gnc.recording.writer import BagWriter
from formation_gnc.sil.runner import Run
from formation_gnc.sil.scenario import load_scenario

COAST = {"/**/controller": {"schedule": ["{at: 100.0, algorithm: coast}"]}}


def fly(directory: Path, scenario: str, change: dict[str, dict[str, Any]]) -> Bag:
    overrides = {"/plant": {"duration": 300.0}} | change
    with BagWriter(directory, {"run": {"name": "<b>bold</b>"}}) as writer:
        Run(load_scenario(scenario, overrides)).fly(InProcessRecorder(writer))
    return Bag(directory)


def page_of(bag: Bag) -> Path:
    origin = Origin("a 'bag' <i>", digest_of(bag.path))
    return write_report(bag, RunHistory(bag), bag.path / "report.html", "a <title>", origin)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    return fly(tmp_path_factory.mktemp("report") / "bag", "leader_follower", COAST)


@pytest.fixture(scope="module")
def page(bag: Bag) -> Path:
    return page_of(bag)


def test_the_page_is_self_contained_and_describes_the_run(page: Path, bag: Bag) -> None:
    text = page.read_text()
    assert len(text) < 10e6
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)=["\']https?:', text), "no request to the network"
    assert "algorithm: lqr -&gt; coast" in text
    assert "a &lt;title&gt;" in text
    assert "&lt;b&gt;bold&lt;/b&gt;" in text, "text of a bag is never markup"
    delta_v = 1e3 * figures(bag).deputies["deputy1"].delta_v_m_s
    (shown,) = re.findall(r"delta-v \[mm/s\]</th><td>([\d.]+)<", text)
    assert float(shown) == pytest.approx(delta_v, abs=0.006), "the sum over all ticks, not over the drawn ones"
    assert "control law at the end</th><td>coast" in text
    assert "formation</th><td>held" in text


def badge_of(bag: Bag, differences: list[str] | None) -> str:
    origin = Origin(str(bag.path), digest_of(bag.path), differences)
    text = write_report(bag, RunHistory(bag), bag.path / "badge.html", "badge", origin).read_text()
    (badge,) = re.findall(r'<p class="badge.*?</p>', text)
    return str(badge)


def test_the_badge_claims_only_what_a_replay_has_shown(bag: Bag) -> None:
    assert "Not replayed" in badge_of(bag, None)
    assert "same bits</b>" in badge_of(bag, [])
    differs = badge_of(bag, ["/deputy1/estimate at 3 s: <one> bit"])
    assert "The replay differs" in differs
    assert "&lt;one&gt; bit" in differs
    assert all("same bits</b>" not in each for each in (differs, badge_of(bag, None)))


def test_the_badge_has_the_digest_that_sha256sum_prints(bag: Bag) -> None:
    (file,) = bag.path.glob("*.mcap")
    assert sha256(file.read_bytes()).hexdigest() in badge_of(bag, None)


def test_the_report_command_replays_when_it_is_asked_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = tmp_path / "bag"
    command = ["sil", "leader_follower", "--in-process", "--duration", "60", "--bag", str(directory)]
    assert main(command) == 0
    page = directory / "report.html"
    assert not page.exists(), "flying alone writes no page"
    assert main(["report", str(directory)]) == 0
    assert "Not replayed" in page.read_text()
    assert main(["report", str(directory), "--replay"]) == 0
    assert "The replay gives the same bits" in page.read_text()
    assert f"report: {page}" in capsys.readouterr().out


def test_a_flight_with_its_page_ends_by_naming_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setenv("DISPLAY", ":0")
    command = ["sil", "leader_follower", "--in-process", "--duration", "60", "--page", "--bag", str(tmp_path / "bag")]
    assert main(command) == 0
    *_, last = capsys.readouterr().out.splitlines()
    page = tmp_path / "bag" / "report.html"
    assert last == f"page: {page}"
    assert "The replay gives the same bits" in page.read_text()
    assert not opened, "a browser is only for somebody at a terminal"
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    open_page(page)
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    open_page(page)
    assert opened == [page.absolute().as_uri()], "where there is a desktop"
