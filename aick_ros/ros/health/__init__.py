# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Health of the node: counts of frames, levels, sentences with remedies."""
