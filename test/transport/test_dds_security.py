"""Governance and permissions as DDS reads them, of every shipped scenario, against the graph table."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import pytest

from formation_gnc.flight.access import access_by_process
from formation_gnc.flight.graph import GRAPH
from formation_gnc.sil.scenario import load_scenario
from formation_gnc.transport.dds_security import governance, permissions

SCENARIOS = sorted(path.stem for path in Path("params").glob("*.yaml"))
BEGIN = datetime(2026, 11, 28, 12, tzinfo=UTC)
END = BEGIN + timedelta(days=1)


class Grant:
    """A document of permissions, read as the specification has it: the first rule that matches, else the default."""

    def __init__(self, document: bytes) -> None:
        (self.grant,) = ElementTree.fromstring(document).iterfind("permissions/grant")
        self.subject = self.grant.findtext("subject_name")

    def allows(self, kind: str, topic: str, domain: int = 42) -> bool:
        for rule in self.grant:
            if rule.tag in ("allow_rule", "deny_rule") and domain in domains(rule):
                patterns = [each.text or "" for each in rule.iterfind(f"{kind}/topics/topic")]
                if any(fnmatchcase(topic, pattern) for pattern in patterns):
                    return rule.tag == "allow_rule"
        return self.grant.findtext("default") == "ALLOW"


def domains(rule: Element) -> range:
    (span,) = rule.iterfind("domains/id_range")
    return range(int(span.findtext("min") or 0), int(span.findtext("max") or 0) + 1)


def grants(deputies: tuple[str, ...]) -> dict[str, Grant]:
    accesses = access_by_process(deputies)
    return {name: Grant(permissions(name, access, BEGIN, END)) for name, access in accesses.items()}


def expected(deputies: tuple[str, ...]) -> Iterator[tuple[str, str, str]]:
    """By the graph table alone: process, kind and topic."""
    for deputy, row in product(deputies, GRAPH):
        for process in (f"/{deputy}/{row.name}", f"/{deputy}/satellite"):
            for topic in row.gives:
                if len(deputies) > 1 or not topic.fleet_only:
                    yield process, "publish", topic.of(deputy)
            for each in (*row.takes, *row.takes_of_before):
                yield process, "subscribe", each.topic.of(deputy)
            for each, other in product(row.takes_of_others, deputies):
                if other != deputy:
                    yield process, "subscribe", each.topic.of(other)
    for deputy in deputies:
        yield "/plant", "publish", f"/{deputy}/measurement"
        yield "/plant", "subscribe", f"/{deputy}/thrust"
        yield "/display", "subscribe", f"/{deputy}/target"


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_permissions_of_a_scenario_are_those_of_the_graph_table(scenario: str) -> None:
    deputies = load_scenario(scenario).plant.deputies
    wanted, documents = set(expected(deputies)), grants(deputies)
    names = {topic for _, _, topic in wanted}
    flying = [name for name in documents if name not in ("/recorder", "/operator")]  # those hear everything
    for process, kind, topic in product(flying, ("publish", "subscribe"), names):
        assert documents[process].allows(kind, f"rt{topic}") is ((process, kind, topic) in wanted), (process, topic)
    for topic in names:
        for process in ("/recorder", "/operator"):
            assert documents[process].allows("subscribe", f"rt{topic}")
            assert not documents[process].allows("publish", f"rt{topic}")
    assert {name: grant.subject for name, grant in documents.items()} == {name: f"CN={name}" for name in documents}


def test_a_services_requests_and_replies_go_one_way() -> None:
    documents = grants(("one",))
    request, reply = (
        f"{kind[0]}/one/controller/set_parameters{kind[1]}" for kind in (("rq", "Request"), ("rr", "Reply"))
    )
    assert documents["/operator"].allows("publish", request)
    assert documents["/operator"].allows("subscribe", reply)
    assert documents["/one/controller"].allows("subscribe", request)
    assert documents["/one/controller"].allows("publish", reply)
    for name in documents.keys() - {"/operator"}:
        assert not documents[name].allows("publish", request)


def test_what_is_in_no_table_is_denied_in_every_domain() -> None:
    for name, grant in grants(("one",)).items():
        for domain in (0, 42, 232):
            assert not grant.allows("publish", "rt/one/unheard_of", domain), name
            assert grant.allows("publish", "ros_discovery_info", domain)


def test_governance_lets_in_by_identity_and_permission_alone() -> None:
    (rule,) = ElementTree.fromstring(governance()).iterfind("domain_access_rules/domain_rule")
    assert domains(rule) == range(233)
    assert rule.findtext("allow_unauthenticated_participants") == "false"
    assert rule.findtext("enable_join_access_control") == "true"
    (topic,) = rule.iterfind("topic_access_rules/topic_rule")
    assert topic.findtext("topic_expression") == "*"
    for name in ("enable_read_access_control", "enable_write_access_control", "enable_discovery_protection"):
        assert topic.findtext(name) == "true"
    kinds = [each.text for each in rule.iter() if each.tag.endswith("protection_kind")]
    assert len(kinds) == 5
    assert "NONE" not in kinds


def test_permissions_say_from_when_to_when_they_hold() -> None:
    access = access_by_process(["one"])["/plant"]
    grant = Grant(permissions("/plant", access, BEGIN, END)).grant
    assert grant.findtext("validity/not_before") == "2026-11-28T12:00:00"
    assert grant.findtext("validity/not_after") == "2026-11-29T12:00:00"
