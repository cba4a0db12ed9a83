# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Versions here and on workers, and the digest that stands for the source code."""

import shutil
import types
from pathlib import Path

import cv2
import numpy as np
import pytest

import aick_ros
from aick_ros.errors import InputError
from aick_ros.evaluation.engine import versions
from aick_ros.evaluation.engine.versions import other_versions, own_versions, reject_other_versions

OURS = {'aick_ros': '1+a', 'NumPy': '2.0'}


class Client:
    """Two workers or more, of which some cannot say their versions."""

    def __init__(self, **answers):
        self.answers, self.retired = answers, []

    def run(self, function, on_error):
        assert (function, on_error) == (own_versions, 'return')
        return self.answers

    def retire_workers(self, workers):
        self.retired.append(workers)


def test_workers_that_differ_are_retired_and_named():
    client = Client(one=OURS, two={**OURS, 'NumPy': '1.9'}, three={'NumPy': '2.0'},
                    four=ValueError('no package'), five={**OURS, 'other': '3'})
    said = []
    reject_other_versions(client, said.append, OURS)
    assert client.retired == [['two', 'three', 'four']]
    assert said == [
        'the worker two is rejected: it has other versions: NumPy 1.9 instead of 2.0',
        'the worker three is rejected: it has other versions: aick_ros missing instead of 1+a',
        'the worker four is rejected: no package']


def test_without_any_worker_there_is_no_fleet():
    client = Client(one={}, two={})
    with pytest.raises(InputError, match='none of the workers can be used'):
        reject_other_versions(client, lambda sentence: None, OURS)
    client, said = Client(one=own_versions()), []
    reject_other_versions(client, said.append)
    assert (client.retired, said) == ([], [])


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
    assert len({before, changed, digest_of(monkeypatch, folder)}) == 3
