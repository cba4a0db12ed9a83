# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of the files in the folder of a run."""

TRAJECTORY = 'trajectory.tum'
FRAMES = 'frames.csv'
SUMMARY = 'summary.json'
GROUND_TRUTH = 'ground_truth.tum'
