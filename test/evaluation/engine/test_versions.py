# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Versions here and on workers, and the digest that stands for the source code."""

import shutil
import types
from contextlib import ExitStack
from pathlib import Path

import cv2
import numpy as np
import pytest
from distributed import Client, LocalCluster

import aick_ros
from aick_ros.errors import InputError
from aick_ros.evaluation.engine import versions
from aick_ros.evaluation.engine.versions import other_versions, own_versions, reject_other_versions

OURS = {'aick_ros': '1+a', 'NumPy': '2.0'}


@pytest.fixture
def workers(monkeypatch):
    """Make Dask's client of workers in this process, each of which has one of the versions."""
    with ExitStack() as stack:
        def make(*found):
            def answer(dask_worker):
                if isinstance(found[dask_worker.name], Exception):
                    raise found[dask_worker.name]
                return found[dask_worker.name]

            # all of them are in this process, and would find its versions
            monkeypatch.setattr(versions, 'own_versions', answer)
            cluster = stack.enter_context(LocalCluster(
                n_workers=len(found), threads_per_worker=1, processes=False,
                dashboard_address=None))
            return stack.enter_context(Client(cluster))
        yield make


def addresses_by_name(client):
    """Return the addresses of the workers that are left, by their names 0, 1, ..."""
    names = client.run(lambda dask_worker: dask_worker.name)
    return {name: address for address, name in names.items()}


def test_workers_that_differ_are_retired_and_named(workers):
    client, said = workers(OURS, {**OURS, 'NumPy': '1.9'}, {'NumPy': '2.0'},
                           ValueError('no package'), {**OURS, 'other': '3'}), []
    before = addresses_by_name(client)
    reject_other_versions(client, said.append, OURS)
    kept = {name: before[name] for name in (0, 4)}
    assert addresses_by_name(client) == kept
    assert sorted(said) == sorted([
        f'the worker {before[1]} is rejected: it has other versions: NumPy 1.9 instead of 2.0',
        f'the worker {before[2]} is rejected: it has other versions: aick_ros missing instead of '
        '1+a', f'the worker {before[3]} is rejected: no package'])


def test_without_any_worker_there_is_no_fleet(workers):
    client = workers({}, {})
    with pytest.raises(InputError, match='none of the workers can be used'):
        reject_other_versions(client, lambda sentence: None, OURS)
    assert addresses_by_name(client) == {}


def test_workers_with_our_versions_are_kept_and_nothing_is_said():
    said = []
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=False,
                      dashboard_address=None) as cluster, Client(cluster) as client:
        reject_other_versions(client, said.append)
        assert len(addresses_by_name(client)) == 2
    assert said == []


def test_all_differences_are_named():
    assert other_versions({'aick_ros': '2', 'NumPy': '3'}, OURS) == (
        'it has other versions: aick_ros 2 instead of 1+a, NumPy 3 instead of 2.0')
    assert other_versions(OURS, OURS) == ''


def digest_of(monkeypatch, folder):
    monkeypatch.setattr(versions, 'aick_ros', types.SimpleNamespace(
        __file__=str(folder / '__init__.py'), __version__='7'))
    number, _, digest = own_versions.__wrapped__()['aick_ros'].partition('+')
    assert number == '7'
    return digest


def test_any_change_of_the_source_code_is_another_version(monkeypatch, tmp_path):
    found = own_versions()
    assert (found['NumPy'], found['OpenCV']) == (np.__version__, cv2.__version__)
    assert found['aick_ros'].startswith(f'{aick_ros.__version__}+')
    folder = tmp_path / 'here'
    shutil.copytree(Path(aick_ros.__file__).parent / 'evaluation', folder / 'evaluation',
                    ignore=shutil.ignore_patterns('__pycache__'))
    before = digest_of(monkeypatch, folder)
    assert len(before) == 12
    shutil.copytree(folder, tmp_path / 'there')
    (tmp_path / 'there' / 'notes.txt').write_text('of no matter')
    assert digest_of(monkeypatch, tmp_path / 'there') == before
    file = folder / 'evaluation' / 'engine' / 'tasks.py'
    file.write_text(file.read_text() + '\n')
    changed = digest_of(monkeypatch, folder)
    file.rename(file.with_name('renamed.py'))
    renamed = digest_of(monkeypatch, folder)
    (folder / 'evaluation').rename(folder / 'elsewhere')
    assert len({before, changed, renamed, digest_of(monkeypatch, folder)}) == 4
