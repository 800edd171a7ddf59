from pathlib import Path
from typing import Any

import pytest

from formation_gnc.flight import topics
from formation_gnc.parameters import dump, leaves, load
from tools.architecture import ROOT
from tools.write_reference import HOW_TO_WRITE, PAGES, SCHEMAS, parameters_page

NEEDED = {
    "chief.semi_major_axis": 7.0e6,
    "duration": 100.0,
    "deputy1.relative_state": (0.0, -100.0, 0.0, 0.0, 0.0, 0.0),
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
@pytest.mark.thorough
def test_generated_documentation_is_up_to_date(page: Path) -> None:
    assert page.read_text() == PAGES[page](), f"run `{HOW_TO_WRITE}` and commit {page.relative_to(ROOT)}"


@pytest.mark.parametrize("node", SCHEMAS)
def test_every_parameter_says_what_it_means_and_its_default_is_allowed(node: str) -> None:
    for leaf in leaves(SCHEMAS[node], {}):
        assert leaf.limits.doc, f"{leaf.name} has no meaning"
        assert not leaf.limits.doc.endswith("."), f"the meaning of {leaf.name} is a phrase, not a sentence"
        if leaf.name not in NEEDED:
            assert leaf.check(leaf.default) == leaf.default


@pytest.mark.parametrize("node", SCHEMAS)
def test_a_node_can_be_made_from_what_must_be_given_alone(node: str) -> None:
    names = {leaf.name for leaf in leaves(SCHEMAS[node], {})}
    values: Any = load(SCHEMAS[node], {name: value for name, value in NEEDED.items() if name in names})
    assert set(dump(values)) == names


@pytest.mark.parametrize("node", SCHEMAS)
def test_the_page_has_every_parameter_of_every_node(node: str) -> None:
    text = parameters_page()
    for leaf in leaves(SCHEMAS[node], {"deputies": ["DEPUTY"]}):
        assert f"| `{leaf.name}` | {leaf.type_name} |" in text


def test_the_page_of_topics_names_every_topic_and_every_message() -> None:
    text = (ROOT / "docs/reference/topics.md").read_text()
    names = [topic.name for topic in (*topics.RUN_TOPICS, *topics.DEPUTY_TOPICS)]
    assert len(names) > 10
    for name in names:
        assert f"| `{name}` |" in text
    for message in (ROOT / "msg_defs/msg").glob("*.msg"):
        assert f"[`{message.stem}`](../../msg_defs/msg/{message.name})" in text
