"""Links and files that the documentation names."""

import re
from pathlib import Path

import pytest

from tools.architecture import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md")])
FOLDERS = ("formation_gnc", "test", "tools", "bench", "verification", "launch")
SOURCES = [path.as_posix() for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
TEST = re.compile(r"^ *def (test_\w+)", re.MULTILINE)

BEING_MOVED = {"navigator.py", "screening.py", "sensors/registry.py", "test/sensors/test_adding_a_sensor.py"}

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@pages
def test_relative_links_lead_to_files(page: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert {link for link in links if not (page.parent / link).exists()} - BEING_MOVED == set()


@pages
def test_python_files_named_in_documentation_exist(page: Path) -> None:
    named = re.findall(r"`([\w/]+\.py)`", page.read_text(encoding="utf-8"))
    missing = {name for name in named if not any(source.endswith(f"/{name}") for source in SOURCES)}
    assert {name for name in missing if "NAME" not in name and name != "setup.py"} - BEING_MOVED == set()


@pages
def test_tests_named_in_documentation_exist(page: Path) -> None:
    named = set(re.findall(r"`(test_\w+)`", page.read_text(encoding="utf-8")))
    there = {name for path in (ROOT / "test").rglob("test_*.py") for name in TEST.findall(path.read_text())}
    assert named - there - {Path(source).stem for source in SOURCES} == set()
