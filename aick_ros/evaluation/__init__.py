# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Accuracy, consistency and speed of registrations, trajectories and runs."""
