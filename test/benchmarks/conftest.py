# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A recording that benchmarks score."""

import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource


@pytest.fixture(scope='module')
def source():
    """Return four frames of a rendered room."""
    return SyntheticSource(SyntheticOptions(seed=5, frames=4))
