/* Reads an input of a tick from each line, writes force (N), status and iterations, and at the end the worst time.
 *
 * A line: time, state (6), mass, target (6), step and rows of the preview, its states, number of eclipses, their times.
 */
#define _POSIX_C_SOURCE 199309L
#include <inttypes.h>
#include <stdio.h>
#include <time.h>

#include "mpc.h"
#include "mpc_data.h"

enum { MOST_ECLIPSES = 1000 };

static int read_numbers(double *values, int count) {
  for (int i = 0; i < count; i++)
    if (scanf("%lf", values + i) != 1) return 0;
  return 1;
}

static int read_input(mpc_input *input) {
  static double preview[MPC_HORIZON][6];
  static int64_t eclipses[MOST_ECLIPSES][2];
  if (scanf("%" SCNd64, &input->time) != 1 || !read_numbers(input->state, 6) || !read_numbers(&input->mass, 1) ||
      !read_numbers(input->target, 6) || scanf("%" SCNd64 "%d", &input->preview_step, &input->preview_count) != 2 ||
      input->preview_count > MPC_HORIZON || !read_numbers(preview[0], 6 * input->preview_count) ||
      scanf("%d", &input->eclipse_count) != 1 || input->eclipse_count > MOST_ECLIPSES)
    return 0;
  for (int i = 0; i < input->eclipse_count; i++)
    if (scanf("%" SCNd64 "%" SCNd64, &eclipses[i][0], &eclipses[i][1]) != 2) return 0;
  input->preview = (const double(*)[6])preview;
  input->eclipses = (const int64_t(*)[2])eclipses;
  return 1;
}

static double now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return 1e6 * (double)time.tv_sec + 1e-3 * (double)time.tv_nsec;
}

int main(void) {
  mpc_input input;
  double force[3] = {0.0, 0.0, 0.0}, worst = 0.0;
  int ticks = 0;
  mpc_reset(force);
  for (; read_input(&input); ticks++) {
    double begin = now();
    mpc_status status = mpc_command(&input, force);
    double spent = now() - begin;
    worst = spent > worst ? spent : worst;
    printf("%.17g %.17g %.17g %d %d\n", force[0], force[1], force[2], status, mpc_iterations());
  }
  fprintf(stderr, "%d ticks, worst time %.1f us\n", ticks, worst);
  return feof(stdin) ? 0 : 1;
}
