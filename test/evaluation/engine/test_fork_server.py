# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is imported once: the processes have it, of the versions at the start, in one thread."""

import json
import os
import signal
import subprocess
import sys

import pytest

SERVER = '''
import json, os, psutil, sys
from aick_ros.evaluation.engine.fork_server import start_fork_server
before = dict(os.environ)
start_fork_server(['wave', 'no_such_module'])
assert os.environ == before
'''

FACTS = SERVER + '''
from aick_ros.evaluation.engine.cluster import Cluster, connected

def facts():
    import os, sys
    from aick_ros.evaluation.engine.versions import own_versions
    return {'modules': [name for name in ('wave', 'pandas') if name in sys.modules],
            'versions': own_versions.cache_info().currsize, 'parent': os.getppid(),
            'threads': [os.environ['OMP_NUM_THREADS'], os.environ['OPENBLAS_NUM_THREADS']]}

if __name__ == '__main__':
    with connected(Cluster(1, modules=['wave'])) as client:
        [found] = client.run(facts).values()
        server = psutil.Process(found['parent'])
        found['threads of the server'] = server.num_threads()
        found['is forked'] = server.ppid() == os.getpid()
        found['has pandas here'] = 'pandas' in sys.modules
    print(json.dumps(found))
'''


def run(code, **environment):
    """Return the output of a process that has no fork server yet."""
    variables = {name: value for name, value in os.environ.items() if '_NUM_THREADS' not in name}
    return subprocess.run([sys.executable, '-c', code], env={**variables, **environment},
                          check=True, capture_output=True, text=True).stdout


def test_a_process_has_what_was_imported_once_and_the_versions_of_that():
    found = json.loads(run(FACTS, OMP_NUM_THREADS='3'))
    assert found['is forked']
    assert found['modules'] == ['wave']
    assert not found['has pandas here']  # which Dask would import, in a second
    assert found['versions'] == 1
    assert found['threads'] == ['3', '1']  # the user's, and ours
    assert found['threads of the server'] == 1  # or a lock of another would be held for ever


def test_neither_ctrl_c_nor_the_end_of_the_terminal_reaches_the_server():
    blocked = run(SERVER + '''
import signal
assert not signal.pthread_sigmask(signal.SIG_BLOCK, ()) & {signal.SIGINT, signal.SIGHUP}
for process in psutil.Process().children():
    with open(f'/proc/{process.pid}/status') as status:
        print(*[line.split()[1] for line in status if line.startswith('SigBlk')])
''').split()
    assert len(blocked) == 2  # the tracker of resources is the other one
    for mask in blocked:
        for number in (signal.SIGINT, signal.SIGHUP):
            assert int(mask, 16) & 1 << number - 1


@pytest.mark.parametrize('allowed', [4, 6, 8])
def test_a_server_that_cannot_be_started_is_left_to_the_first_process(allowed):
    assert run('import resource\nfrom aick_ros.evaluation.engine.fork_server import *\n'
               f'resource.setrlimit(resource.RLIMIT_NOFILE, ({allowed}, {allowed}))\n'
               'start_fork_server()\nprint("on")').strip() == 'on'
