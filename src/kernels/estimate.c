// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Estimates of a pose by the residuals of one sensor, and by those of two.

#include <math.h>
#include <string.h>

#include "arrays.h"
#include "cholesky.h"
#include "equations.h"
#include "kernels.h"
#include "products.h"
#include "se3.h"

typedef double Matrix[UNKNOWNS][UNKNOWNS];

// Add the product of two matrices, times a factor, to a third one.
static void add_square_product(const double *a, const double *b, double factor, Matrix sum) {
  add_product(a, b, UNKNOWNS, UNKNOWNS, UNKNOWNS, factor, *sum);
}

// What a bias of the unknowns with a diagonal covariance, marginalised, multiplies equations by:
// I - A R (I + R A R)^-1 R, R the root of the covariance; NaN where there is none.
static void find_damping(const Matrix information, double weight, const Matrix bias,
                         Matrix damping) {
  double root[UNKNOWNS];
  Matrix factor, gains = {{0.0}}, seen;
  for (int i = 0; i < UNKNOWNS; ++i)
    gains[i][i] = root[i] = sqrt(bias[i][i]);
  for (int i = 0; i < UNKNOWNS; ++i) {
    for (int j = 0; j < UNKNOWNS; ++j) {
      seen[i][j] = weight * information[i][j] * root[j];
      factor[i][j] = (i == j) + root[i] * seen[i][j];
      damping[i][j] = i == j;
    }
  }
  if (factorize(*factor, UNKNOWNS))
    substitute(*factor, UNKNOWNS, *gains, UNKNOWNS);
  else
    gains[0][0] = NAN;
  add_square_product(*seen, *gains, -1.0, damping);
}

// Equations of a pose, and the covariance of their gradient. Their cost is curved by a ratio of
// what the information says.
typedef struct {
  double (*information)[UNKNOWNS], *gradient, (*noise)[UNKNOWNS];
  double curvature;
} Equations;

// Set the equations of residuals with a weight that see the pose with a bias of a covariance,
// which is marginalised.
static void marginalise(const Equations *of, double weight, const Matrix bias, Equations *to) {
  Matrix damping, transposed, gains = {{0.0}};
  find_damping(of->information, weight, bias, damping);
  for (int i = 0; i < UNKNOWNS; ++i) {
    to->gradient[i] = 0.0;
    for (int j = 0; j < UNKNOWNS; ++j) {
      to->gradient[i] += weight * damping[i][j] * of->gradient[j];
      to->information[i][j] = to->noise[i][j] = 0.0;
      transposed[j][i] = damping[i][j];
    }
  }
  add_square_product(*damping, *of->information, weight, to->information);
  add_square_product(*damping, *of->noise, weight * weight, gains);
  add_square_product(*gains, *transposed, 1.0, to->noise);
}

static void add(const Matrix one, const Matrix other, Matrix sum) {
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      sum[i][j] = one[i][j] + other[i][j];
}

// Set the inverse of a matrix, NaN where it is not positive definite.
static void set_inverse(const Matrix matrix, Matrix inverse) {
  if (!invert(*matrix, UNKNOWNS, *inverse))
    for (int i = 0; i < UNKNOWNS; ++i)
      for (int j = 0; j < UNKNOWNS; ++j)
        inverse[i][j] = NAN;
}

static void transpose(const Matrix matrix, Matrix transposed) {
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      transposed[j][i] = matrix[i][j];
}

// Multiply the columns of a matrix by a Cholesky factor with inverse pivots.
static void multiply_down(const Matrix factor, Matrix columns) {
  for (int i = UNKNOWNS - 1; i >= 0; --i) {
    for (int j = 0; j < UNKNOWNS; ++j) {
      columns[i][j] /= factor[i][i];
      for (int k = 0; k < i; ++k)
        columns[i][j] += factor[i][k] * columns[k][j];
    }
  }
}

// Multiply a matrix from both sides by a Cholesky factor or, to undo that, by its inverse.
static void multiply_sides(const Matrix factor, bool by_inverse, Matrix matrix) {
  for (int side = 0; side < 2; ++side) {
    Matrix transposed;
    transpose(matrix, transposed);
    if (by_inverse)
      substitute_down(*factor, UNKNOWNS, *transposed, UNKNOWNS);
    else
      multiply_down(factor, transposed);
    memcpy(matrix, transposed, sizeof(Matrix));
  }
}

// The shape that the covariance of a gradient has in the mean, in units of the information, and
// its share in what is expected.
typedef struct {
  const double (*shape)[UNKNOWNS];
  double share;
} Mean;

