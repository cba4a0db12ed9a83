# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Methods compared on the same pairs of the same recordings, in one run.

Each method registers the pairs of a recording in its own process (:mod:`method_process`), which
:mod:`supervisor` watches, so that a crash or hang of one method does not affect the others.
:mod:`journal` stores every measurement, so that an interrupted run can be resumed.
:mod:`results` computes the scores.
"""
