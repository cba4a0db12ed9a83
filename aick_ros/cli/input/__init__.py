# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Input of the commands: options, settings, recordings, Ctrl-C."""
