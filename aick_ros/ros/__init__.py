# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The ROS 2 side: the only files that import rclpy."""

import os

# Our matrices are small: more BLAS threads only take the processor from the executor, which on
# two busy cores costs half the frame rate. NumPy reads this when it is first imported.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
