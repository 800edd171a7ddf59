#include "mpc_qp.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "mpc_workspace.h"
#include "osqp.h"

/* Largest violation of a bound beyond the thrust box. */
static double violation(const mpc_qp *qp, const double point[MPC_FORCES]) {
  double values[MPC_ROWS], worst = 0.0;
  mpc_rows(point, values);
  for (int i = MPC_FORCES; i < MPC_ROWS; i++)
    worst = fmax(worst, fmax(qp->lower[i] - values[i], values[i] - qp->upper[i]));
  return worst;
}

/* Whether the cost of a point is close enough to a lower bound on the optimum, from its multipliers. */
static bool is_certified(const mpc_qp *qp, const double point[MPC_FORCES], const double multipliers[MPC_ROWS]) {
  double curve[MPC_FORCES], push[MPC_FORCES], cost = qp->offset, least = qp->offset;
  mpc_curve(point, curve);
  mpc_columns(multipliers, push);
  for (int i = 0; i < MPC_ROWS; i++) least -= multipliers[i] * (multipliers[i] > 0.0 ? qp->upper[i] : qp->lower[i]);
  for (int i = 0; i < MPC_FORCES; i++) {
    cost += point[i] * (0.5 * curve[i] + qp->linear[i]);
    least -= 0.5 * point[i] * curve[i];
    least -= fmax(-qp->lower[i], qp->upper[i]) * fabs(push[i] + qp->linear[i] + curve[i]);
  }
  return cost - least <= MPC_OPTIMALITY * cost + MPC_LEAST_COST;
}

/* Clip to the thrust box; whether that is a solution. */
static bool accept(const mpc_qp *qp, const double point[MPC_FORCES], const double *multipliers, double forces[MPC_FORCES]) {
  for (int i = 0; i < MPC_FORCES; i++) forces[i] = fmin(fmax(point[i], qp->lower[i]), qp->upper[i]);
  return !(violation(qp, forces) > MPC_FEASIBILITY) && is_certified(qp, forces, multipliers);
}

/* The optimum without constraints but those that fix a force at zero, if it violates none. */
static bool within_bounds(const mpc_qp *qp, double forces[MPC_FORCES]) {
  static double factor[MPC_FORCES][MPC_FORCES];
  static int kept[MPC_FORCES], count = -1;
  int own[MPC_FORCES], size = 0;
  double point[MPC_FORCES];
  for (int i = 0; i < MPC_FORCES; i++)
    if (qp->lower[i] < qp->upper[i]) own[size++] = i;
  if (size != count || memcmp(own, kept, size * sizeof *own) != 0) {
    for (int i = 0; i < size; i++)
      for (int j = 0; j < size; j++) factor[i][j] = mpc_hessian[own[i]][own[j]];
    count = mpc_factor(factor, size) ? size : -1;
    memcpy(kept, own, size * sizeof *own);
    if (count < 0) return false;
  }
  for (int i = 0; i < size; i++) point[i] = -qp->linear[own[i]];
  mpc_substitute(factor, size, point);
  memset(forces, 0, MPC_FORCES * sizeof *forces);
  for (int i = 0; i < size; i++) forces[own[i]] = point[i];
  for (int i = 0; i < MPC_FORCES; i++)
    if (forces[i] > qp->upper[i] || forces[i] < qp->lower[i]) return false;
  return !(violation(qp, forces) > 0.0);
}

static void forget(void) {
  static const double zero[MPC_ROWS];
  osqp_warm_start(&mpc_solver, zero, zero);
}

/* One run of OSQP at an accuracy: its iterations if that is a solution, 0 if not, -1 if there is none. */
static int run(const mpc_qp *qp, double accuracy, double forces[MPC_FORCES]) {
  OSQPSettings settings = *mpc_solver.settings;
  settings.eps_abs = settings.eps_rel = accuracy;
  osqp_update_settings(&mpc_solver, &settings);
  osqp_solve(&mpc_solver);
  int status = mpc_solver.info->status_val, iterations = mpc_solver.info->iter;
  const double *point = mpc_solver.solution->x, *multipliers = mpc_solver.solution->y;
  if (status == OSQP_PRIMAL_INFEASIBLE || status == OSQP_DUAL_INFEASIBLE) {
    forget();
    return -1;
  }
  double sum = 0.0;
  for (int i = 0; i < MPC_FORCES; i++) sum += point[i] - point[i];
  for (int i = 0; i < MPC_ROWS; i++) sum += multipliers[i] - multipliers[i];
  if (sum != 0.0) { /* not finite */
    forget();
    return 0;
  }
  return accept(qp, point, multipliers, forces) ? iterations : 0;
}

int mpc_qp_solve(const mpc_qp *qp, double forces[MPC_FORCES]) {
  double point[MPC_FORCES], multipliers[MPC_ROWS];
  if (within_bounds(qp, forces)) return 1;
  osqp_update_data_vec(&mpc_solver, qp->linear, qp->lower, qp->upper);
  int iterations = run(qp, MPC_ACCURACY, forces);
  if (iterations == 0) iterations = run(qp, MPC_SECOND_ACCURACY, forces);
  if (iterations != 0) return iterations > 0 ? iterations : 0;
  iterations = mpc_interior_point(qp, point, multipliers);
  return iterations && accept(qp, point, multipliers, forces) ? iterations : 0;
}
