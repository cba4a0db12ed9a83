# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A file for results can be written and replaces nothing that the command reads."""

import os
from pathlib import Path

import pytest

from aick_ros.cli.output.target import check_parent, check_target
from aick_ros.errors import InputError


@pytest.mark.parametrize('name, reason', [
    ('n' * 300, 'File name too long'), ('', 'it is a folder'), ('none/file', 'does not exist'),
    ('nu\0l', 'null'), ('/proc/file', 'No such file'), ('n' * 300 + '/file', 'does not exist')])
def test_what_cannot_be_written_is_found_before_the_work(tmp_path, name, reason):
    with pytest.raises(InputError, match=f'cannot write (.|\n)*{reason}'):
        check_target(os.path.join(tmp_path, name))


@pytest.fixture
def folder(tmp_path):
    """Return a folder of a recording: files, files below, links to what lies elsewhere."""
    outside = tmp_path / 'outside'
    outside.mkdir()
    for file in ('rgb.txt', 'rgb/1.png', 'rgb/deep/1.png', '../outside/2.png', '../other.bag'):
        path = tmp_path / 'recording' / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('input')
    (tmp_path / 'recording' / 'depth').symlink_to(outside)
    (tmp_path / 'recording' / 'gone').symlink_to('nothing')
    (tmp_path / 'link').symlink_to(tmp_path / 'recording')
    os.link(tmp_path / 'recording' / 'rgb.txt', tmp_path / 'second_name')
    return tmp_path


@pytest.mark.parametrize('name', [
    'recording/rgb.txt', 'recording/rgb/1.png', 'recording/rgb/deep/1.png', 'outside/2.png',
    'recording/depth/2.png', 'link/rgb.txt', 'recording/../link/rgb/1.png', 'second_name',
    'other.bag'])
def test_an_input_is_not_overwritten(folder, name):
    inputs = ('synthetic:1', None, '', folder / 'missing', str(folder / 'recording'),
              folder / 'other.bag')
    with pytest.raises(InputError, match='input .*another file'):
        check_target(str(folder / name), *inputs)


def test_results_may_be_new_in_the_folder_of_an_input_or_replace_older_ones(folder):
    (folder / 'older.json').write_text('')
    for name in ('recording/new.json', 'older.json', 'outside/new.json'):
        check_target(str(folder / name), folder / 'recording', folder / 'other.bag')
    for inputs in ((), (None, folder / 'missing')):
        check_target(str(folder / 'other.bag'), *inputs)
    check_target('-', folder / 'recording')


def test_standard_output_is_no_file_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / '-').mkdir()
    check_target('-')
    check_target(None)


@pytest.mark.parametrize('target, sentence', [
    ('none/x', 'cannot write none/x: the folder none does not exist'),
    ('recording', "cannot write 'recording': it is a folder, a file is required"),
    ('other.bag', 'cannot write other.bag: it is an input of this command; name another file for '
                  'the results'),
    ('recording/rgb.txt', 'cannot write recording/rgb.txt: it is a file of the input recording; '
                          'name another file for the results'),
    (300 * 'n', f"cannot write '{300 * 'n'}': File name too long; choose another name")])
def test_a_sentence_says_what_is_wrong_and_what_to_do(folder, monkeypatch, target, sentence):
    monkeypatch.chdir(folder)
    with pytest.raises(InputError) as raised:
        check_target(target, 'recording', 'other.bag')
    assert str(raised.value) == sentence


def test_a_device_that_is_an_input_too_is_nothing_to_lose():
    check_target('/dev/null', '/dev/null')


def test_a_full_disk_is_found_before_the_work(tmp_path, monkeypatch, full_disk):
    (tmp_path / 'earlier').write_text('content')
    monkeypatch.chdir(tmp_path)
    for name in ('earlier', 'new'):
        with pytest.raises(InputError) as raised:
            check_target(name)
        assert str(raised.value) == (
            f"cannot write '{name}': No space left on device; make room there")
    assert os.listdir() == ['earlier'] and (tmp_path / 'earlier').read_text() == 'content'


def test_a_pipe_and_a_device_are_given_nothing(tmp_path):
    """Also a pipe that no program reads yet."""
    os.mkfifo(tmp_path / 'pipe')
    reader = os.open(tmp_path / 'pipe', os.O_RDONLY | os.O_NONBLOCK)
    try:
        check_target(str(tmp_path / 'pipe'))
        check_target('/dev/full')
        assert os.read(reader, 1) == b''
    finally:
        os.close(reader)


def test_a_place_for_folders_is_checked_without_making_it(tmp_path, full_disk):
    (tmp_path / 'file').touch()
    (tmp_path / 'link').symlink_to('link')
    for name, reason in (('file/a', 'Not a directory'), ('link', 'Symlink loop'),
                         ('deep/er', 'No space left on device')):
        with pytest.raises(InputError) as raised:
            check_parent(tmp_path / name, '--out')
        assert f'--out {tmp_path / name}: cannot make a folder in ' in str(raised.value)
        assert reason in str(raised.value)
        assert str(raised.value).endswith('; name another folder')
    assert sorted(os.listdir(tmp_path)) == ['file', 'link']


def test_a_folder_that_can_be_made_is_accepted_and_not_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in (Path('runs'), tmp_path / 'deep' / 'er', tmp_path, Path()):
        check_parent(folder, '--out')
    assert os.listdir(tmp_path) == []
