# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A small recording as a folder, and methods that misbehave."""

import time
from pathlib import Path

import pytest

from aick_ros.evaluation.baselines.registry import METHODS, Method
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.evaluation.benchmark.runner import run
from aick_ros.geometry.camera import Camera
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

FRAMES = 8

# It estimates no motion, and misbehaves at the pair (or the frame) whose later stamp is in `when`.
METHOD_THAT_MISBEHAVES = '''
import os, pathlib, subprocess, sys, time
import numpy as np
from aick_ros.evaluation.baselines import Estimate

class Still:
    def __init__(self, deed='', when=(), at='pair'):
        self.deed, self.when, self.at = deed, when, at
    def do(self, at, stamp):
        if at != self.at or (self.when != 'always' and stamp not in self.when):
            return
        if self.deed == 'crash':
            os.abort()
        if self.deed == 'hang':
            pathlib.Path('helper').write_text(str(subprocess.Popen(['sleep', '3600']).pid))
            time.sleep(3600)
        if self.deed == 'exit':
            sys.exit('no licence found')
        if self.deed == 'raise':
            raise ValueError('no such thing')
        if self.deed == 'print':
            os.write(1, b'{"pair": "not an answer"}\\n')
            print('[INFO] working')
    def prepare(self, frame):
        self.do('frame', frame.stamp)
        return frame.stamp
    def register(self, source, target):
        self.do('pair', source)
        return Estimate(np.eye(4))

def broken():
    raise ImportError('libGL.so.1: cannot open shared object file')

def breaks_down():
    os.abort()
'''


@pytest.fixture(scope='session')
def tum_path(tmp_path_factory):
    """Return a rendered recording in a TUM folder."""
    path = tmp_path_factory.mktemp('recordings') / 'rendered'
    write_tum(path, SyntheticSource(SyntheticOptions(
        seed=5, frames=FRAMES, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5))))
    return path


@pytest.fixture(scope='session')
def recording(tum_path):
    return Recording.scan(Request(str(tum_path)), lambda done: None, raise_damage)


@pytest.fixture
def method(tmp_path, monkeypatch):
    """Return a function that makes a method that misbehaves in a process of its own."""
    (tmp_path / 'misbehaving.py').write_text(METHOD_THAT_MISBEHAVES)
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    monkeypatch.chdir(tmp_path)

    def make(deed='', when=(), at='pair', factory='misbehaving:Still'):
        options = {} if factory != 'misbehaving:Still' else {
            'deed': deed, 'when': when, 'at': at}
        return Method('still', 'Still', 'stands still', factory, options)
    return make


@pytest.fixture
def execute():
    """Return a function that runs a plan; it returns the progress and the unusable methods."""
    def execute(plan, journal, processes=1, is_stopped=lambda progress: False):
        progress = []
        unusable = run(plan, journal, processes, 120.0, progress.append,
                       lambda: is_stopped(progress))
        journal.close()
        return progress, unusable
    return execute


@pytest.fixture
def wait_for_end():
    """Return a function that waits for the end of a process that is not a child."""
    def wait(process_id):
        state, deadline = Path('/proc', str(process_id), 'stat'), time.monotonic() + 120
        while is_running(state):
            assert time.monotonic() < deadline, f'process {process_id} goes on'
            time.sleep(0.01)
    return wait


def is_running(state):
    try:
        return state.read_text().rpartition(')')[2].split()[0] != 'Z'
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.fixture
def aick():
    return METHODS['aick-orb-350']
