"""Export of a designed MPC as C: its data, OSQP's generated code, and the law's plan and certificate (`c/`)."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from formation_gnc.common import CommonParameters
from formation_gnc.control import interior_point, plan_solver
from formation_gnc.control.controller import Vehicle
from formation_gnc.control.mpc import MAX_ERROR, ModelPredictiveController, MpcParameters
from formation_gnc.control.mpc_constraints import PlanInputs, ThrustRate
from formation_gnc.errors import DesignError
from formation_gnc.records import NO_NEIGHBOURS, NavigationState, Target
from formation_gnc.types import NANOSECONDS, Matrix

SOURCES = Path(__file__).with_name("c")
"""What is the same for every design."""

PREFIX = "mpc_"
"""Of OSQP's data."""

FAITHFULNESS = 1e-9
"""Largest difference of a command within bounds from the law's, over the limit, that its rounding may make."""

MAX_CONDITION = FAITHFULNESS / np.finfo(float).eps
"""Condition of the QP's Hessian beyond which the order of sums alone makes more."""


def export_mpc(parameters: MpcParameters, common: CommonParameters, vehicle: Vehicle, directory: Path) -> None:
    """Write the MPC as C to a new folder, to be built by its Makefile.

    The commands are those of the law from the same estimates and targets, of which the preview counts if it is on the
    plan's steps, to rounding: gradients are summed in another order. Where the law would fall back on LQR, the code
    says that it has no plan.

    Raises:
        DesignError: as the law's, or the design has something that the C code has not.
        OSError: the folder cannot be written.
    """
    law = ModelPredictiveController(parameters, common, vehicle)
    _check(parameters, law)
    shutil.copytree(SOURCES, directory, dirs_exist_ok=False)
    osqp = directory / "osqp"
    law.solver.workspace.codegen(str(osqp), parameters="matrices", extension_name=None, prefix=PREFIX)
    for example in ("emosqp.c", "Makefile"):
        (osqp / example).unlink()
    constants, arrays = _constants(law, parameters, common, vehicle), _arrays(law, vehicle)
    (directory / "mpc_data.h").write_text(_header(constants, arrays), encoding="utf-8")
    (directory / "mpc_data.c").write_text(_data(arrays), encoding="utf-8")


def _check(parameters: MpcParameters, law: ModelPredictiveController) -> None:
    """Raise DesignError for what the C code has not, or cannot command as the law does."""
    lacking = {
        f"model {parameters.model}, which varies along the orbit": len(law.qps) > 1,
        f"cost {parameters.cost}": parameters.cost != "quadratic",
        f"keep_out_radius {parameters.keep_out_radius:g}": parameters.keep_out_radius > 0.0,
        "off_in_eclipse with thrust_rate": parameters.off_in_eclipse and parameters.thrust_rate > 0.0,
    }
    for what, is_asked in lacking.items():
        if is_asked:
            raise DesignError(
                f"mpc: {what} cannot be exported to C; it must be a time-invariant model with quadratic cost, no "
                "keep-out, and eclipses or a limit on the rate, not both"
            )
    condition = float(np.linalg.cond(_hessian(law)))
    if not condition <= MAX_CONDITION:
        raise DesignError(
            f"mpc: a QP of condition {condition:.1e} cannot be exported to C; it must be at most {MAX_CONDITION:.1e}, "
            f"so that rounding is less than {FAITHFULNESS:g} of the limit: weigh thrust more beside the errors"
        )


def _hessian(law: ModelPredictiveController) -> Matrix:
    """(3 M, 3 M), whole."""
    count = law.solver.count
    half: Matrix = np.zeros((count, count))
    half[np.tril_indices(count)] = law.qps[0].hessian
    return half + np.tril(half, -1).T


