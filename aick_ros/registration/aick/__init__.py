# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Adaptive Iterative Closest Keypoint, the algorithm of the paper."""
