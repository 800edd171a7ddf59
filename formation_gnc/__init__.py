"""Formation-flying guidance, navigation and control, as a ROS 2 node graph over a pure Python core.

Matrices are small: more threads cost time, and change the last bits of results. One is set before NumPy is loaded,
unless the environment says otherwise.
"""

import os

for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

__version__ = "0.1.0"
