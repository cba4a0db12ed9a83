// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Prediction of position, velocity, gravity, and the bias and the place of an accelerometer, three
// values each, and of its time offset.

#include <string.h>

#include "arrays.h"
#include "kalman.h"
#include "kernels.h"
#include "se3.h"

enum { POSITION = 0, VELOCITY = 3, GRAVITY = 6, BIAS = 9, OFFSET = 15, VALUES = 16 };
enum { FORCE = 0, WALK = 3, NOISES = 6 };  // noises of the force, and of the drift of its bias

// What the specific force does in an interval, in the axes of a fixed frame.
typedef struct {
  double duration;                                    // s
  const double *velocity, *position;                  // its integral, and the double one
  const double *velocity_by_bias, *position_by_bias;  // their derivatives, 3x3
  const double *velocity_by_offset, *position_by_offset;
} Impulse;

typedef struct {
  double force, walk;         // variances, by time
  const double *orientation;  // covariance, 3x3 [rad^2]
} Noise;

static void fill_transition(const Impulse *impulse, double transition[VALUES][VALUES]) {
  const double time = impulse->duration;
  for (int i = 0; i < VALUES; ++i)
    transition[i][i] = 1.0;
  for (int i = 0; i < 3; ++i) {
    transition[POSITION + i][VELOCITY + i] = time;
    transition[POSITION + i][GRAVITY + i] = -0.5 * time * time;
    transition[VELOCITY + i][GRAVITY + i] = -time;
    transition[POSITION + i][OFFSET] = impulse->position_by_offset[i];
    transition[VELOCITY + i][OFFSET] = impulse->velocity_by_offset[i];
    for (int j = 0; j < 3; ++j) {
      transition[POSITION + i][BIAS + j] = -impulse->position_by_bias[3 * i + j];
      transition[VELOCITY + i][BIAS + j] = -impulse->velocity_by_bias[3 * i + j];
    }
  }
}

static void fill_influence(double time, double influence[VALUES][NOISES]) {
  for (int i = 0; i < 3; ++i) {
    influence[POSITION + i][FORCE + i] = 0.5 * time;
    influence[VELOCITY + i][FORCE + i] = influence[BIAS + i][WALK + i] = 1.0;
  }
}

// An error of the orientation turns gravity; it is the same one all the time.
static void fill_noise(double time, const double *gravity, const Noise *noise,
                       double covariance[NOISES][NOISES]) {
  const double x = gravity[0], y = gravity[1], z = gravity[2];
  const double arm[9] = {0, -z, y, z, 0, -x, -y, x, 0}, back[9] = {0, z, -y, -z, 0, x, y, -x, 0};
  double left[9], turned[9];
  multiply(arm, noise->orientation, left);
  multiply(left, back, turned);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      covariance[FORCE + i][FORCE + j] = time * time * turned[3 * i + j];
    covariance[FORCE + i][FORCE + i] += time * noise->force;
    covariance[WALK + i][WALK + i] = time * noise->walk;
  }
}

static void predict(const double *values, const double *covariance, const Impulse *impulse,
                    const Noise *noise, double *later, double *later_covariance) {
  double transition[VALUES][VALUES] = {{0}}, influence[VALUES][NOISES] = {{0}};
  double noises[NOISES][NOISES] = {{0}};
  fill_transition(impulse, transition);
  fill_influence(impulse->duration, influence);
  fill_noise(impulse->duration, values + GRAVITY, noise, noises);
  propagate(*transition, covariance, *influence, *noises, VALUES, NOISES, later_covariance);
  memset(later, 0, VALUES * sizeof(*later));
  for (int i = 0; i < VALUES; ++i)
    for (int j = 0; j < OFFSET; ++j)  // the impulse is that at the offset estimated
      later[i] += transition[i][j] * values[j];
  later[OFFSET] = values[OFFSET];
  for (int i = 0; i < 3; ++i) {
    later[POSITION + i] += impulse->position[i];
    later[VELOCITY + i] += impulse->velocity[i];
  }
}

PyObject *kernel_predict_gravity(PyObject *module, PyObject *arguments) {
  PyObject *objects[11];
  Impulse impulse;
  Noise noise;
  if (!PyArg_ParseTuple(arguments, "OOdOOOOOOOddOO", &objects[0], &objects[1], &impulse.duration,
                        &objects[2], &objects[3], &objects[4], &objects[5], &objects[6],
                        &objects[7], &objects[8], &noise.force, &noise.walk, &objects[9],
                        &objects[10]))
    return NULL;
  const Argument needed[] = {
      {"the values", objects[0], 'd', VALUES, false},
      {"the covariance", objects[1], 'd', VALUES * VALUES, false},
      {"the velocity", objects[2], 'd', 3, false},
      {"the position", objects[3], 'd', 3, false},
      {"the velocity by the bias", objects[4], 'd', 9, false},
      {"the position by the bias", objects[5], 'd', 9, false},
      {"the velocity by the offset", objects[6], 'd', 3, false},
      {"the position by the offset", objects[7], 'd', 3, false},
      {"the orientation", objects[8], 'd', 9, false},
      {"the later values", objects[9], 'd', VALUES, true},
      {"the later covariance", objects[10], 'd', VALUES * VALUES, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  impulse.velocity = views[2].buf;
  impulse.position = views[3].buf;
  impulse.velocity_by_bias = views[4].buf;
  impulse.position_by_bias = views[5].buf;
  impulse.velocity_by_offset = views[6].buf;
  impulse.position_by_offset = views[7].buf;
  noise.orientation = views[8].buf;
  predict(views[0].buf, views[1].buf, &impulse, &noise, views[9].buf, views[10].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
