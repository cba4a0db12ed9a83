# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fixtures for all tests: recordings of real cameras, and ROS without neighbours."""

import fcntl
import gc
import importlib.util
import itertools
import os
import pickle
import signal
import socket
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from pathlib import Path

import hypothesis
import pytest

from aick_ros.evaluation.benchmark import dead_reckoning
from aick_ros.evaluation.engine.scratch_folder import scratch_folder
from aick_ros.sources.synthetic import renderer, source
from aick_ros.sources.synthetic.atlas import Atlas
from aick_ros.sources.synthetic.corridor import corridor
from aick_ros.sources.synthetic.room import furnished_room

ROOT = Path(__file__).parents[1]
LONGEST_FIRST = (
    'test_lint.py', 'test_fuzz.py', 'test_colcon.py', 'test_lifecycle.py', 'test_replay.py',
    'test_drop_in.py', 'test_odom_node.py', 'test_inputs.py', 'test_control.py', 'test_source.py',
    'test_benchmark.py')
DOMAINS = 101  # the ports of higher ones are those the system hands out to clients

_turns = itertools.count(7 * os.getpid())

# nohup and background jobs hand on an ignored SIGINT, and so would the programs under test
signal.signal(signal.SIGINT, signal.default_int_handler)

# the same examples in each run, however slow the machine
hypothesis.settings.register_profile(
    'aick', deadline=None, derandomize=True, database=None, max_examples=100,
    suppress_health_check=[hypothesis.HealthCheck.too_slow])
hypothesis.settings.load_profile('aick')


@pytest.fixture
def terminal():
    """Have programs end with their terminal, where the tests run after nohup, too."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def pytest_configure(config):
    """Make the folder of scenes of all processes of this run; those of killed runs go."""
    if 'PYTEST_XDIST_WORKER' not in os.environ:
        stack = ExitStack()
        config.add_cleanup(stack.close)
        os.environ['AICK_ROS_SCENES'] = str(stack.enter_context(scratch_folder()))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep the thousands of tests, which stay, out of all that the garbage collector looks at."""
    gc.disable()
    collected = yield
    gc.freeze()
    gc.enable()
    return collected


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Have each process read other files first: what one has compiled, the others find."""
    report = yield
    if isinstance(collector, pytest.Dir) and hasattr(collector.config, 'workerinput'):
        process = int(collector.config.workerinput['workerid'].removeprefix('gw'))
        share = process / collector.config.workerinput['workercount']
        first = round(share * len(report.result))
        report.result = report.result[first:] + report.result[:first]
    return report


def pytest_collection_modifyitems(items):
    """
    Put the longest files first: at the end no process works while the others have finished.

    Those of the node, which wait more than they compute, are evenly among the others.
    """
    order = {name: rank for rank, name in enumerate(LONGEST_FIRST)}
    files = sorted({item.path for item in items},
                   key=lambda path: (order.get(path.name, len(order)), path))
    of_node = [path for path in files if ROOT / 'test' / 'ros' in path.parents]
    others = [path for path in files if path not in of_node]
    place = {path: number / len(part) for part in (of_node, others)
             for number, path in enumerate(part)}
    items.sort(key=lambda item: (place[item.path], item.path))


def built_once(build):
    """Return the function, whose scenes the first process that asks builds for all."""
    @lru_cache(maxsize=3)
    def scene(*arguments):
        name = '_'.join([build.__name__, *map(str, arguments)])
        with Path(os.environ['AICK_ROS_SCENES'], name).open('a+b') as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            if not os.fstat(file.fileno()).st_size:
                file.write(pickle.dumps(build(*arguments)))
            file.seek(0)
            return pickle.load(file)
    return scene


furnished_once = built_once(furnished_room)


@pytest.fixture(scope='session', autouse=True)
def scenes_are_built_once():
    """Keep scenes and their textures: to build a room takes as long as to render 30 frames."""
    packed = lru_cache(maxsize=3)(Atlas)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(source, 'furnished_room', furnished_once)
        patch.setattr(dead_reckoning, 'corridor', built_once(corridor))
        patch.setattr(renderer, 'Atlas', lambda surfaces: packed(tuple(surfaces)))
        yield


@pytest.fixture(scope='session')
def room():
    """Return the function that gives the room of a seed."""
    return furnished_once


@pytest.fixture(scope='session')
def load():
    """Return a function from the path of a script in benchmarks/, no package, to its module."""
    def load_script(path: Path):
        before = set(sys.modules)
        sys.path.insert(0, str(path.parent))
        try:
            spec = importlib.util.spec_from_file_location(path.stem, path)
            module = importlib.util.module_from_spec(spec)
            sys.modules[path.stem] = module  # dataclasses look their module up
            spec.loader.exec_module(module)
        finally:
            sys.path.remove(str(path.parent))
            for name in set(sys.modules) - before:  # other scripts have neighbours of these names
                if getattr(sys.modules[name], '__file__', None) == str(path.parent / f'{name}.py'):
                    del sys.modules[name]
        return module
    return load_script


@pytest.fixture
def tum_folder():
    """Return a function from the name of a TUM sequence to its folder; it skips where none is."""
    def find(name):
        if 'AICK_DATA' not in os.environ:
            pytest.skip('no recordings: AICK_DATA names no folder with TUM sequences')
        folder = Path(os.environ['AICK_DATA'], name)
        if not folder.is_dir():
            pytest.skip(f'no recording: {folder} is not there')
        return folder
    return find


@pytest.fixture
def ros_domain(monkeypatch):
    """
    Give ROS, here and in processes started from here, a domain and a profile of this test's own.

    It returns the domain. Nothing leaves this machine, and images are not lost.
    """
    with own_domain() as domain:
        set_domain(monkeypatch, domain)
        yield domain


@pytest.fixture(scope='module')
def ros_context():
    """Return a context of ROS in such a domain for all tests of a file: to make one takes time."""
    import rclpy
    context = rclpy.Context()
    with own_domain() as domain, pytest.MonkeyPatch.context() as monkeypatch:
        set_domain(monkeypatch, domain)
        rclpy.init(args=[], context=context)
        yield context
        rclpy.shutdown(context=context)


def set_domain(monkeypatch, domain):
    """Have ROS use a domain, and the profile for images: Fast DDS reads it once a process."""
    from aick_ros.ros.process.resources import profiles_variable
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv(profiles_variable(), str(ROOT / 'config' / 'fastdds.xml'))


@contextmanager
def own_domain():
    """
    Hold a domain that no other test run on this machine has, and nobody else listens in.

    Cameras of two tests in one domain would take each other's nodes for their own.
    """
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        domain = 1 + next(_turns) % DOMAINS
        with (Path(tempfile.gettempdir()) / f'aick_ros_domain_{domain}').open('a') as claim:
            try:
                fcntl.flock(claim, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if is_free(domain):
                yield domain
                return
    pytest.fail(f'all {DOMAINS} domains of ROS are in use')


def is_free(domain):
    """Return whether the port of the first participant in a domain is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(('', 7410 + 250 * domain))  # as the DDS interoperability protocol says
        except OSError:
            return False
    return True
