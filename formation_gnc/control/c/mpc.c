#include "mpc.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "mpc_data.h"
#include "mpc_qp.h"

static double plan[MPC_STEPS][3]; /* N */
static bool is_planned;
static int64_t planned_at;
static double previous[3]; /* N */
static int iterations;

void mpc_reset(const double force[3]) {
  is_planned = false;
  memcpy(previous, force, sizeof previous);
}

int mpc_iterations(void) { return iterations; }

static bool is_dark(int64_t begin, int64_t end, const mpc_input *input) {
  for (int k = 0; k < input->eclipse_count; k++)
    if (begin < input->eclipses[k][1] && end > input->eclipses[k][0]) return true;
  return false;
}

/* Bounds of all rows: the box, closed in eclipse, those that are constant, and changes from the force before. */
static void set_bounds(mpc_qp *qp, const mpc_input *input) {
  memcpy(qp->lower, mpc_lower, sizeof qp->lower);
  memcpy(qp->upper, mpc_upper, sizeof qp->upper);
  for (int k = 0; MPC_OFF_IN_ECLIPSE && k < MPC_STEPS; k++) {
    int64_t begin = input->time + k * MPC_STEP_NS;
    for (int i = 3 * k; is_dark(begin, begin + MPC_STEP_NS, input) && i < 3 * k + 3; i++)
      qp->lower[i] = qp->upper[i] = 0.0;
  }
  for (int i = 0; MPC_RATE_ROW && i < 3; i++) {
    qp->lower[MPC_RATE_ROW + i] += previous[i] / MPC_UNIT;
    qp->upper[MPC_RATE_ROW + i] += previous[i] / MPC_UNIT;
  }
}

static void multiply(const double matrix[6][6], const double vector[6], double result[6]) {
  for (int i = 0; i < 6; i++) {
    result[i] = 0.0;
    for (int j = 0; j < 6; j++) result[i] += matrix[i][j] * vector[j];
  }
}

static double quadratic(const double matrix[6][6], const double vector[6]) {
  double product[6], sum = 0.0;
  multiply(matrix, vector, product);
  for (int i = 0; i < 6; i++) sum += vector[i] * product[i];
  return sum;
}

/* Gradient at zero force and half the cost there, for a target that follows its preview, then free motion. */
static void track(mpc_qp *qp, const mpc_input *input) {
  double cost = 0.0, errors[MPC_HORIZON][6];
  if (input->preview_count == 0 || input->preview_step != MPC_STEP_NS) {
    double error[6];
    for (int i = 0; i < 6; i++) error[i] = input->state[i] - input->target[i];
    for (int i = 0; i < MPC_FORCES; i++) {
      qp->linear[i] = 0.0;
      for (int j = 0; j < 6; j++) qp->linear[i] += mpc_gradient_of_state[i][j] * error[j];
    }
    qp->offset = 0.5 * MPC_SCALE * quadratic(mpc_cost_of_state, error);
    return;
  }
  double goal[6];
  for (int k = 0; k < MPC_HORIZON; k++) {
    if (k < input->preview_count) {
      memcpy(goal, input->preview[k], sizeof goal);
    } else {
      double before[6];
      memcpy(before, goal, sizeof before);
      multiply(mpc_transition, before, goal);
    }
    multiply(mpc_free[k], input->state, errors[k]);
    for (int i = 0; i < 6; i++) errors[k][i] -= goal[i];
    cost += quadratic(k < MPC_HORIZON - 1 ? mpc_running : mpc_terminal, errors[k]);
  }
  for (int i = 0; i < MPC_FORCES; i++) {
    qp->linear[i] = 0.0;
    for (int j = 0; j < 6 * MPC_HORIZON; j++) qp->linear[i] += mpc_gradient[i][j] * errors[j / 6][j % 6];
  }
  qp->offset = 0.5 * MPC_SCALE * cost;
}

static bool make_plan(const mpc_input *input) {
  static mpc_qp qp;
  double forces[MPC_FORCES];
  for (int i = 0; i < 6; i++)
    if (!(fabs(input->state[i] - input->target[i]) < MPC_MAX_ERROR)) return false;
  track(&qp, input);
  set_bounds(&qp, input);
  iterations = mpc_qp_solve(&qp, forces);
  if (iterations == 0) return false;
  for (int i = 0; i < MPC_FORCES; i++) plan[i / 3][i % 3] = MPC_UNIT * forces[i];
  planned_at = input->time;
  return is_planned = true;
}

/* What the constraints leave of a force for this tick. */
static void limit(const mpc_input *input, double force[3]) {
  for (int i = 0; MPC_RATE_ROW && i < 3; i++)
    force[i] = fmin(fmax(force[i], previous[i] - MPC_CHANGE), previous[i] + MPC_CHANGE);
  double size = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
  double share = MPC_TOTAL_THRUST > 0.0 && size > MPC_TOTAL_THRUST ? MPC_TOTAL_THRUST / size : 1.0;
  bool off = MPC_OFF_IN_ECLIPSE && is_dark(input->time, input->time + MPC_TICK_NS, input);
  for (int i = 0; i < 3; i++) {
    force[i] = off ? 0.0 : share * force[i];
    previous[i] = fmin(fmax(force[i], -mpc_limit[i]), mpc_limit[i]);
    force[i] *= input->mass / MPC_MASS;
  }
}

mpc_status mpc_command(const mpc_input *input, double force[3]) {
  mpc_status status = MPC_FOLLOWING;
  if (!is_planned || input->time - planned_at >= MPC_REPLAN_NS) {
    status = make_plan(input) ? MPC_PLANNED : MPC_PREVIOUS;
  }
  int64_t step = (input->time - planned_at) / MPC_STEP_NS;
  bool has_force = is_planned && step < MPC_STEPS;
  for (int i = 0; i < 3; i++) force[i] = has_force ? plan[step][i] : 0.0;
  if (status == MPC_PREVIOUS && !has_force) status = MPC_NO_PLAN;
  limit(input, force);
  return status;
}
