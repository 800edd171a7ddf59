"""`coverage.md`: every item of the five documents, where it is implemented and verified, and its verdict.

The items of a document are in its list here. What covers them is marked where it is verified: by a call of `covers`
in a module of the verification, or by `pytest.mark.covers` on a test, with the same arguments. An item without a mark
is missing. Of a mark without a figure beside a printed one, and without a difference, only equations may be called
reproduced: a test is what shows them.
"""

import ast
import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
LISTS = Path(__file__).parent
PAGES = ROOT / "docs" / "verification"
DOCUMENTS = ("Joshi", "Roberts", "Kremmydas", "Owis", "Neokleous")

REPRODUCED, DIFFERENT, IMPOSSIBLE, MISSING = (
    "reproduced",
    "reproduced with a stated difference",
    "cannot be reproduced",
    "missing",
)
VERDICTS = (REPRODUCED, DIFFERENT, IMPOSSIBLE, MISSING)


class CoverageError(Exception):
    """A mark that names something that is not there, or claims what it does not show."""


@dataclass(frozen=True)
class Mark:
    """One call of `covers`."""

    place: str
    """File, and line, for messages."""
    verified: str
    """Link to the page, or the test's name."""
    document: str
    items: tuple[str, ...]
    implemented: tuple[str, ...]
    figures: tuple[str, ...] = ()
    differs: str = ""
    impossible: str = ""

    @property
    def verdict(self) -> str:
        """What this mark alone claims."""
        return IMPOSSIBLE if self.impossible else DIFFERENT if self.differs else REPRODUCED


@dataclass(frozen=True)
class Row:
    """A row of a table *figure, printed, ours, stated tolerance, holds*."""

    printed: str
    ours: str
    holds: bool


def items(document: str) -> dict[str, str]:
    """Titles of all items of a document."""
    with (LISTS / f"{document.lower()}.csv").open(encoding="utf-8") as stream:
        rows = list(csv.reader(stream))[1:]
    titles = dict(rows)
    if len(titles) < len(rows):
        raise CoverageError(f"{document}: an item is listed twice")
    return titles


def figures(pages: Path = PAGES) -> dict[str, Row]:
    """Rows of the tables of all pages, by name."""
    found: dict[str, Row] = {}
    for page in sorted(pages.glob("*.md")):
        for line in page.read_text(encoding="utf-8").splitlines():
            cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
            if page.name != "coverage.md" and len(cells) == 5 and cells[4] in ("yes", "**NO**"):
                found[cells[0]] = Row(cells[1], cells[2], cells[4] == "yes")
    return found


def marks() -> list[Mark]:
    """All marks of the verification and of the tests."""
    return [
        mark
        for folder in ("verification", "test")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if "covers(" in (source := path.read_text(encoding="utf-8"))
        for mark in _marks_of(path.relative_to(ROOT), ast.parse(source))
    ]


