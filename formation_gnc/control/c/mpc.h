/* Model predictive control of a deputy: the law `mpc` of formation_gnc, as designed for one scenario (mpc_data.h).
 *
 * The plans and commands are those of formation_gnc/control/mpc.py: exact within the bounds, else OSQP from the plan
 * before, else an interior-point method, each with a certificate. One instance, no allocation, bounded iterations.
 * SI units; Hill frame: x radial outwards, y along-track, z along the orbit normal; times in ns.
 */
#ifndef MPC_H
#define MPC_H

#include <stdint.h>

typedef enum {
  MPC_FOLLOWING, /* the plan in force */
  MPC_PLANNED,   /* a new plan */
  MPC_PREVIOUS,  /* no new plan: the one before continues */
  MPC_NO_PLAN    /* nor any before: no thrust, the caller needs another law */
} mpc_status;

typedef struct {
  int64_t time;
  double state[6]; /* relative to the chief */
  double mass;
  double target[6];
  int64_t preview_step;
  int preview_count; /* rows of the preview, of which the horizon is used */
  const double (*preview)[6];
  int eclipse_count;
  const int64_t (*eclipses)[2]; /* begin and end */
} mpc_input;

/* Forget the plan; the force is the one commanded before, N. */
void mpc_reset(const double force[3]);

/* Force for the tick that begins at the input's time, N, before the thrust limit per axis. */
mpc_status mpc_command(const mpc_input *input, double force[3]);

/* How the last plan was found: 1 if within all bounds, else iterations of the solver that found it. */
int mpc_iterations(void);

#endif
