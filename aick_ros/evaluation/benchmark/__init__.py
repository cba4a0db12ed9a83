# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Methods side by side, on the same pairs of the same recordings, in one run.

Each method registers the pairs of a recording in a process of its own (:mod:`worker`), watched by
:mod:`supervisor`, so that one that crashes or hangs stops none of the others. :mod:`journal` keeps
what was measured, so that an interrupted run goes on. :mod:`results` makes figures of it.
"""
