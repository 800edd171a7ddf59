"""Parameters of the recorder."""

from dataclasses import dataclass

from formation_gnc.common import CommonParameters
from formation_gnc.parameters import parameter


@dataclass(frozen=True)
class RecorderParameters(CommonParameters):
    """Parameters of the recorder node."""

    bag: str = parameter("", doc="directory to make for the bag; empty for bags/ and the date and time")
    split_size: int = parameter(
        0, unit="B", minimum=0, doc="messages on disk after which the bag goes on in a next file; 0 for never"
    )
    split_duration: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        doc="simulated time after which the bag goes on in a next file; 0 for never",
    )
    snapshot: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        doc="record nothing but, whenever the service ~/snapshot is called, this much simulated time up to "
        "then; 0 for recording everything",
    )
