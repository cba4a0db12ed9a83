# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of an IMU to expected rotations, with bias, time offset and covariance."""
