"""Make the virtual environment that holds the ROS 2 wheels a ROS prefix like /opt/ros/jazzy.

The wheels lay out `lib`, `include` and `share` as an installed ROS does, and leave out two things, which this
adds (run with the environment's own Python, as often as wanted): set-up scripts to source, and, in the CMake
export files, the paths of this machine's Python and NumPy in place of the build machine's.
"""

import re
import sys
import sysconfig
from pathlib import Path

import numpy

SETUP = """\
# Written by formation_gnc's tools/ros_prefix.py: makes {prefix} the ROS 2 Jazzy prefix of this shell.
_prepend() {{  # variable, folder: to the front, unless it is in there already
    eval "_old=\\"\\${{$1-}}\\""
    case ":$_old:" in
        *":$2:"*) ;;
        *) eval "export $1=\\"\\$2\\${{_old:+:\\$_old}}\\"" ;;
    esac
    unset _old
}}
{prepends}
unset -f _prepend
export VIRTUAL_ENV="{prefix}"
export ROS_DISTRO=jazzy
export ROS_VERSION=2
export ROS_PYTHON_VERSION=3
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1  # else a .pth file starts every Python twice
"""


def write_setup_scripts(prefix: Path, site_packages: Path) -> None:
    """Write `setup.*` to source by hand, and `local_setup.*`, which is what colcon chains."""
    # The libraries that the wheels bring along lie beside their packages, where their RPATHs do not lead.
    libraries = [*sorted(site_packages.glob("ros_*.libs"), reverse=True), prefix / "lib"]
    variables = [
        *(("LD_LIBRARY_PATH", folder) for folder in libraries),
        ("PATH", prefix / "bin"),
        ("CMAKE_PREFIX_PATH", prefix),
        ("AMENT_PREFIX_PATH", prefix),
    ]
    prepends = "\n".join(f'_prepend {name} "{folder}"' for name, folder in variables)
    text = SETUP.format(prefix=prefix, prepends=prepends)
    for stem in ("setup", "local_setup"):
        for shell in ("sh", "bash", "zsh"):
            (prefix / f"{stem}.{shell}").write_text(text)


def correct_cmake_exports(prefix: Path) -> None:
    """Point the Python message libraries' CMake targets at this Python's and this NumPy's include folders."""
    folders = (
        (r"numpy/_?core/include", numpy.get_include()),
        (r"include/python3\.12", sysconfig.get_path("include")),
    )
    for export in prefix.glob("share/*/cmake/*rosidl_generator_pyExport.cmake"):
        text = old = export.read_text()
        for ending, folder in folders:
            text = re.sub(rf'/opt/python/cp312-cp312/[^;"]*?{ending}', folder, text)
        if "/opt/python" in text:
            sys.exit(f"{export} names a folder of the machine it was built on that is not known here")
        if text != old:
            export.write_text(text)


if __name__ == "__main__":
    prefix = Path(sys.prefix)
    correct_cmake_exports(prefix)
    write_setup_scripts(prefix, Path(sysconfig.get_path("purelib")))
