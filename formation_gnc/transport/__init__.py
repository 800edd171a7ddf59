"""The ROS shell: records to and from bytes, topics, processes.

Nodes meet those of this machine alone, unless the environment says otherwise: anybody on a shared network could fly
along (docs/security.md).
"""

import os

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