def _marks_of(path: Path, tree: ast.Module) -> Iterator[Mark]:
    """Marks of one file: calls on its outermost level, and decorators of its tests."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and _is_mark(node.value):
            yield _mark(path, node.value, _page_of(path))
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from (_mark(path, each, f"`{node.name}`") for each in node.decorator_list if _is_mark(each))


def _is_mark(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and (
        (isinstance(node.func, ast.Name) and node.func.id == "covers")
        or (isinstance(node.func, ast.Attribute) and node.func.attr == "covers")
    )


def _page_of(path: Path) -> str:
    """Link to the page that a module of the verification writes."""
    source = (ROOT / path).read_text(encoding="utf-8")
    named = re.search(r'^PAGE = "(\w+)"', source, re.MULTILINE)
    page = named.group(1) if named else "seeds" if path.parent.name == "seeds" else path.stem
    return f"[{page}]({page}.md)"


def _mark(path: Path, node: Any, verified: str) -> Mark:
    place = f"{path}:{node.lineno}"
    try:
        named, *implemented = (ast.literal_eval(each) for each in node.args)
        more = {each.arg: ast.literal_eval(each.value) for each in node.keywords}
        document, rest = named.split(" ", 1)
        if isinstance(more.get("figures"), str):
            raise ValueError("figures is a word, not a tuple of words")
        return Mark(place, verified, document, tuple(rest.split("; ")), tuple(implemented), **more)
    except (TypeError, ValueError) as error:
        raise CoverageError(f"{place}: not a mark: {error}") from error


def check(all_marks: list[Mark], rows: dict[str, Row]) -> list[str]:
    """What is wrong with the marks, one line each."""
    wrong = []
    for mark in all_marks:
        listed = items(mark.document) if mark.document in DOCUMENTS else {}
        wrong += [f"{mark.place}: {mark.document} has no item {item!r}" for item in mark.items if item not in listed]
        wrong += [
            f"{mark.place}: no file formation_gnc/{name}"
            for name in mark.implemented
            if not (ROOT / "formation_gnc" / name).is_file()
        ]
        wrong += [f"{mark.place}: no page has a figure {name!r}" for name in mark.figures if name not in rows]
        wrong += [
            f"{mark.place}: {name!r} is outside its tolerance"
            for name in mark.figures
            if name in rows and not rows[name].holds
        ]
        shown = any(rows[name].printed for name in mark.figures if name in rows)
        equations = all(not item.startswith(("Fig.", "Table")) for item in mark.items)
        if mark.verdict == REPRODUCED and not shown and not (equations and mark.verified.startswith("`")):
            wrong.append(f"{mark.place}: called reproduced without a figure beside a printed one, or a test")
    return wrong


def page() -> str:
    """The page; raises `CoverageError` for a wrong mark."""
    all_marks, rows = marks(), figures()
    if wrong := check(all_marks, rows):
        raise CoverageError("\n".join(wrong))
    counts = {document: dict.fromkeys(VERDICTS, 0) for document in DOCUMENTS}
    parts = []
    for document in DOCUMENTS:
        parts += ["", f"## {document}", "", "| item | implemented | verified | verdict |", "|---|---|---|---|"]
        for item, title in items(document).items():
            own = [mark for mark in all_marks if mark.document == document and item in mark.items]
            verdict = _verdict(own)
            counts[document][verdict] += 1
            parts.append(_line(item, title, own, rows, verdict))
    return "\n".join([HEADING, *_summary(counts), *parts, ""])


def _verdict(own: list[Mark]) -> str:
    """Of all marks of an item together: what one shows to differ differs."""
    return max((mark.verdict for mark in own), key=VERDICTS.index, default=MISSING)


def _line(item: str, title: str, own: list[Mark], rows: dict[str, Row], verdict: str) -> str:
    files = sorted({name for mark in own for name in mark.implemented})
    reasons = [
        *(mark.impossible or mark.differs for mark in own if mark.impossible or mark.differs),
        *(
            f"*{name}*: {rows[name].printed or 'not printed'}, ours {rows[name].ours}"
            for mark in own
            for name in mark.figures
        ),
    ]
    verdict = f"**{verdict}**" if verdict in (MISSING, IMPOSSIBLE) else verdict
    words = [
        f"{item}: {title}" if title else item,
        ", ".join(f"`{name}`" for name in files),
        ", ".join(dict.fromkeys(mark.verified for mark in own)),
        verdict + (": " if reasons else "") + "; ".join(dict.fromkeys(reasons)),
    ]
    return "| " + " | ".join(word.replace("|", r"\|") for word in words) + " |"


def _summary(counts: dict[str, dict[str, int]]) -> list[str]:
    lines = ["| document | " + " | ".join(VERDICTS) + " | of |", "|---" * (len(VERDICTS) + 2) + "|"]
    for document, own in counts.items():
        lines.append(f"| {document} | " + " | ".join(str(own[each]) for each in VERDICTS) + f" | {sum(own.values())} |")
    totals = [sum(own[each] for own in counts.values()) for each in VERDICTS]
    return [*lines, "| all | " + " | ".join(map(str, totals)) + f" | {sum(totals)} |"]


HEADING = """# What of the five documents is covered

Written by `verification/coverage/` from the marks beside the verification and the tests, and from the figures of the
other pages here; files are in `formation_gnc/`, tests in `test/`. *Reproduced*: a figure of ours agrees with the
printed one, or a test shows the equation as it is printed. *With a stated difference*: the equation is a misprint, a
number does not come out, or there is nothing printed to hold ours to: the plots of all five documents are lost in the
text that is left of them, and what stands beside ours then is what the text and the captions say. Misprints are in
[errata](../theory/errata.md). *Missing*: not done.
"""


def main(directory: Path) -> int:
    """Write the page."""
    (directory / "coverage.md").write_text(page(), encoding="utf-8")
    return 0
