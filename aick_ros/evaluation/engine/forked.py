# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Imported last where processes are forked: they know the versions of what has been imported.

A file that is changed while the tasks run is none of theirs.
"""

from __future__ import annotations

from aick_ros.evaluation.engine.versions import own_versions

own_versions()
