// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Rotations, poses and the covariances of their errors; poses are 4x4, row by row.

#include "se3.h"

#include <math.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "processors.h"
#include "vectors.h"

static const double SMALL_ANGLE = 1e-4;  // rad; derived: the next terms are below the rounding
static const double MAX_SKEW = 1e-4;     // of R R^T; chosen: a rotation written with five digits
static const double FARTHEST = 1e100;    // m; derived: its square stays finite

static double length_of(const double *v) { return hypot(hypot(v[0], v[1]), v[2]); }

static double sinc(double angle) { return angle != 0.0 ? sin(angle) / angle : 1.0; }

// I + first K + second K^2, K the matrix of the cross product with a vector, 3x3.
static void polynomial(const double *v, double first, double second, double *matrix) {
  const double x = v[0], y = v[1], z = v[2];
  const double xx = second * x * x, yy = second * y * y, zz = second * z * z;
  const double xy = second * x * y, xz = second * x * z, yz = second * y * z;
  matrix[0] = 1.0 - yy - zz;
  matrix[1] = xy - first * z;
  matrix[2] = xz + first * y;
  matrix[3] = xy + first * z;
  matrix[4] = 1.0 - xx - zz;
  matrix[5] = yz - first * x;
  matrix[6] = xz - first * y;
  matrix[7] = yz + first * x;
  matrix[8] = 1.0 - xx - yy;
}

// (1 - cos(a)) / a^2 in a form that is accurate down to zero.
static double versine(double angle) {
  const double half = sinc(0.5 * angle);
  return 0.5 * half * half;
}

void exp_rotation(const double *theta, double *rotation) {
  const double angle = length_of(theta);
  polynomial(theta, sinc(angle), versine(angle), rotation);
}

static void left_jacobian(const double *theta, double *jacobian) {
  const double angle = length_of(theta);
  const double third =
      angle < SMALL_ANGLE ? 1.0 / 6.0 : (1.0 - sinc(angle)) / (angle * angle);
  polynomial(theta, versine(angle), third, jacobian);
}

static void inverse_left_jacobian(const double *theta, double *jacobian) {
  const double angle = length_of(theta);
  const double twelfth = angle < SMALL_ANGLE
                             ? 1.0 / 12.0
                             : (1.0 - 0.5 * angle / tan(0.5 * angle)) / (angle * angle);
  polynomial(theta, -0.5, twelfth, jacobian);
}

// The unit quaternion (x, y, z, w), w >= 0 (Shepperd 1978).
static void to_quaternion(const double *r, double *q) {
  const double trace = r[0] + r[4] + r[8];
  const double diagonal[4] = {r[0], r[4], r[8], trace};
  int largest = 0;
  for (int i = 1; i < 4; ++i)
    largest = diagonal[i] > diagonal[largest] ? i : largest;
  if (largest == 3) {
    q[0] = r[7] - r[5];
    q[1] = r[2] - r[6];
    q[2] = r[3] - r[1];
    q[3] = 1.0 + trace;
  } else {
    const int i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1.0 + 2.0 * r[4 * i] - trace;
    q[j] = r[3 * j + i] + r[3 * i + j];
    q[k] = r[3 * k + i] + r[3 * i + k];
    q[3] = r[3 * k + j] - r[3 * j + k];
  }
  const double norm = copysign(hypot(length_of(q), q[3]), q[3]);
  for (int i = 0; i < 4; ++i)
    q[i] /= norm;
}

void log_rotation(const double *rotation, double *theta) {
  double q[4];
  to_quaternion(rotation, q);
  const double sine = length_of(q);
  const double factor = sine == 0.0 ? 0.0 : 2.0 * atan2(sine, q[3]) / sine;
  for (int i = 0; i < 3; ++i)
    theta[i] = q[i] * factor;
}

