# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A small recording as a folder, and methods that misbehave."""

import pytest

from aick_ros.evaluation.baselines.registry import METHODS, Method
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.geometry.camera import Camera
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.tum_writer import write_tum

FRAMES = 8

# It estimates no motion, and misbehaves at the pair (or the frame) whose later stamp is in `when`.
METHOD_THAT_MISBEHAVES = '''
import os, sys, time
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
            time.sleep(3600)
        if self.deed == 'exit':
            sys.exit('no licence found')
        if self.deed == 'raise':
            raise ValueError('no such thing')
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


@pytest.fixture(scope='session', autouse=True)
def methods(tmp_path_factory):
    """Let this process and those of the engine import the methods that misbehave."""
    folder = tmp_path_factory.mktemp('methods')
    (folder / 'misbehaving.py').write_text(METHOD_THAT_MISBEHAVES)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield


@pytest.fixture
def method():
    """Return a function that makes a method that misbehaves."""
    def make(deed='', when=(), at='pair', factory='misbehaving:Still'):
        options = {} if factory != 'misbehaving:Still' else {
            'deed': deed, 'when': when, 'at': at}
        return Method('still', 'Still', 'stands still', factory, options)
    return make


@pytest.fixture
def aick():
    return METHODS['aick-orb-350']
