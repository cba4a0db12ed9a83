# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An earlier file stays until the new one is complete."""

import errno
import os

import pytest

from aick_ros.borders.replacement import replaced
from aick_ros.errors import InputError


@pytest.mark.parametrize('error', [
    KeyboardInterrupt(), ValueError('of the block'), OSError(errno.ENOSPC, 'No space left')])
def test_an_earlier_file_stays_where_the_block_fails(tmp_path, error):
    path = tmp_path / 'plot.png'
    path.write_text('earlier')
    with pytest.raises(type(error)) as raised, replaced(path) as draft:
        draft.write_text('half')
        raise error
    assert raised.value is error
    assert path.read_text() == 'earlier'
    assert os.listdir(tmp_path) == ['plot.png']


def test_a_draft_that_cannot_be_made_is_the_file_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match='cannot write .*nowhere/plot.png: No such file'):
        with replaced(tmp_path / 'nowhere' / 'plot.png') as draft:
            draft.write_text('content')