static void rotated(const double *rotation, const double *v, double *result) {
  for (int i = 0; i < 3; ++i)
    result[i] = rotation[3 * i] * v[0] + rotation[3 * i + 1] * v[1] + rotation[3 * i + 2] * v[2];
}

void multiply(const double *a, const double *b, double *product) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      product[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

static void rotation_of(const double *pose, double *rotation) {
  for (int i = 0; i < 9; ++i)
    rotation[i] = pose[4 * (i / 3) + i % 3];
}

static void fill_pose(const double *rotation, const double *position, double *pose) {
  for (int i = 0; i < 3; ++i) {
    memcpy(pose + 4 * i, rotation + 3 * i, 3 * sizeof(*pose));
    pose[4 * i + 3] = position[i];
  }
  pose[12] = pose[13] = pose[14] = 0.0;
  pose[15] = 1.0;
}

// Call a function of one array that fills another one.
static PyObject *filled(PyObject *arguments, const char *name, Py_ssize_t size, Py_ssize_t found,
                        void (*function)(const double *, double *)) {
  PyObject *given, *result;
  if (!PyArg_ParseTuple(arguments, "OO", &given, &result))
    return NULL;
  const Argument needed[] = {{name, given, 'd', size, false},
                             {"the result", result, 'd', found, true}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  function(arrays.views[0].buf, arrays.views[1].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_exp_rotation(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the rotation vector", 3, 9, exp_rotation);
}

PyObject *kernel_log_rotation(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the rotation", 9, 3, log_rotation);
}

PyObject *kernel_to_quaternion(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the rotation", 9, 4, to_quaternion);
}

void exp_pose(const double *twist, double *pose) {
  double rotation[9], jacobian[9], position[3];
  exp_rotation(twist + 3, rotation);
  left_jacobian(twist + 3, jacobian);
  rotated(jacobian, twist, position);
  fill_pose(rotation, position, pose);
}

PyObject *kernel_exp_pose(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the twist", 6, 16, exp_pose);
}

void log_pose(const double *pose, double *twist) {
  double rotation[9], jacobian[9];
  const double position[3] = {pose[3], pose[7], pose[11]};
  rotation_of(pose, rotation);
  log_rotation(rotation, twist + 3);
  inverse_left_jacobian(twist + 3, jacobian);
  rotated(jacobian, position, twist);
}

PyObject *kernel_log_pose(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the pose", 16, 6, log_pose);
}

static void inverse_pose(const double *pose, double *inverse) {
  double rotation[9], position[3];
  const double shift[3] = {-pose[3], -pose[7], -pose[11]};
  for (int i = 0; i < 9; ++i)
    rotation[i] = pose[4 * (i % 3) + i / 3];
  rotated(rotation, shift, position);
  fill_pose(rotation, position, inverse);
}

PyObject *kernel_inverse_pose(PyObject *module, PyObject *arguments) {
  return filled(arguments, "the pose", 16, 16, inverse_pose);
}

void perturb(const double *pose, const double *error, double *perturbed) {
  double turn[9], before[9], rotation[9], transposed[9], square[9], corrected[9], position[3];
  exp_rotation(error + 3, turn);
  rotation_of(pose, before);
  multiply(turn, before, rotation);
  for (int i = 0; i < 9; ++i)
    transposed[i] = rotation[3 * (i % 3) + i / 3];
  multiply(transposed, rotation, square);
  multiply(rotation, square, corrected);
  for (int i = 0; i < 9; ++i)
    corrected[i] = 1.5 * rotation[i] - 0.5 * corrected[i];
  for (int i = 0; i < 3; ++i)
    position[i] = pose[4 * i + 3] + error[i];
  fill_pose(corrected, position, perturbed);
}

PyObject *kernel_perturbed_pose(PyObject *module, PyObject *arguments) {
  PyObject *pose_array, *error_array, *result_array;
  if (!PyArg_ParseTuple(arguments, "OOO", &pose_array, &error_array, &result_array))
    return NULL;
  const Argument needed[] = {{"the pose", pose_array, 'd', 16, false},
                             {"the error", error_array, 'd', 6, false},
                             {"the result", result_array, 'd', 16, true}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  perturb(arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_pose_difference(PyObject *module, PyObject *arguments) {
  PyObject *pose_array, *reference_array, *error_array;
  if (!PyArg_ParseTuple(arguments, "OOO", &pose_array, &reference_array, &error_array))
    return NULL;
  const Argument needed[] = {{"the pose", pose_array, 'd', 16, false},
                             {"the reference", reference_array, 'd', 16, false},
                             {"the error", error_array, 'd', 6, true}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *pose = arrays.views[0].buf, *reference = arrays.views[1].buf;
  double *error = arrays.views[2].buf, rotation[9], back[9], turn[9];
  rotation_of(pose, rotation);
  for (int i = 0; i < 9; ++i)
    back[i] = reference[4 * (i % 3) + i / 3];
  multiply(rotation, back, turn);
  log_rotation(turn, error + 3);
  for (int i = 0; i < 3; ++i)
    error[i] = pose[4 * i + 3] - reference[4 * i + 3];
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

static double row_product(const double *pose, int one, int other) {
  return pose[4 * one] * pose[4 * other] + pose[4 * one + 1] * pose[4 * other + 1] +
         pose[4 * one + 2] * pose[4 * other + 2];
}

// Comparisons with NaN are false.
static bool is_rigid(const double *p) {
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j)
      if (!(fabs(row_product(p, i, j) - (i == j)) <= MAX_SKEW))
        return false;
    if (!(fabs(p[4 * i + 3]) <= FARTHEST))
      return false;
  }
  const double determinant = p[0] * (p[5] * p[10] - p[6] * p[9]) -
                             p[1] * (p[4] * p[10] - p[6] * p[8]) +
                             p[2] * (p[4] * p[9] - p[5] * p[8]);
  return determinant > 0.0 && p[12] == 0.0 && p[13] == 0.0 && p[14] == 0.0 && p[15] == 1.0;
}

PyObject *kernel_is_rigid(PyObject *module, PyObject *arguments) {
  PyObject *pose_array;
  if (!PyArg_ParseTuple(arguments, "O", &pose_array))
    return NULL;
  const Argument needed[] = {{"the pose", pose_array, 'd', 16, false}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const bool found = is_rigid(arrays.views[0].buf);
  close_arrays(&arrays);
  return PyBool_FromLong(found);
}

void add_propagated(double m[6][6], const double *covariance, double *sum) {
  double left[6][6];
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      left[i][j] = 0.0;
      for (int k = 0; k < 6; ++k)
        left[i][j] += m[i][k] * covariance[6 * k + j];
    }
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k)
        sum[6 * i + j] += left[i][k] * m[j][k];
}

void fill_lever(const double *arm, double lever[6][6]) {
  const double turn[3][3] = {{0, arm[2], -arm[1]}, {-arm[2], 0, arm[0]}, {arm[1], -arm[0], 0}};
  memset(lever, 0, 36 * sizeof(**lever));
  for (int i = 0; i < 6; ++i)
    lever[i][i] = 1.0;
  for (int i = 0; i < 3; ++i)
    memcpy(lever[i] + 3, turn[i], sizeof(turn[i]));
}

void fill_axes(const double *rotation, double axes[6][6]) {
  memset(axes, 0, 36 * sizeof(**axes));
  for (int i = 0; i < 9; ++i)
    axes[i / 3][i % 3] = axes[3 + i / 3][3 + i % 3] = rotation[i];
}

static void compose(const double *one, const double *its_covariance, const double *other,
                    const double *other_covariance, double *pose, double *covariance) {
  double a[9], b[9], rotation[9], arm[3], position[3], lever[6][6], axes[6][6];
  const double shift[3] = {other[3], other[7], other[11]};
  rotation_of(one, a);
  rotation_of(other, b);
  multiply(a, b, rotation);
  rotated(a, shift, arm);
  for (int i = 0; i < 3; ++i)
    position[i] = arm[i] + one[4 * i + 3];
  fill_pose(rotation, position, pose);
  fill_lever(arm, lever);
  fill_axes(a, axes);
  memset(covariance, 0, 36 * sizeof(*covariance));
  add_propagated(lever, its_covariance, covariance);
  add_propagated(axes, other_covariance, covariance);
}

PyObject *kernel_composed_poses(PyObject *module, PyObject *arguments) {
  PyObject *objects[6];
  if (!PyArg_ParseTuple(arguments, "OOOOOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4], &objects[5]))
    return NULL;
  const Argument needed[] = {
      {"the pose", objects[0], 'd', 16, false},
      {"the covariance", objects[1], 'd', 36, false},
      {"the other pose", objects[2], 'd', 16, false},
      {"its covariance", objects[3], 'd', 36, false},
      {"the composed pose", objects[4], 'd', 16, true},
      {"its covariance", objects[5], 'd', 36, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  compose(arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf, arrays.views[3].buf,
          arrays.views[4].buf, arrays.views[5].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Fill a pose as it is seen from another one, in its axes. The covariance is that of the pose and
// some times that of the other one, where the pose is.
static void relate(const double *start, const double *start_covariance, const double *pose,
                   const double *covariance, double times, double *motion,
                   double *motion_covariance) {
  double back[9], rotation[9], turn[9], arm[3], position[3], lever[6][6], axes[6][6];
  double sum[36] = {0};
  for (int i = 0; i < 9; ++i)
    back[i] = start[4 * (i % 3) + i / 3];
  rotation_of(pose, rotation);
  multiply(back, rotation, turn);
  for (int i = 0; i < 3; ++i)
    arm[i] = pose[4 * i + 3] - start[4 * i + 3];
  rotated(back, arm, position);
  fill_pose(turn, position, motion);
  fill_lever(arm, lever);
  fill_axes(back, axes);
  add_propagated(lever, start_covariance, sum);
  for (int i = 0; i < 36; ++i)
    sum[i] = covariance[i] + times * sum[i];
  memset(motion_covariance, 0, sizeof(sum));
  add_propagated(axes, sum, motion_covariance);
}

PyObject *kernel_relative_pose(PyObject *module, PyObject *arguments) {
  PyObject *objects[6];
  double times;
  if (!PyArg_ParseTuple(arguments, "OOOOdOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &times, &objects[4], &objects[5]))
    return NULL;
  const Argument needed[] = {
      {"the start", objects[0], 'd', 16, false},
      {"its covariance", objects[1], 'd', 36, false},
      {"the pose", objects[2], 'd', 16, false},
      {"its covariance", objects[3], 'd', 36, false},
      {"the motion", objects[4], 'd', 16, true},
      {"its covariance", objects[5], 'd', 36, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  relate(arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf, arrays.views[3].buf,
         times, arrays.views[4].buf, arrays.views[5].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

FOR_EACH_PROCESSOR
static void transform_all(const double *pose, const double (*points)[3], Py_ssize_t count,
                          double (*moved)[3]) {
  for (Py_ssize_t n = 0; n < count; ++n)
    transform(pose, points[n], moved[n]);
}

PyObject *kernel_transform(PyObject *module, PyObject *arguments) {
  PyObject *pose_array, *point_array, *moved_array;
  if (!PyArg_ParseTuple(arguments, "OOO", &pose_array, &point_array, &moved_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the pose", pose_array, 'd', 16, false},
      {"the points", point_array, 'd', 3 * count, false},
      {"the moved points", moved_array, 'd', 3 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  Py_BEGIN_ALLOW_THREADS
  transform_all(arrays.views[0].buf, arrays.views[1].buf, count, arrays.views[2].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
