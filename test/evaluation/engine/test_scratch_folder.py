# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Temporary folders through errors and kills, beside those of other commands."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import dask
import distributed
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.evaluation.engine.scratch_folder import scratch_folder

KILLED = '''
import os, signal
from aick_ros.evaluation.engine.scratch_folder import scratch_folder
with scratch_folder() as folder:
    (folder / 'copy').write_text('content')
    print(folder, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
'''


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    """Return the folder that has all temporary ones."""
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    monkeypatch.setattr(tempfile, 'tempdir', None)
    return tmp_path


def test_it_is_removed_whatever_happens(temporary):
    with pytest.raises(ZeroDivisionError), scratch_folder() as folder:
        (folder / 'copy').write_text('content')
        assert folder.parent == temporary
        1 / 0
    assert list(temporary.iterdir()) == []


def test_that_of_a_process_that_was_killed_is_removed_by_the_next_and_no_other(temporary):
    foreign = temporary / 'aick-scratch-link'
    (temporary / 'data').mkdir()
    foreign.symlink_to(temporary / 'data')
    with scratch_folder() as mine:
        (mine / 'copy').write_text('content')
        left = subprocess.run([sys.executable, '-c', KILLED], stdout=subprocess.PIPE,
                              text=True).stdout.strip()
        assert (temporary / left / 'copy').exists()
        with scratch_folder():
            assert not (temporary / left).exists()
            assert (mine / 'copy').exists()
    assert {path.name for path in temporary.iterdir()} == {'data', foreign.name}


def test_scenes_of_this_run_stay_while_other_runs_begin():
    scenes = Path(os.environ['AICK_ROS_SCENES'])
    with scratch_folder(str(scenes.parent)) as other:
        assert other.name.startswith('aick-scratch-') and scenes.name.startswith('aick-scratch-')
        assert scenes.is_dir()


def test_processes_of_this_machine_work_where_the_settings_of_dask_say(tmp_path, monkeypatch):
    folder, given = tmp_path / 'large' / 'disk', []

    def local_cluster(**_):
        given.append(Path(dask.config.get('temporary-directory')))
        raise InputError('enough is known')
    monkeypatch.setattr(distributed, 'LocalCluster', local_cluster)
    with dask.config.set({'temporary-directory': str(folder)}):
        with pytest.raises(InputError, match='enough'), connected(Cluster(1)):
            pytest.fail('it was started')
    assert [path.parent for path in given] == [folder]
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(InputError, match='cannot make a folder in .*file/x: Not a directory'):
        with scratch_folder(str(tmp_path / 'file' / 'x')):
            pytest.fail('it was made')
