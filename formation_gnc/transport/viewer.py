"""Shows a running graph live in Foxglove."""

from collections.abc import Callable

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from formation_gnc.flight import topics
from formation_gnc.flight.reception import Information
from formation_gnc.recording.live import LiveView
from formation_gnc.recording.topic_definition import TopicDefinition
from formation_gnc.transport.identified import inbox_of
from formation_gnc.transport.loop import Loop
from formation_gnc.transport.raw_topics import Callback, RawTopics

LOOK_PERIOD = 0.5
"""Wall time (s) between looks for new topics."""


def show_graph(view: LiveView, ended: Callable[[], bool]) -> None:
    """Forward every message of this ROS domain to a view until `ended` returns true."""
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("view", context=context, start_parameter_services=False)
    loop = Loop(node, context=context)

    def open_topic(topic: str, type_name: str, _latched: bool) -> Callback:
        view.add(topic, TopicDefinition.installed(type_name, topics.QUEUE_DEPTH))
        is_clock = topic == topics.CLOCK.name

        def show(data: bytes, about: Information) -> None:
            if is_clock:
                view.broadcast_time(about["stamp"])
            view.show(topic, data, about["stamp"])

        return show

    everything = RawTopics(node, open_topic)
    try:
        while not ended():
            everything.look()
            loop.spin(LOOK_PERIOD)
    finally:
        loop.remove(node)
        inbox_of(node).clear()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
