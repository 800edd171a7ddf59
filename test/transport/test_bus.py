"""The intra-process bus."""

from formation_gnc.transport.bus import IntraProcessBus


def test_bus_delivers_in_order_to_the_latest_subscriber_first() -> None:
    bus, received = IntraProcessBus(), list[tuple[str, int]]()
    bus.advertise("estimate")
    bus.subscribe("estimate", lambda record: received.append(("guidance", record)))
    bus.subscribe("estimate", lambda record: received.append(("controller", record)))
    assert "estimate" in bus
    assert "target" not in bus
    bus.publish("estimate", 1)
    bus.publish("estimate", 2)
    assert received == []
    bus.deliver()
    assert received == [("controller", 1), ("guidance", 1), ("controller", 2), ("guidance", 2)]