// Give a share of the mean shape to the covariance of a gradient, of its own scale; set what it is
// in units of the information, zero where that is not definite.
static void give_shape(const Mean *mean, const Matrix information, Matrix noise, Matrix shown) {
  Matrix factor;
  memcpy(factor, information, sizeof(Matrix));
  memset(shown, 0, sizeof(Matrix));
  if (!factorize(*factor, UNKNOWNS))
    return;
  memcpy(shown, noise, sizeof(Matrix));
  multiply_sides(factor, true, shown);
  double scale = 0.0;
  for (int i = 0; i < UNKNOWNS; ++i)
    scale += shown[i][i] / UNKNOWNS;
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      noise[i][j] = shown[i][j] + mean->share * (scale * mean->shape[i][j] - shown[i][j]);
  multiply_sides(factor, false, noise);
}

// The mean over the unknowns of the covariance of a gradient, as a ratio to the information.
static double mean_effect(const Matrix inverse, const Matrix noise) {
  double effect = 0.0;
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      effect += inverse[i][j] * noise[i][j] / UNKNOWNS;
  return effect;
}

// The estimate of a pose by residuals and a prior.
typedef struct {
  double *error, (*covariance)[UNKNOWNS], (*expected)[UNKNOWNS], (*scatter)[UNKNOWNS];
  double design_effect;
} Estimate;

// Set the covariance of an estimate by the inverse of its information, and that of its gradient.
static void set_covariance(const Matrix inverse, const Matrix noise, const Matrix prior,
                           Matrix covariance) {
  Matrix sum, gains = {{0.0}};
  add(noise, prior, sum);
  add_square_product(*inverse, *sum, 1.0, gains);
  memset(covariance, 0, sizeof(Matrix));
  add_square_product(*gains, *inverse, 1.0, covariance);
}

// Estimate by up to two kinds of residuals, whose blocks are below the numbers given; set their
// equations too. Return false where there is no memory.
static bool estimate(const Kind *kinds, const Py_ssize_t *ends, const Matrix prior,
                     const Mean *mean, Equations *of, Estimate *to) {
  Matrix sum, inverse, with_prior;
  for (int k = 0; k < 2; ++k)
    add_equations(kinds[k].jacobian, kinds[k].values, kinds[k].weights, kinds[k].count,
                  *of->information, of->gradient);
  add(of->information, prior, sum);
  set_inverse(sum, inverse);
  for (int i = 0; i < UNKNOWNS; ++i) {
    to->error[i] = 0.0;
    for (int j = 0; j < UNKNOWNS; ++j)
      to->error[i] += inverse[i][j] * of->gradient[j];
  }
  for (int k = 0; k < 2; ++k)
    if (!add_gradient_noise(&kinds[k], ends[k], to->error, *of->noise))
      return false;
  add(of->noise, prior, with_prior);
  to->design_effect = mean_effect(inverse, with_prior);
  set_covariance(inverse, of->noise, prior, to->covariance);
  give_shape(mean, sum, of->noise, to->scatter);
  set_covariance(inverse, of->noise, prior, to->expected);
  return true;
}

