#include <math.h>

#include "mpc_qp.h"

void mpc_curve(const double point[MPC_FORCES], double result[MPC_FORCES]) {
  for (int i = 0; i < MPC_FORCES; i++) {
    result[i] = 0.0;
    for (int j = 0; j < MPC_FORCES; j++) result[i] += mpc_hessian[i][j] * point[j];
  }
}

void mpc_rows(const double point[MPC_FORCES], double result[MPC_ROWS]) {
  for (int i = 0; i < MPC_ROWS; i++) {
    result[i] = 0.0;
    for (int k = mpc_row_start[i]; k < mpc_row_start[i + 1]; k++) result[i] += mpc_row_value[k] * point[mpc_row_column[k]];
  }
}

void mpc_columns(const double multipliers[MPC_ROWS], double result[MPC_FORCES]) {
  for (int j = 0; j < MPC_FORCES; j++) result[j] = 0.0;
  for (int i = 0; i < MPC_ROWS; i++)
    for (int k = mpc_row_start[i]; k < mpc_row_start[i + 1]; k++)
      result[mpc_row_column[k]] += mpc_row_value[k] * multipliers[i];
}

int mpc_factor(double matrix[MPC_FORCES][MPC_FORCES], int size) {
  for (int j = 0; j < size; j++) {
    for (int i = j; i < size; i++) {
      double sum = matrix[i][j];
      for (int k = 0; k < j; k++) sum -= matrix[i][k] * matrix[j][k];
      if (i > j)
        matrix[i][j] = sum / matrix[j][j];
      else if (!(sum > 0.0))
        return 0;
      else
        matrix[j][j] = sqrt(sum);
    }
  }
  return 1;
}

void mpc_substitute(double matrix[MPC_FORCES][MPC_FORCES], int size, double vector[MPC_FORCES]) {
  for (int i = 0; i < size; i++) {
    for (int k = 0; k < i; k++) vector[i] -= matrix[i][k] * vector[k];
    vector[i] /= matrix[i][i];
  }
  for (int i = size - 1; i >= 0; i--) {
    for (int k = i + 1; k < size; k++) vector[i] -= matrix[k][i] * vector[k];
    vector[i] /= matrix[i][i];
  }
}
