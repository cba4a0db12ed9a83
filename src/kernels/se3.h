// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Rotations, 3x3, and poses, 4x4, row by row.

#ifndef AICK_ROS_SE3_H
#define AICK_ROS_SE3_H

// The rotation of a rotation vector [rad].
void exp_rotation(const double *theta, double *rotation);

// The rotation vector [rad] of a rotation; its length is 0 to pi.
void log_rotation(const double *rotation, double *theta);

// The pose reached by a constant twist of the body in unit time.
void exp_pose(const double *twist, double *pose);

// The twist whose exponential is a pose.
void log_pose(const double *pose, double *twist);

// A pose with an error added in the axes of the target frame, its rotation orthonormal to
// rounding; it may be the pose itself.
void perturb(const double *pose, const double *error, double *perturbed);

// Add M C M^T to a 6x6 matrix.
void add_propagated(double m[6][6], const double *covariance, double *sum);

// Fill the matrix that moves an error to a point displaced by a lever arm.
void fill_lever(const double *arm, double lever[6][6]);

// Fill the matrix that expresses an error in rotated axes.
void fill_axes(const double *rotation, double axes[6][6]);

// The product of two matrices, which is neither of them.
void multiply(const double *a, const double *b, double *product);

#endif
