# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""One room for all tests: it takes a second or two to build."""

import pytest

from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource


@pytest.fixture(scope='session')
def perfect():
    """Return five seconds without noise."""
    return SyntheticSource(SyntheticOptions.perfect(seed=1))


@pytest.fixture(scope='session')
def noisy(perfect):
    """Return the same room and path as the default sensor sees it."""
    return SyntheticSource(SyntheticOptions(seed=1), perfect.scene)
