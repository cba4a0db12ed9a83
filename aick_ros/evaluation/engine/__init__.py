# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Tasks on the processes of this machine or of a cluster, with Dask.

Dask starts the processes, distributes the tasks and replaces processes that die. :mod:`cluster`
connects to it, :mod:`tasks` runs tasks through whatever befalls them, :mod:`time_limit` ends one
that hangs, and :mod:`versions` rejects workers that would compute something else.
"""
