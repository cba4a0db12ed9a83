# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""RGB-D visual odometry by Adaptive Iterative Closest Keypoint (Ekekrantz et al., ECMR 2013)."""

__version__ = '0.1.0'
