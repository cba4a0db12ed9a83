# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two processes for the tasks of all tests, and tasks that misbehave."""

import importlib
import logging
import subprocess
import sys
from types import SimpleNamespace

import pytest

DEEDS = '''
import ctypes, os, resource, signal, sys, time
import numpy as np
from aick_ros.errors import InputError

def do(deed):
    if deed == 'abort':
        os.abort()
    if deed == 'exit':
        sys.exit('no licence')
    if deed == 'damaged':
        raise InputError('it is damaged')
    if deed == 'defect':
        return 1 / 0
    if deed == 'sleep':
        time.sleep(3600)
    if deed == 'hang':  # and let no other thread run
        ctypes.PyDLL(None).sleep(3600)
    if deed == 'memory':
        raise MemoryError
    if deed == 'hog':
        hoard = []
        while True:
            hoard.append(bytearray(5_000_000))
            time.sleep(0.01)
    if deed == 'images':  # return the page faults of three, as of each frame
        for _ in range(20):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            images = [np.ones((480, 640), np.float32) for _ in range(3)]
            del images
            faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
        return faults
    if isinstance(deed, tuple):  # once: the process is killed the first time
        if not os.path.exists(deed[1]):
            open(deed[1], 'w').close()
            os.kill(os.getpid(), signal.SIGKILL)
        return 'second'
    return 2 * deed
'''


CLUSTER = '''
from distributed import LocalCluster
with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol='tcp://',
                  dashboard_address=None) as cluster:
    print(cluster.scheduler_address, flush=True)
    input()
'''


@pytest.fixture(scope='session')
def deeds(tmp_path_factory):
    """Return the function that misbehaves, in a module that workers can import."""
    folder = tmp_path_factory.mktemp('modules')
    (folder / 'deeds_of_tasks.py').write_text(DEEDS)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setenv('PYTHONPATH', str(folder), prepend=':')
        yield importlib.import_module('deeds_of_tasks').do
    sys.modules.pop('deeds_of_tasks')


@pytest.fixture(scope='module')
def client(deeds):
    """Return a connection to two processes of this machine."""
    from aick_ros.evaluation.engine.cluster import Cluster, connected
    with connected(Cluster(2, '600MB')) as connection:
        yield connection
    assert logging.getLogger('distributed').propagate


@pytest.fixture(scope='module')
def elsewhere(deeds):
    """Return a process that has a scheduler and a worker, and its address."""
    with subprocess.Popen([sys.executable, '-c', CLUSTER], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        yield SimpleNamespace(process=process, address=process.stdout.readline().strip())
        process.kill()
