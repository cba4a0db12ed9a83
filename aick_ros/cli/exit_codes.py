# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Exit codes of ``aick``."""

DONE = 0
DEFECT = 1
UNUSABLE_INPUT = 2
REGRESSION = 3
INTERRUPTED_BY_USER = 130
PIPE_CLOSED = 141
