# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""After the paper: least squares over tracked keypoints and the depth image."""
