# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of the files in the folder of a run, and in that of a demo."""

TRAJECTORY = 'trajectory.tum'
FRAMES = 'frames.csv'
SUMMARY = 'summary.json'
GROUND_TRUTH = 'ground_truth.tum'

DEMO = 'demo-'
"""Beginning of the name of a folder that ``aick demo`` writes, with a trajectory and the bag."""

BAG = 'bag'
