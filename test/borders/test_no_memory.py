# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that stand for a full memory, and those that do not."""

import pytest

from aick_ros.borders.no_memory import is_of_memory


@pytest.mark.parametrize('error, is_one', [
    (MemoryError(), True), (ImportError('x.so: failed to map segment from shared object'), True),
    (OSError(12, 'Cannot allocate memory'), True), (RuntimeError("can't start new thread"), True),
    (RuntimeError('(-4:Insufficient memory) Failed to allocate 8 bytes'), True),
    (ImportError('no module named x'), False), (ValueError('a memory of the map'), False),
    (RuntimeError(''), False)])
def test_what_is_for_want_of_memory(error, is_one):
    assert is_of_memory(error) is is_one
