# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A folder appears whole or not at all."""

import os

import pytest

from aick_ros.errors import InputError
from aick_ros.sources.writers.new_folder import new_folder


def test_the_folder_appears_at_the_end(tmp_path):
    target = tmp_path / 'deep' / 'target'
    with new_folder(target) as folder:
        assert folder.name == 'target'
        folder.mkdir()
        (folder / 'file').write_text('content')
        assert not target.exists()
    assert (target / 'file').read_text() == 'content'
    assert os.listdir(target.parent) == ['target']


@pytest.mark.parametrize('error', [RuntimeError, KeyboardInterrupt, InputError])
def test_nothing_is_left_of_an_interrupted_one(tmp_path, error):
    with pytest.raises(error):
        with new_folder(tmp_path / 'target') as folder:
            folder.mkdir()
            (folder / 'file').write_text('content')
            raise error
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize('make', [os.mkdir, lambda path: open(path, 'w').close()])
def test_an_existing_target_is_rejected_and_left_alone(tmp_path, make):
    make(tmp_path / 'target')
    with pytest.raises(InputError, match='target exists already: remove it or choose another'):
        with new_folder(tmp_path / 'target'):
            pytest.fail('nothing may be written')
    assert os.listdir(tmp_path) == ['target']


@pytest.mark.parametrize('content', [[], ['file']])
def test_what_another_command_makes_meanwhile_is_left_alone(tmp_path, content):
    target = tmp_path / 'target'
    with pytest.raises(InputError, match='target exists already: remove it or choose another'):
        with new_folder(target) as folder:
            folder.mkdir()
            target.mkdir()
            for name in content:
                (target / name).touch()
    assert os.listdir(tmp_path) == ['target']
    assert os.listdir(target) == content


def test_a_target_that_cannot_be_written_is_rejected(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot write .*file/target: '):
        with new_folder(tmp_path / 'file' / 'target'):
            pytest.fail('nothing may be written')


def test_a_full_disk_is_told(tmp_path):
    with pytest.raises(InputError, match='cannot write .*target: .*No space left'):
        with new_folder(tmp_path / 'target') as folder:
            folder.mkdir()
            raise OSError(28, 'No space left on device')
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize('name', ['n' * 300, 'file/target', 'nu\0l', 'loop/target',
                                  'd/' * 1500 + 'target'])
def test_a_place_that_cannot_be_is_rejected_before_the_work(tmp_path, name):
    (tmp_path / 'file').touch()
    (tmp_path / 'loop').symlink_to(tmp_path / 'loop')
    with pytest.raises(InputError, match='cannot write '):
        with new_folder(tmp_path / name):
            pytest.fail('nothing may be written')
    assert sorted(os.listdir(tmp_path)) == ['file', 'loop']


def test_a_name_may_be_as_long_as_the_system_allows(tmp_path):
    name = os.pathconf(tmp_path, 'PC_NAME_MAX') * 'n'
    with new_folder(tmp_path / name) as folder:
        folder.mkdir()
    assert os.listdir(tmp_path) == [name]
