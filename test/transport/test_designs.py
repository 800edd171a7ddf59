"""A flood of changed parameters: a few wait for their designs, and the rest is rejected at once."""

from concurrent.futures import ThreadPoolExecutor
from threading import BoundedSemaphore, Event
from typing import Any

from rcl_interfaces.msg import Parameter
from rcl_interfaces.srv import SetParameters

from formation_gnc.transport.module_node import DESIGNS, _answer_from


class Service:
    """A service of rclpy, whose design takes until it is let go."""

    def __init__(self) -> None:
        self.go, self.sent, self.designed = Event(), list[tuple[Any, Any]](), 0

    def callback(self, request: Any, response: Any) -> Any:
        self.go.wait()
        self.designed += 1
        return response

    def send_response(self, response: Any, header: Any) -> None:
        self.sent.append((header, response))


def test_a_flood_of_designs_is_rejected_beyond_a_few_and_those_are_made() -> None:
    service, pool = Service(), ThreadPoolExecutor(1)
    handle = service.callback
    _answer_from(pool, service, BoundedSemaphore(DESIGNS))  # type: ignore[arg-type]
    assert service.callback is not handle
    for number in range(100):
        request, response = SetParameters.Request(parameters=[Parameter(name="algorithm")]), SetParameters.Response()
        service.send_response(service.callback(request, response), number)
    rejected = dict(service.sent)
    assert rejected.keys() == set(range(DESIGNS, 100))
    assert all("wait for their designs" in response.results[0].reason for response in rejected.values())
    service.go.set()
    pool.shutdown()
    assert service.designed == DESIGNS
    assert len(service.sent) == 100
