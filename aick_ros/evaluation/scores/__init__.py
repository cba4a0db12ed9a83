# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors and statistics of runs and of pairs of frames, against ground truth."""
