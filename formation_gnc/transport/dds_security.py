"""Governance and permissions of DDS security as XML (OMG DDS-SECURITY 1.1, 9.4.1), from who may do what on a graph.

Names are those that ROS 2 gives its topics in DDS: `rt` before a topic, `rq` and `rr` before a service's requests and
replies.
"""

from collections.abc import Iterable
from datetime import datetime
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from formation_gnc.flight.access import Access

LAST_DOMAIN = 232
"""Largest ROS domain."""

SCHEMA = "http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_{}.xsd"

DISCOVERY = "ros_discovery_info"
"""DDS topic by which ROS nodes know of each other."""

OF_ROS = ("/rosout", "/parameter_events")
"""Topics that every node of rclpy publishes."""

CLOCK = "/clock"
"""What a node with `use_sim_time` subscribes to."""

TOPIC_RULE = {
    "topic_expression": "*",
    "enable_discovery_protection": "true",
    "enable_liveliness_protection": "true",
    "enable_read_access_control": "true",
    "enable_write_access_control": "true",
    "metadata_protection_kind": "ENCRYPT",
    "data_protection_kind": "ENCRYPT",
}
DOMAIN_RULE = {
    "allow_unauthenticated_participants": "false",
    "enable_join_access_control": "true",
    "discovery_protection_kind": "ENCRYPT",
    "liveliness_protection_kind": "ENCRYPT",
    "rtps_protection_kind": "SIGN",
}
"""Nobody without a signed identity, nothing that a permission does not allow: the kinds of protection of sros2."""


def published(access: Access) -> frozenset[str]:
    """DDS names of all that a process writes."""
    topics = {f"rt{name}" for name in (*access.publishes, *OF_ROS)}
    replies = {f"rr{name}Reply" for name in access.serves}
    return frozenset(topics | replies | {f"rq{name}Request" for name in access.calls} | {DISCOVERY})


def subscribed(access: Access) -> frozenset[str]:
    """DDS names of all that a process reads."""
    topics = {f"rt{name}" for name in (*access.subscribes, CLOCK)}
    requests = {f"rq{name}Request" for name in access.serves}
    return frozenset(topics | requests | {f"rr{name}Reply" for name in access.calls} | {DISCOVERY})


def governance() -> bytes:
    """The governance of a flight's domain, whichever it is."""
    root = _document("governance")
    rule = SubElement(SubElement(root, "domain_access_rules"), "domain_rule")
    _add_domains(rule)
    _add(rule, DOMAIN_RULE)
    _add(SubElement(SubElement(rule, "topic_access_rules"), "topic_rule"), TOPIC_RULE)
    return _text(root)


def permissions(enclave: str, access: Access, begin: datetime, end: datetime) -> bytes:
    """The permissions of an enclave, from and to times in UTC; what they do not allow is denied."""
    root = _document("permissions")
    grant = SubElement(SubElement(root, "permissions"), "grant", name=enclave)
    times = {"not_before": begin, "not_after": end}
    _add(grant, {"subject_name": f"CN={enclave}"})
    _add(SubElement(grant, "validity"), {name: f"{time:%Y-%m-%dT%H:%M:%S}" for name, time in times.items()})
    rule = SubElement(grant, "allow_rule")
    _add_domains(rule)
    for kind, names in (("publish", published(access)), ("subscribe", subscribed(access))):
        _add_topics(SubElement(SubElement(rule, kind), "topics"), names)
    _add(grant, {"default": "DENY"})
    return _text(root)


def _document(kind: str) -> Element:
    schema = "{http://www.w3.org/2001/XMLSchema-instance}noNamespaceSchemaLocation"
    return Element("dds", {schema: SCHEMA.format(kind)})


def _add(parent: Element, texts: dict[str, str]) -> None:
    for name, text in texts.items():
        SubElement(parent, name).text = text


def _add_topics(parent: Element, names: Iterable[str]) -> None:
    for name in sorted(names):
        SubElement(parent, "topic").text = name


def _add_domains(parent: Element) -> None:
    span = SubElement(SubElement(parent, "domains"), "id_range")
    _add(span, {"min": "0", "max": str(LAST_DOMAIN)})


def _text(root: Element) -> bytes:
    ElementTree.register_namespace("xsi", "http://www.w3.org/2001/XMLSchema-instance")
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))
