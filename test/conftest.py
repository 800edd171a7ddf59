"""What several folders of tests share."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

# No deadlines: the cost of a random orbit varies, and so does the load of the machine. A test that needs another
# number of examples sets it itself. The suite tries the same examples in every run, so that a change is judged by
# what it changes; `make verify` looks for new ones.
settings.register_profile("suite", deadline=None, max_examples=25, derandomize=True)
settings.register_profile("fast", settings.get_profile("suite"), max_examples=10)  # `make test-fast`
settings.register_profile("search", deadline=None, max_examples=100, print_blob=True)  # `make verify`
settings.load_profile("suite")


@pytest.fixture(scope="module")
def without_pictures() -> Iterator[None]:
    """Flights by command draw no overview, which takes longer than a short flight; test/analysis draws it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("formation_gnc.analysis.overview.draw_overview", lambda flown, path, title: Path(path))
        yield
