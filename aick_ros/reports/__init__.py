# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plots and the HTML report; these files alone need matplotlib, so import them where needed."""
