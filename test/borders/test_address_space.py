# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Memory that is limited too far is told before libraries abort."""

import resource

import pytest

from aick_ros.borders.address_space import check_address_space
from aick_ros.errors import InputError


@pytest.mark.parametrize('allowed, is_enough', [
    (999_999_999, False), (10 ** 9, True), (resource.RLIM_INFINITY, True)])
def test_too_little_is_rejected_with_both_numbers(monkeypatch, allowed, is_enough):
    monkeypatch.setattr(resource, 'getrlimit', lambda kind: (
        allowed if kind == resource.RLIMIT_AS else 64, resource.RLIM_INFINITY))
    if is_enough:
        check_address_space(10 ** 9, 'libraries')
    else:
        with pytest.raises(InputError, match='limited to 999 MB .*, libraries require 1000 MB: r'):
            check_address_space(10 ** 9, 'libraries')
