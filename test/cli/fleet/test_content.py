# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Whatever a run depends on changes its identity, and nothing else does."""

import dataclasses
import os
import shutil

import pytest

from aick_ros.cli.fleet import content
from aick_ros.cli.fleet.content import identity_of, state_of
from aick_ros.cli.fleet.job import Job
from aick_ros.cli.fleet.remote import RemoteFile
from aick_ros.cli.fleet.scratch import ScratchSpace
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import SourceOptions

JOB = Job('desk.mcap', 'settings', Settings(), gaps=(1, 5), limit=100)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / 'desk'
    for name in ('rgb/1.png', 'rgb/2.png', 'rgb.txt'):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'content of {name}')
        os.utime(path, ns=(0, 10 ** 9))
    return folder


def grow(path):
    path.write_text(path.read_text() + 'x')
    os.utime(path, ns=(0, 10 ** 9))


@pytest.mark.parametrize('change', [
    lambda folder: grow(folder / 'rgb' / '2.png'),
    lambda folder: os.utime(folder / 'rgb' / '2.png', ns=(0, 10 ** 9 + 1)),
    lambda folder: (folder / 'rgb' / '2.png').rename(folder / '2.png'),
    lambda folder: (folder / 'rgb' / '2.png').rename(folder / 'rgb' / '3.png'),
    lambda folder: (folder / 'rgb' / '2.png').unlink(),
    lambda folder: (folder / 'new').touch()])
def test_a_change_of_a_folder_is_seen(folder, change):
    before = state_of(str(folder))
    change(folder)
    assert state_of(str(folder)) != before


def test_a_folder_that_is_moved_is_the_same(folder, tmp_path, monkeypatch):
    before = state_of(str(folder))
    assert state_of(str(folder)) == before
    folder.rename(tmp_path / 'moved')
    assert state_of(str(tmp_path / 'moved')) == before
    walk = os.walk

    def backwards(top):
        return [(place, names, files[::-1]) for place, names, files in [*walk(top)][::-1]]
    monkeypatch.setattr(os, 'walk', backwards)  # as another file system may list it
    assert state_of(str(tmp_path / 'moved')) == before


def test_a_file_is_the_same_by_size_and_time(folder, tmp_path):
    before = state_of(str(folder / 'rgb.txt'))
    shutil.copy2(folder / 'rgb.txt', tmp_path / 'copy.txt')
    assert state_of(str(tmp_path / 'copy.txt')) == before
    grow(tmp_path / 'copy.txt')
    assert state_of(str(tmp_path / 'copy.txt')) != before


def test_what_no_file_holds_is_its_own_state(tmp_path):
    assert state_of('synthetic:3') == 'synthetic:3'
    with pytest.raises(InputError, match=f'^cannot read {tmp_path}/none: No such file or dir.*y$'):
        state_of(str(tmp_path / 'none'))


@pytest.mark.parametrize('change', [{'name': 'b'}, {'size': 2}, {'version': 'w'}, {}])
def test_a_url_is_the_same_by_name_size_and_version(monkeypatch, change):
    file = RemoteFile('/top/a', 'a', 1, 'v')
    files = [file, RemoteFile('/top/c', 'c', 3, 'v')]
    monkeypatch.setattr(content, 'files_of', lambda url: files)
    before = state_of('s3://top')
    files.reverse()
    assert state_of('s3://top') == before
    files[1] = dataclasses.replace(file, path='/other/a', **change)
    assert (state_of('s3://top') != before) is bool(change)


@pytest.mark.parametrize('change', [
    {'settings': with_values(Settings(), {'aick.alpha': 0.123})},
    {'options': SourceOptions(max_interval=0.03)}, {'options': SourceOptions(camera='a.json')},
    {'options': SourceOptions(register_depth=True)}, {'gaps': (1, 6)}, {'gaps': (5, 1)},
    {'limit': 101}, {'limit': None}])
def test_what_a_run_depends_on_is_part_of_its_identity(change):
    assert identity_of(dataclasses.replace(JOB, **change), 's') != identity_of(JOB, 's')


@pytest.mark.parametrize('change', [
    {'source': 'copy.mcap'}, {'variant': 'named'}, {'gaps': [1, 5]},
    {'scratch': ScratchSpace(limit=5)}])
def test_what_changes_nothing_is_not(change):
    assert identity_of(dataclasses.replace(JOB, **change), 's') == identity_of(JOB, 's')


def test_state_and_versions_are_part_of_the_identity(monkeypatch):
    before = identity_of(JOB, 's')
    assert identity_of(JOB, 't') != before
    monkeypatch.setattr(content, 'own_versions', lambda: {'NumPy': '0.9'})
    assert identity_of(JOB, 's') != before


@pytest.mark.parametrize('name', ['sensor.mask', 'aick.vocabulary'])
def test_the_files_of_the_settings_are_part_of_the_identity(tmp_path, name):
    """By size and time of change, where they can be read here."""
    path = tmp_path / 'file'
    job = dataclasses.replace(JOB, settings=with_values(Settings(), {name: str(path)}))
    found = {identity_of(job, 's')}
    path.write_text('one')
    found.add(identity_of(job, 's'))
    assert identity_of(job, 's') in found
    grow(path)
    found.add(identity_of(job, 's'))
    assert len(found) == 3
