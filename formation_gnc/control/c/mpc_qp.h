/* The quadratic programme of one plan: least x' P x / 2 + q' x with l <= A x <= u, forces x over the force unit.
 *
 * P and A are those of mpc_data.h; the first rows of A are the forces themselves.
 */
#ifndef MPC_QP_H
#define MPC_QP_H

#include "mpc_data.h"

typedef struct {
  double linear[MPC_FORCES]; /* q */
  double lower[MPC_ROWS];    /* l, finite */
  double upper[MPC_ROWS];    /* u, finite */
  double offset;             /* cost of zero force */
} mpc_qp;

/* Solve; returns the number of iterations, 0 if there is no plan within the certified share of the optimum. */
int mpc_qp_solve(const mpc_qp *qp, double forces[MPC_FORCES]);

/* Solution and multipliers by a primal-dual interior-point method (Mehrotra); iterations, 0 without convergence. */
int mpc_interior_point(const mpc_qp *qp, double point[MPC_FORCES], double multipliers[MPC_ROWS]);

/* P x. */
void mpc_curve(const double point[MPC_FORCES], double result[MPC_FORCES]);

/* A x and A' y. */
void mpc_rows(const double point[MPC_FORCES], double result[MPC_ROWS]);
void mpc_columns(const double multipliers[MPC_ROWS], double result[MPC_FORCES]);

/* Factor L of a positive definite matrix of a size, in its lower triangle in place; 0 if it is none. */
int mpc_factor(double matrix[MPC_FORCES][MPC_FORCES], int size);

/* Solve L L' x = b in place. */
void mpc_substitute(double matrix[MPC_FORCES][MPC_FORCES], int size, double vector[MPC_FORCES]);

#endif
