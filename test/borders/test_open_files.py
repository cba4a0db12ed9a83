# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Open files that are limited too far are told before libraries fail."""

import resource

import pytest

from aick_ros.borders.open_files import check_open_files
from aick_ros.errors import InputError


@pytest.mark.parametrize('allowed, is_enough', [
    (31, False), (32, True), (resource.RLIM_INFINITY, True)])
def test_too_few_are_rejected_with_both_numbers(monkeypatch, allowed, is_enough):
    monkeypatch.setattr(resource, 'getrlimit', lambda kind: (
        allowed if kind == resource.RLIMIT_NOFILE else 5, resource.RLIM_INFINITY))
    if is_enough:
        check_open_files(32, 'libraries')
    else:
        with pytest.raises(InputError, match='may have 31 open files .*, libraries require 32: r'):
            check_open_files(32, 'libraries')
