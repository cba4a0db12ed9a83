# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Methods compared on the same pairs of the same recordings, in one run.

Each method registers the pairs of a recording in a task of the engine (:mod:`measurement`), in a
process of its own, so that a crash or hang (:mod:`last_step`) does not affect the other methods.
:mod:`journal` stores every measurement, so that an interrupted run can be resumed.
:mod:`results` computes the scores.
"""
