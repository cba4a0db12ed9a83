# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An earlier file stays until the new one is complete."""

import errno
import os

import pytest

from aick_ros.borders.replacement import reason_of, replaced, try_to_write, unwritable
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


def test_the_draft_becomes_the_file_when_the_block_ends(tmp_path):
    path = tmp_path / 'plot.png'
    path.write_text('earlier')
    with replaced(path) as draft:
        assert draft.parent == tmp_path and draft != path
        draft.write_text('new')
        assert path.read_text() == 'earlier'
    assert path.read_text() == 'new'
    assert os.listdir(tmp_path) == ['plot.png']


def test_the_file_behind_a_link_is_replaced_and_the_link_stays(tmp_path):
    (tmp_path / 'folder').mkdir()
    link, target = tmp_path / 'link', tmp_path / 'folder' / 'target'
    link.symlink_to(target)
    with replaced(link) as draft:
        assert draft.parent == target.parent
        draft.write_text('new')
    assert link.is_symlink() and target.read_text() == 'new'


def test_the_longest_name_has_a_draft(tmp_path):
    path = tmp_path / ('a' * 255)
    with replaced(path) as draft:
        draft.write_text('new')
    assert path.read_text() == 'new'


@pytest.mark.parametrize('name', ['new', 'earlier', 'link', 'a' * 255])
def test_a_trial_leaves_all_as_it_is(tmp_path, name):
    (tmp_path / 'earlier').write_text('content')
    (tmp_path / 'link').symlink_to('target')
    before = sorted(os.listdir(tmp_path))
    try_to_write(tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == before
    assert (tmp_path / 'earlier').read_text() == 'content'


def test_a_trial_is_made_where_the_file_would_be(tmp_path):
    (tmp_path / 'link').symlink_to('/proc/file')
    with pytest.raises(OSError, match='No such file'):
        try_to_write(tmp_path / 'link')


def test_a_pipe_is_written_to_directly(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    reader = os.open(tmp_path / 'pipe', os.O_RDONLY | os.O_NONBLOCK)
    with replaced(tmp_path / 'pipe') as draft:
        assert draft == tmp_path / 'pipe'
        with pytest.raises(BlockingIOError):  # it has a writer, though none has written
            os.read(reader, 1)
        draft.write_text('content')
    assert os.read(reader, 99) == b'content'
    assert os.read(reader, 99) == b''
    os.close(reader)


def test_a_pipe_that_no_program_reads_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(InputError, match='cannot write .*pipe: it is a pipe that no program '):
        with replaced(tmp_path / 'pipe'):
            pytest.fail('the block begins')


def test_a_link_to_itself_cannot_be_written(tmp_path):
    (tmp_path / 'loop').symlink_to('loop')
    with pytest.raises(InputError, match='cannot write .*loop: '):
        with replaced(tmp_path / 'loop'):
            pytest.fail('the block begins')


@pytest.mark.parametrize('error, reason', [
    (OSError(errno.ENOSPC, 'No space left', 'name'), 'No space left'),
    (OSError('without a number'), 'without a number'), (RuntimeError('a loop'), 'a loop')])
def test_the_reason_is_without_the_name(error, reason):
    assert reason_of(error) == reason


@pytest.mark.parametrize('number, reason, remedy', [
    (errno.ENOSPC, 'No space left on device', 'make room there'),
    (errno.EDQUOT, 'Disk quota exceeded', 'make room there'),
    (errno.EROFS, 'Read-only file system', 'choose another place'),
    (errno.ENAMETOOLONG, 'File name too long', 'choose another name')])
def test_what_to_do_depends_on_why_a_file_cannot_be_written(number, reason, remedy):
    error = OSError(number, reason, 'name')
    assert str(unwritable('a.png', error)) == f'cannot write a.png: {reason}; {remedy}'


def test_a_name_that_is_none_has_to_be_another_one():
    assert str(unwritable('a', ValueError('embedded null byte'))) == (
        'cannot write a: embedded null byte; choose another name')