def _constants(
    law: ModelPredictiveController, parameters: MpcParameters, common: CommonParameters, vehicle: Vehicle
) -> dict[str, Any]:
    """Numbers of the design, by the names that the C code has for them."""
    qp, rows = law.qps[0], law.solver.matrices[1]
    step = round(parameters.step * NANOSECONDS)
    before = [each.rows()[0].shape[0] for each in law.constraints]
    rate = [index for index, each in enumerate(law.constraints) if isinstance(each, ThrustRate)]
    return {
        "HORIZON": len(qp.transitions),
        "STEPS": law.solver.count // 3,
        "FORCES": law.solver.count,
        "ROWS": rows.shape[0],
        "ELEMENTS": rows.nnz,
        "TICK_NS": common.tick_ns,
        "STEP_NS": step,
        "REPLAN_NS": max(round(parameters.replan_interval * NANOSECONDS), 1),
        "OFF_IN_ECLIPSE": int(parameters.off_in_eclipse),
        "RATE_ROW": sum(before[: rate[0]]) if rate else 0,
        "CHANGE": parameters.thrust_rate * common.tick,
        "TOTAL_THRUST": parameters.total_thrust,
        "UNIT": law.unit,
        "MASS": vehicle.mass,
        "SCALE": qp.scale,
        "MAX_ERROR": MAX_ERROR,
        "ACCURACY": plan_solver.ACCURACY,
        "SECOND_ACCURACY": plan_solver.SECOND_ACCURACY,
        "OPTIMALITY": plan_solver.OPTIMALITY,
        "LEAST_COST": plan_solver.LEAST_COST,
        "FEASIBILITY": plan_solver.FEASIBILITY,
        "IP_ITERATIONS": interior_point.MAX_ITERATIONS,
        "IP_TOLERANCE": interior_point.TOLERANCE,
        "IP_FEASIBLE": interior_point.FEASIBLE,
        "IP_TO_BOUNDARY": interior_point.TO_BOUNDARY,
    }


def _arrays(law: ModelPredictiveController, vehicle: Vehicle) -> dict[str, np.ndarray[Any, Any]]:
    """Matrices and vectors of the design, by the names that the C code has for them."""
    qp = law.qps[0]
    quiet = NavigationState(0, np.zeros(6), np.zeros(6), vehicle.mass)
    target = Target(0, "", np.zeros(6), NANOSECONDS, NO_NEIGHBOURS)
    bounds = [each.bounds(PlanInputs(qp, quiet, target, np.empty((0, 3)))) for each in law.constraints]
    rows = sparse.csr_array(law.solver.matrices[1])
    return {
        "hessian": _hessian(law),
        "gradient": qp.gradient,
        "gradient_of_state": qp.gradient_of_state,
        "cost_of_state": qp.cost_of_state,
        "free": qp.free.reshape(-1, 6, 6),
        "transition": qp.transitions[0],
        "running": qp.weight[0],
        "terminal": qp.weight[-1],
        "limit": law.limit,
        "lower": np.concatenate([each.lower for each in bounds]),
        "upper": np.concatenate([each.upper for each in bounds]),
        "row_start": rows.indptr,
        "row_column": rows.indices,
        "row_value": rows.data,
    }


def _declaration(name: str, array: np.ndarray[Any, Any]) -> str:
    kind = "int" if np.issubdtype(array.dtype, np.integer) else "double"
    return f"const {kind} {PREFIX}{name}{''.join(f'[{size}]' for size in array.shape)}"


def _header(constants: dict[str, Any], arrays: dict[str, np.ndarray[Any, Any]]) -> str:
    """Constants as macros, arrays as declarations."""
    return "\n".join(
        [
            "#ifndef MPC_DATA_H",
            "#define MPC_DATA_H",
            "",
            *(f"#define {PREFIX.upper()}{name} {value!r}" for name, value in constants.items()),
            "",
            *(f"extern {_declaration(name, array)};" for name, array in arrays.items()),
            "",
            "#endif",
            "",
        ]
    )


def _data(arrays: dict[str, np.ndarray[Any, Any]]) -> str:
    """Definitions of the arrays: every number to the last bit."""

    def braced(value: Any) -> str:
        return repr(value) if not isinstance(value, list) else "{" + ",\n".join(braced(each) for each in value) + "}"

    definitions = (f"{_declaration(name, array)} = {braced(array.tolist())};\n" for name, array in arrays.items())
    return '#include "mpc_data.h"\n\n' + "\n".join(definitions)


def input_lines(records: Iterator[tuple[NavigationState, Target]], horizon: int) -> Iterator[str]:
    """What `replay` of an export reads for each tick of a recorded run, with as much of the preview as counts."""
    for estimate, target in records:
        preview = target.preview[:horizon]
        numbers = [
            estimate.time,
            *estimate.relative_state.tolist(),
            estimate.mass,
            *target.relative_state.tolist(),
            target.preview_step,
            len(preview),
            *preview.ravel().tolist(),
            len(target.eclipses),
            *target.eclipses.ravel().tolist(),
        ]
        yield " ".join(map(repr, numbers))
