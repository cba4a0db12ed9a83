# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick fleet``: which recordings and settings, the task on a worker, the rows of the table."""