PyObject *kernel_estimate(PyObject *module, PyObject *arguments) {
  PyObject *objects[18];
  double weight;
  Mean mean;
  if (!PyArg_ParseTuple(arguments, "OOOOOOOOOdOOdOOOOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &objects[6], &objects[7],
                        &objects[8], &weight, &objects[9], &objects[10], &mean.share, &objects[11],
                        &objects[12], &objects[13], &objects[14], &objects[15], &objects[16],
                        &objects[17]))
    return NULL;
  const Py_ssize_t size = UNKNOWNS * UNKNOWNS;
  const Py_ssize_t count = row_count(objects[1]), others = row_count(objects[5]);
  const Argument needed[] = {
      {"the jacobian", objects[0], 'd', UNKNOWNS * count, false},
      {"the values", objects[1], 'd', count, false},
      {"the weights", objects[2], 'd', count, false},
      {"the blocks", objects[3], 'q', count, false},
      {"the other jacobian", objects[4], 'd', UNKNOWNS * others, false},
      {"the other values", objects[5], 'd', others, false},
      {"the other weights", objects[6], 'd', others, false},
      {"the other blocks", objects[7], 'q', others, false},
      {"the prior", objects[8], 'd', size, false},
      {"the bias", objects[9], 'd', size, false},
      {"the mean shape", objects[10], 'd', size, false},
      {"the error", objects[11], 'd', UNKNOWNS, true},
      {"the covariance", objects[12], 'd', size, true},
      {"the covariance expected", objects[13], 'd', size, true},
      {"the scatter", objects[14], 'd', size, true},
      {"the marginal information", objects[15], 'd', size, true},
      {"the marginal gradient", objects[16], 'd', UNKNOWNS, true},
      {"the marginal noise", objects[17], 'd', size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Kind kinds[2] = {
      {views[0].buf, views[1].buf, views[2].buf, views[3].buf, count},
      {views[4].buf, views[5].buf, views[6].buf, views[7].buf, others}};
  Matrix information = {{0.0}}, noise = {{0.0}};
  double gradient[UNKNOWNS] = {0.0};
  Equations equations = {information, gradient, noise, 1.0};
  Equations marginal = {views[15].buf, views[16].buf, views[17].buf, 1.0};
  Estimate found = {views[11].buf, views[12].buf, views[13].buf, views[14].buf, 0.0};
  mean.shape = views[10].buf;
  const Py_ssize_t end = end_of_blocks(&kinds[0]);
  const Py_ssize_t ends[2] = {end, end < 0 ? end : end_of_blocks(&kinds[1])};
  bool is_done = ends[1] >= 0;
  if (is_done) {
    Py_BEGIN_ALLOW_THREADS
    is_done = estimate(kinds, ends, views[8].buf, &mean, &equations, &found);
    if (is_done)
      marginalise(&equations, weight, views[9].buf, &marginal);
    Py_END_ALLOW_THREADS
    if (!is_done)
      PyErr_NoMemory();
  }
  close_arrays(&arrays);
  return is_done ? PyFloat_FromDouble(found.design_effect) : NULL;
}

// The pose by both sensors, its covariance, and by how much it follows the second one.
typedef struct {
  double *pose, (*covariance)[UNKNOWNS], (*gain)[UNKNOWNS];
} Joint;

// Raise the covariance of a gradient, in the mean over the unknowns, to a share of the information
// where it is below.
static void raise_to(double share, const Matrix information, const Matrix inverse, Matrix noise) {
  const double shown = mean_effect(inverse, noise);
  for (int i = 0; i < UNKNOWNS && shown < share; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      noise[i][j] += (share - shown) * information[i][j];
}

// Move a pose to the joint estimate by two equations and a prior. The covariance of the gradient
// is at least a share of the information, and that of a bias is added to the one of the pose. No
// cost is curved more than the information says, so the step is by that; noise moves the minimum
// by more.
static void join(const Equations *of, const Matrix prior, double share, const Matrix bias,
                 const double *pose, Joint *to) {
  Matrix information, curved, scatter, with_prior, inverse, moved, gains = {{0.0}};
  add(of[0].information, of[1].information, information);
  add(information, prior, with_prior);
  set_inverse(with_prior, inverse);
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      curved[i][j] = of[0].curvature * of[0].information[i][j] +
                     of[1].curvature * of[1].information[i][j] + prior[i][j];
  set_inverse(curved, moved);
  add(of[0].noise, of[1].noise, scatter);
  raise_to(share, information, inverse, scatter);
  add(scatter, prior, scatter);
  double step[UNKNOWNS] = {0.0};
  for (int i = 0; i < UNKNOWNS; ++i) {
    for (int j = 0; j < UNKNOWNS; ++j) {
      step[i] -= inverse[i][j] * (of[0].gradient[j] + of[1].gradient[j]);
      to->covariance[i][j] = bias[i][j];
      to->gain[i][j] = 0.0;
    }
  }
  perturb(pose, step, to->pose);
  add_square_product(*moved, *scatter, 1.0, gains);
  add_square_product(*gains, *moved, 1.0, to->covariance);
  add_square_product(*inverse, *of[1].information, 1.0, to->gain);
}

PyObject *kernel_joint_estimate(PyObject *module, PyObject *arguments) {
  PyObject *objects[12];
  double curvature, other_curvature, share;
  if (!PyArg_ParseTuple(arguments, "OOOdOOOdOdOOOOO", &objects[0], &objects[1], &objects[2],
                        &curvature, &objects[3], &objects[4], &objects[5], &other_curvature,
                        &objects[6], &share, &objects[7], &objects[8], &objects[9],
                        &objects[10], &objects[11]))
    return NULL;
  const Py_ssize_t size = UNKNOWNS * UNKNOWNS;
  const Argument needed[] = {
      {"the information", objects[0], 'd', size, false},
      {"the gradient", objects[1], 'd', UNKNOWNS, false},
      {"the noise", objects[2], 'd', size, false},
      {"the other information", objects[3], 'd', size, false},
      {"the other gradient", objects[4], 'd', UNKNOWNS, false},
      {"the other noise", objects[5], 'd', size, false},
      {"the prior", objects[6], 'd', size, false},
      {"the bias", objects[7], 'd', size, false},
      {"the pose", objects[8], 'd', 16, false},
      {"the result", objects[9], 'd', 16, true},
      {"the covariance", objects[10], 'd', size, true},
      {"the gain", objects[11], 'd', size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Equations equations[2] = {
      {views[0].buf, views[1].buf, views[2].buf, curvature},
      {views[3].buf, views[4].buf, views[5].buf, other_curvature}};
  Joint joint = {views[9].buf, views[10].buf, views[11].buf};
  join(equations, views[6].buf, share, views[7].buf, views[8].buf, &joint);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
