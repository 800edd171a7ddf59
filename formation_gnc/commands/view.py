"""View a running graph live in Foxglove, or play a bag in it.

Serves the Foxglove WebSocket protocol on this machine: open the printed page in a browser, or connect the app
to the printed address, and import the layout. The graph is that of ROS_DOMAIN_ID, which `formation-gnc sil`
prints. While a bag is played, viewers may pause, seek and change the speed.
"""

import argparse
import signal
from pathlib import Path

from formation_gnc.commands.reading import print_remarks
from formation_gnc.commands.ros import need_ros
from formation_gnc.errors import ConfigurationError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--bag", metavar="DIR", type=Path, help="bag to play instead of a running graph")
    parser.add_argument(
        "--run", dest="run_number", metavar="N", type=int, default=1, help="which, of a bag with several (default: 1)"
    )
    parser.add_argument(
        "--rate",
        metavar="X",
        type=float,
        default=100.0,
        help="initial speed in simulated seconds per wall second (default: 100)",
    )
    parser.add_argument("--port", metavar="N", type=int, default=8765, help="port, 0 for any free one (default: 8765)")
    parser.add_argument("--layout", metavar="FILE", type=Path, help="file to write the layout of the deputies to")


def run(options: argparse.Namespace) -> int:
    """Serve until interrupted."""
    try:
        from formation_gnc.recording.live import LiveView
        from formation_gnc.recording.live_player import LivePlayer
    except ImportError:
        raise ConfigurationError("foxglove-sdk is not installed: pip install foxglove-sdk") from None
    from formation_gnc.recording.reader import Bag

    if not options.bag:
        need_ros("--bag shows a recorded run without")
    player = None
    if options.bag:
        bags = Bag(options.bag).runs()
        if not 1 <= options.run_number <= len(bags):
            raise ConfigurationError(f"run {options.run_number}: {options.bag} has runs 1 to {len(bags)}")
        bag = bags[options.run_number - 1]
        print_remarks([bag])
        player = LivePlayer(bag, options.port, options.layout, options.rate)
    view = player.view if player else LiveView("formation_gnc", options.port, options.layout)
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stopped.append(number))
    print(f"serving {view.address}\nopen: {view.page}", flush=True)
    try:
        if player:
            player.play(lambda: bool(stopped))
        else:
            from formation_gnc.transport.viewer import show_graph

            show_graph(view, lambda: bool(stopped))
    finally:
        view.close()
    return 0
