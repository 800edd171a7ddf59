"""The ROS shell: records to and from bytes, topics, processes.

Nodes meet those of this machine alone, unless the environment says otherwise: anybody on a shared network could fly
along (docs/security.md). They do so over UDP, not through Fast DDS's shared memory, in which a process that is killed
can cut others off from one another (docs/decisions/0030-udp-instead-of-shared-memory.md).
"""

import os

MIDDLEWARE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
"""Variables of the middleware where the environment has none of its own."""

for _name, _value in MIDDLEWARE.items():
    os.environ.setdefault(_name, _value)
