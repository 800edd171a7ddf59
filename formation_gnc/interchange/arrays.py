"""Trajectories as arrays: netCDF for xarray and others, and MATLAB's format."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formation_gnc.interchange.ephemeris import Ephemeris

INERTIAL = "inertial: mean equator and equinox of J2000, Earth-centred"
HILL = "Hill: x radial, y along-track, z cross-track, at the chief"


def write_netcdf(satellites: Sequence[Ephemeris], path: Path) -> None:
    """Write variables over (time, satellite, axis), with unit and frame of each, as netCDF 3."""
    from scipy.io import netcdf_file

    first = satellites[0]
    names = [each.name for each in satellites]
    with netcdf_file(path, "w", version=2) as file:
        file.title, file.epoch = path.stem, float(first.epoch)
        file.epoch_meaning = "Terrestrial Time at time zero, s since J2000.0"
        width = max(map(len, names))
        sizes = {"time": len(first.times), "satellite": len(names), "axis": 3, "letter": width}
        for name, size in sizes.items():
            file.createDimension(name, size)
        time = file.createVariable("time", "d", ("time",))
        time[:], time.units, time.long_name = first.times, "s", "time since the start of the run"
        letters = file.createVariable("satellite_name", "c", ("satellite", "letter"))
        letters[:] = np.array([list(name.ljust(width)) for name in names], dtype="S1")
        for name, (values, unit, frame) in _variables(satellites).items():
            variable = file.createVariable(name, "d", ("time", "satellite", "axis"))
            variable[:], variable.units, variable.frame = values, unit, frame


def write_mat(satellites: Sequence[Ephemeris], path: Path) -> None:
    """Write the same variables for MATLAB, with units and frames in structures `units` and `frames`."""
    from scipy.io import savemat

    first, found = satellites[0], _variables(satellites)
    contents: dict[str, Any] = {
        "time": first.times,
        "epoch": first.epoch,
        "satellites": np.array([each.name for each in satellites], dtype=object),
        **{name: values for name, (values, _, _) in found.items()},
        "units": {"time": "s", "epoch": "s of TT since J2000.0"} | {name: unit for name, (_, unit, _) in found.items()},
        "frames": {name: frame for name, (_, _, frame) in found.items()},
    }
    savemat(path, contents, oned_as="column")


def _variables(satellites: Sequence[Ephemeris]) -> dict[str, tuple[NDArray[np.float64], str, str]]:
    """Values (time, satellite, axis), unit and frame by name."""
    states = np.stack([each.states for each in satellites], axis=1)
    relative = np.stack([each.relative for each in satellites], axis=1)
    return {
        "position": (states[:, :, :3], "m", INERTIAL),
        "velocity": (states[:, :, 3:], "m/s", INERTIAL),
        "relative_position": (relative[:, :, :3], "m", HILL),
        "relative_velocity": (relative[:, :, 3:], "m/s", HILL),
    }
