#include <float.h>
#include <math.h>
#include <string.h>

#include "mpc_qp.h"

enum { LIMITS = 2 * MPC_ROWS }; /* G x + t = h: the rows below their upper bounds, then above their lower ones */

typedef struct {
  double slope[MPC_FORCES], missing[LIMITS], distance[LIMITS], multiplier[LIMITS];
  double normal[MPC_FORCES][MPC_FORCES];
} newton;

typedef struct {
  double move[MPC_FORCES], far[LIMITS], more[LIMITS];
} direction;

static void below_and_above(const double point[MPC_FORCES], double result[LIMITS]) {
  mpc_rows(point, result);
  for (int i = 0; i < MPC_ROWS; i++) result[MPC_ROWS + i] = -result[i];
}

/* G' m, through the difference of both multipliers. */
static void gathered(const double multiplier[LIMITS], double result[MPC_FORCES]) {
  double net[MPC_ROWS];
  for (int i = 0; i < MPC_ROWS; i++) net[i] = multiplier[i] - multiplier[MPC_ROWS + i];
  mpc_columns(net, result);
}

/* Factorise P + G' diag(multiplier / distance) G. */
static int factorise(newton *at) {
  memcpy(at->normal, mpc_hessian, sizeof at->normal);
  for (int i = 0; i < MPC_ROWS; i++) {
    double weight = at->multiplier[i] / at->distance[i] + at->multiplier[MPC_ROWS + i] / at->distance[MPC_ROWS + i];
    for (int k = mpc_row_start[i]; k < mpc_row_start[i + 1]; k++)
      for (int l = mpc_row_start[i]; l < mpc_row_start[i + 1]; l++)
        at->normal[mpc_row_column[k]][mpc_row_column[l]] += weight * mpc_row_value[k] * mpc_row_value[l];
  }
  return mpc_factor(at->normal, MPC_FORCES);
}

/* The direction for a complementarity to remove. */
static void head_for(newton *at, const double complementarity[LIMITS], direction *to) {
  double push[LIMITS];
  for (int i = 0; i < LIMITS; i++)
    push[i] = (at->multiplier[i] * at->missing[i] - complementarity[i]) / at->distance[i];
  gathered(push, to->move);
  for (int i = 0; i < MPC_FORCES; i++) to->move[i] = -at->slope[i] - to->move[i];
  mpc_substitute(at->normal, MPC_FORCES, to->move);
  below_and_above(to->move, to->far);
  for (int i = 0; i < LIMITS; i++) {
    to->far[i] = -at->missing[i] - to->far[i];
    to->more[i] = -(complementarity[i] + at->multiplier[i] * to->far[i]) / at->distance[i];
  }
}

/* Longest step, at most `most`, that keeps positive values positive. */
static double longest(const double value[LIMITS], const double change[LIMITS], double most) {
  for (int i = 0; i < LIMITS; i++)
    if (change[i] < 0.0) most = fmin(most, -value[i] / change[i]);
  return most;
}

static void begin(const mpc_qp *qp, newton *at, double point[MPC_FORCES], double limit[LIMITS]) {
  double largest = 1.0;
  for (int i = 0; i < MPC_FORCES; i++) {
    point[i] = 0.0;
    largest = fmax(largest, fabs(qp->linear[i]));
  }
  for (int i = 0; i < MPC_ROWS; i++) { /* the method needs an interior */
    double middle = 0.5 * (qp->lower[i] + qp->upper[i]);
    int narrow = qp->upper[i] - qp->lower[i] < 2.0 * MPC_IP_FEASIBLE;
    limit[i] = narrow ? middle + MPC_IP_FEASIBLE : qp->upper[i];
    limit[MPC_ROWS + i] = narrow ? MPC_IP_FEASIBLE - middle : -qp->lower[i];
  }
  for (int i = 0; i < LIMITS; i++) {
    at->distance[i] = fmax(limit[i], 1.0);
    at->multiplier[i] = largest;
  }
}

/* Residuals at a point; returns whether they are small enough. */
static int is_solved(const mpc_qp *qp, newton *at, const double point[MPC_FORCES], const double limit[LIMITS]) {
  double curve[MPC_FORCES], cost = qp->offset, slope = 0.0, missing = 0.0, gap = 0.0;
  mpc_curve(point, curve);
  gathered(at->multiplier, at->slope);
  below_and_above(point, at->missing);
  for (int i = 0; i < MPC_FORCES; i++) {
    cost += point[i] * (0.5 * curve[i] + qp->linear[i]);
    at->slope[i] += curve[i] + qp->linear[i];
    slope += fabs(at->slope[i]);
  }
  for (int i = 0; i < LIMITS; i++) {
    at->missing[i] += at->distance[i] - limit[i];
    missing = fmax(missing, fabs(at->missing[i]));
    gap += at->distance[i] * at->multiplier[i];
  }
  double allowed = MPC_IP_TOLERANCE * fabs(cost) + DBL_EPSILON;
  return gap <= allowed && missing <= MPC_IP_FEASIBLE && slope <= allowed;
}

/* Predict to no complementarity, then correct towards the centre. */
static void advance(newton *at, double point[MPC_FORCES]) {
  static direction to;
  double wanted[LIMITS], gap = 0.0, reached = 0.0;
  for (int i = 0; i < LIMITS; i++) {
    wanted[i] = at->distance[i] * at->multiplier[i];
    gap += wanted[i];
  }
  head_for(at, wanted, &to);
  double far = longest(at->distance, to.far, 1.0), more = longest(at->multiplier, to.more, 1.0);
  for (int i = 0; i < LIMITS; i++)
    reached += (at->distance[i] + far * to.far[i]) * (at->multiplier[i] + more * to.more[i]);
  double centre = pow(reached / gap, 3.0) * gap / LIMITS;
  for (int i = 0; i < LIMITS; i++) wanted[i] += to.far[i] * to.more[i] - centre;
  head_for(at, wanted, &to);
  double most = longest(at->multiplier, to.more, longest(at->distance, to.far, INFINITY));
  double share = fmin(1.0, MPC_IP_TO_BOUNDARY * most);
  for (int i = 0; i < MPC_FORCES; i++) point[i] += share * to.move[i];
  for (int i = 0; i < LIMITS; i++) {
    at->distance[i] += share * to.far[i];
    at->multiplier[i] += share * to.more[i];
  }
}

int mpc_interior_point(const mpc_qp *qp, double point[MPC_FORCES], double multipliers[MPC_ROWS]) {
  static newton at;
  double limit[LIMITS];
  begin(qp, &at, point, limit);
  for (int iteration = 0; iteration < MPC_IP_ITERATIONS; iteration++) {
    if (is_solved(qp, &at, point, limit)) {
      for (int i = 0; i < MPC_ROWS; i++) multipliers[i] = at.multiplier[i] - at.multiplier[MPC_ROWS + i];
      return iteration;
    }
    if (!factorise(&at)) return 0;
    advance(&at, point);
  }
  return 0;
}
