"""Links and files that the documentation names, and the code that it shows."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import yaml

from formation_gnc import api, cli
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


BLOCK = re.compile(r"^( *)```(\w*)[^\n`]*\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?:^|\n\n)((?:    .*\n|\n)+)")
COMMAND = re.compile(r"^\s*(?:\$ |\w+=\S+ )*(formation-gnc \w.*)", re.MULTILINE)
MAKE = re.compile(r"^\s*(?:\$ )?make ([a-z][a-z-]*)", re.MULTILINE)


def blocks(page: Path, language: str) -> list[str]:
    """Fenced blocks of a language, without their indentation."""
    found = BLOCK.findall(page.read_text(encoding="utf-8"))
    return [re.sub(rf"^{indent}", "", text, flags=re.MULTILINE) for indent, name, text in found if name == language]


def code(page: Path) -> str:
    """All blocks of a page, fenced and indented."""
    text = page.read_text(encoding="utf-8")
    fenced = "\n".join(block for _, _, block in BLOCK.findall(text))
    return fenced + "\n" + "\n".join(INDENTED.findall(BLOCK.sub("", text)))


@pages
def test_python_blocks_compile_and_yaml_blocks_parse(page: Path) -> None:
    for block in blocks(page, "python"):
        compile(block, str(page), "exec")
    for block in blocks(page, "yaml"):
        yaml.safe_load(block)


@pages
def test_commands_that_are_shown_have_these_options(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in COMMAND.findall(code(page).replace("\\\n", " ")):
        arguments = shlex.split(line, comments=True)[1:]
        if arguments == ["--help"] or "COMMAND" in arguments:
            continue
        try:
            cli._options(arguments)
        except SystemExit:
            pytest.fail(f"{line}: {capsys.readouterr().err}")


@pages
def test_make_targets_that_are_shown_exist(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(MAKE.findall(code(page))) <= targets


def navigation(entries: Any) -> list[str]:
    """Pages of a part of the site's navigation."""
    if isinstance(entries, str):
        return [entries]
    values = entries.values() if isinstance(entries, dict) else entries
    return [page for value in values for page in navigation(value)]


def test_the_navigation_of_the_site_has_every_page_and_no_other() -> None:
    settings = re.sub(r"!!python/name:", "", (ROOT / "mkdocs.yml").read_text())
    listed = navigation(yaml.safe_load(settings)["nav"])
    there = {path.relative_to(ROOT / "docs").as_posix() for path in ROOT.glob("docs/**/*.md")}
    decisions = {page for page in there if page.startswith("decisions/0")}
    assert {page for page in listed if not page.startswith("repository/")} == there - decisions
    assert all((ROOT / page.removeprefix("repository/")).exists() for page in listed if page.startswith("repository/"))
    assert len(listed) == len(set(listed))


def test_the_page_of_the_public_interface_has_every_name() -> None:
    shown = re.findall(r"^::: ([\w.]+)$", (ROOT / "docs/reference/api.md").read_text(), re.MULTILINE)
    assert sorted(name.rpartition(".")[2] for name in shown) == api.__all__
