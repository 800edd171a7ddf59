"""Hook of MkDocs: what pages link to outside of docs/ comes along, so that a link of the repository is one of the site.

Markdown files become pages, others are shown as they are, all under `repository/`; of a folder its README, or no link.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
PLACE = PurePosixPath("repository")
"""Folder of the site for what is outside of docs/."""

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#:\s]+)(#[^)\s]*)?\)")


def on_files(files: Files, config: Any) -> Files:
    """Add what is linked to, and what that links to."""
    waiting = [ROOT / "docs" / file.src_uri for file in files.documentation_pages()]
    known = set(waiting)
    for page in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"):  # in the navigation
        files.append(_generated(config, ROOT / page))
        known.add(ROOT / page)
        waiting.append(ROOT / page)
    while waiting:
        for target in _targets(waiting.pop()):
            if target not in known and not target.is_relative_to(ROOT / "docs"):
                known.add(target)
                files.append(_generated(config, target))
                if target.suffix == ".md":
                    waiting.append(target)
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Lead links to where their targets are in the site."""
    source = PurePosixPath(page.file.src_uri)
    real = ROOT / (source.relative_to(PLACE) if source.is_relative_to(PLACE) else PurePosixPath("docs") / source)

    def replace(match: re.Match[str]) -> str:
        picture, text, link, anchor = match.groups()
        target = _file(real.parent / link)
        if target is None:
            return match[0] if not (real.parent / link).exists() else text
        in_docs = target.is_relative_to(ROOT / "docs")
        place = target.relative_to(ROOT / "docs") if in_docs else PLACE / target.relative_to(ROOT)
        return f"{picture}[{text}]({os.path.relpath(place, source.parent)}{anchor or ''})"

    return _LINK.sub(replace, markdown)


def _generated(config: Any, path: Path) -> File:
    return File.generated(config, (PLACE / path.relative_to(ROOT)).as_posix(), abs_src_path=str(path))


def _targets(page: Path) -> Iterable[Path]:
    """Files of the repository that a page links to."""
    links = _LINK.findall(page.read_text(encoding="utf-8"))
    return filter(None, (_file(page.parent / link) for _, _, link, _ in links))


def _file(path: Path) -> Path | None:
    """File of the repository that a link leads to; None for a folder without README, and for none."""
    path = path.resolve()
    path = path / "README.md" if path.is_dir() else path
    return path if path.is_file() and path.is_relative_to(ROOT) else None
