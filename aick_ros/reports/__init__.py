# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plots and the HTML report. They require matplotlib: import them only where they are used."""
