"""What several folders of tests share."""

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def without_pictures() -> Iterator[None]:
    """Flights by command draw no overview, which takes longer than a short flight; test/analysis draws it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("formation_gnc.analysis.overview.draw_overview", lambda flown, path, title: Path(path))
        yield
