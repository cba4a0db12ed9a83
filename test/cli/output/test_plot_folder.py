# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Folders of plots: none is left behind without content."""

import pytest

from aick_ros.cli.output.plot_folder import make_folder, removed_if_empty
from aick_ros.errors import InputError
from aick_ros.evaluation.engine import cluster


@pytest.fixture
def fail(tmp_path):
    """Return a function that makes a folder, and content in it, and fails."""
    def run(*parts, file=None):
        path = tmp_path.joinpath(*parts)
        with pytest.raises(KeyboardInterrupt), removed_if_empty(None, path):
            make_folder(path, '--plots')
            if file is not None:
                (path / file).write_text('content')
            raise KeyboardInterrupt
    return run


def test_new_folders_without_content_are_removed(tmp_path, fail):
    fail('new', 'within')
    assert list(tmp_path.iterdir()) == []


def test_content_stays(tmp_path, fail):
    fail('new', 'within', file='plot.png')
    assert (tmp_path / 'new' / 'within' / 'plot.png').read_text() == 'content'


def test_folders_that_were_there_stay(tmp_path, fail):
    (tmp_path / 'there').mkdir()
    fail('there')
    fail('there', 'new')
    assert [path.name for path in tmp_path.rglob('*')] == ['there']


def test_a_full_disk_is_found_before_the_work(tmp_path, full_disk):
    path = tmp_path / 'plots'
    with pytest.raises(InputError) as raised, removed_if_empty(path):
        make_folder(path, '--plots')
    assert str(raised.value) == (f'--plots {path}: cannot write into the folder: No space left '
                                 'on device; name another folder, or make room there')
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('arguments', [
    ('evaluate', 'tum', '--plots', 'p/q', '--export', 'x'),
    ('noise', 'tum', '--imu', '--plots', 'p'),
    ('fleet', 'tum', '--out', 'p/q', '--scheduler', 'tcp://127.0.0.1:9')])
def test_a_command_that_fails_leaves_none(aick, tmp_path, monkeypatch, arguments):
    monkeypatch.setattr(cluster, '_CONNECTION_LIMIT', 0.2)
    (tmp_path / 'tum').mkdir()
    for kind in ('rgb', 'depth'):
        (tmp_path / 'tum' / f'{kind}.txt').write_text(f'1.0 {kind}/1.png\n')
    (tmp_path / 'tum' / 'groundtruth.txt').write_text('1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n')
    (tmp_path / 'tum' / 'camera.json').write_text(
        '{"width": 4, "height": 4, "k": [4, 0, 2, 0, 4, 2, 0, 0, 1]}')
    assert aick(*arguments).code == 2
    assert [path.name for path in tmp_path.iterdir()] == ['tum']
