# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Settings and signals around a cluster, which test_tasks has at work."""

import logging
import multiprocessing
import resource
import signal
import threading
import time

import dask
import distributed
import pytest

from aick_ros.borders.threads import ONE_THREAD
from aick_ros.errors import InputError
from aick_ros.evaluation.engine import cluster as cluster_module
from aick_ros.evaluation.engine.cluster import Cluster, connected


class Enough(Exception):
    """What is to be seen has been seen."""


@pytest.fixture
def asked(monkeypatch):
    """Return what a local cluster is asked for, with Dask's settings and the blocked signals."""
    seen = {}

    def start(**options):
        seen.update(options, config=dask.config.get, blocked=signal.pthread_sigmask(
            signal.SIG_BLOCK, ()), sigterm=signal.getsignal(signal.SIGTERM),
            saturation=dask.config.get('distributed.scheduler.worker-saturation'),
            folder=dask.config.get('temporary-directory'),
            environment=dask.config.get('distributed.nanny.pre-spawn-environ'),
            failures=dask.config.get('distributed.scheduler.allowed-failures'))
        raise Enough
    monkeypatch.setattr(distributed, 'LocalCluster', start)
    return seen


def start(cluster):
    with pytest.raises(InputError, match='cannot be started'), connected(cluster):
        pytest.fail('it goes on')


def test_processes_that_do_not_all_start_are_ended(monkeypatch):
    """Dask leaves them, and prints a line for each at exit."""
    context = multiprocessing.get_context('fork')
    mine = context.Process(target=time.sleep, args=(60,))
    mine.start()
    started = []

    def start_one(**options):
        started.append(context.Process(target=time.sleep, args=(60,)))
        started[0].start()
        raise OSError('no other')
    monkeypatch.setattr(distributed, 'LocalCluster', start_one)
    try:
        start(Cluster(2))
        assert started[0].exitcode == -signal.SIGKILL
        assert mine.is_alive()
    finally:
        mine.kill()
        mine.join()


@pytest.mark.parametrize('has_dashboard', [False, True])
def test_processes_are_those_that_are_asked_for(asked, has_dashboard, tmp_path):
    before = dask.config.get('distributed.scheduler.worker-saturation')
    with dask.config.set({'temporary-directory': str(tmp_path)}):
        start(Cluster(3, '700MB', has_dashboard=has_dashboard))
    assert (asked['n_workers'], asked['threads_per_worker'], asked['processes']) == (3, 1, True)
    assert asked['memory_limit'] == '700MB'
    assert asked['host'] == '127.0.0.1'
    assert asked['dashboard_address'].startswith('127.0.0.1:')
    assert asked['scheduler_kwargs'] == {'dashboard': has_dashboard}
    assert asked['preload'] == ['aick_ros.evaluation.engine.silence']
    assert asked['folder'].startswith(f'{tmp_path}/')
    assert (asked['saturation'], asked['failures'], asked['environment']) == (1.0, 0, ONE_THREAD)
    assert set(ONE_THREAD.values()) == {'1'} and 'OPENBLAS_NUM_THREADS' in ONE_THREAD
    assert dask.config.get('distributed.scheduler.worker-saturation') == before


def test_signals_are_as_before_after_it(asked):
    mask, handler = signal.pthread_sigmask(signal.SIG_BLOCK, ()), signal.getsignal(signal.SIGTERM)
    start(Cluster(1))
    assert asked['blocked'] >= {signal.SIGINT, signal.SIGHUP}
    assert signal.SIGTERM not in asked['blocked']
    assert asked['sigterm'] is not handler
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == mask
    assert signal.getsignal(signal.SIGTERM) is handler


def test_it_may_be_started_from_another_thread(asked):
    errors = []

    def run():
        try:
            start(Cluster(1))
        except BaseException as error:
            errors.append(error)
    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert errors == [] and asked['n_workers'] == 1


@pytest.mark.parametrize('workers, allowed, is_enough', [
    (1, 64, True), (1, 63, False), (10, 208, True), (10, 207, False),
    (1000, resource.RLIM_INFINITY, True)])
def test_each_process_requires_sixteen_files_beside_the_first_48(
        asked, monkeypatch, workers, allowed, is_enough):
    monkeypatch.setattr(cluster_module.resource, 'getrlimit', lambda kind: (
        (allowed if kind == resource.RLIMIT_NOFILE else resource.RLIM_INFINITY, 10 ** 6)))
    if is_enough:
        start(Cluster(workers))
        assert asked['n_workers'] == workers
    else:
        required = allowed + 1
        with pytest.raises(InputError, match=f'^{allowed} open files are allowed, {workers} '
                           f'processes require {required}: .*ulimit -n {required}'):
            with connected(Cluster(workers)):
                pytest.fail('it goes on')
        assert asked == {}


@pytest.mark.parametrize('workers, count', [(1, '1 process'), (6, '6 processes')])
@pytest.mark.parametrize('allowed, remedy', [
    (1_500_000_000,
     'raise the limit to the memory of each, now 1500 MB (ulimit -v), or use fewer'),
    (resource.RLIM_INFINITY, "use fewer, free memory, raise limits (ulimit -a), or correct Dask's "
                             'settings (DASK_*)')])
def test_a_limit_to_the_memory_is_named_where_processes_do_not_start(
        asked, monkeypatch, workers, count, allowed, remedy):
    limits = {resource.RLIMIT_AS: allowed, resource.RLIMIT_NOFILE: 10 ** 6}
    monkeypatch.setattr(cluster_module.resource, 'getrlimit', lambda kind: (
        limits.get(kind, resource.RLIM_INFINITY), resource.RLIM_INFINITY))
    with pytest.raises(InputError) as raised, connected(Cluster(workers)):
        pytest.fail('it goes on')
    assert str(raised.value) == f'{count} cannot be started ({Enough()}): {remedy}'


@pytest.mark.parametrize('propagates', [False, True])
def test_dask_is_silent_during_the_block_alone(asked, monkeypatch, propagates, capfd):
    logger = logging.getLogger('distributed')
    monkeypatch.setattr(logger, 'propagate', propagates)
    monkeypatch.setattr(logger, 'handlers', [logging.StreamHandler()])
    before = logger.handlers[:]

    def start_loudly(**options):
        logger.error('something is odd')
        raise Enough
    monkeypatch.setattr(distributed, 'LocalCluster', start_loudly)
    start(Cluster(1))
    assert (logger.handlers, logger.propagate) == (before, propagates)
    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('address', [
    '', 'tcp://', 'host', 'tcp://host', 'tcp://host:0', 'tcp://:8786', 'tcp://host:65536',
    'tcp://host:-1', 'tcp://host:x', 'tcp://host:1:', 'inproc://x'])
def test_an_address_at_which_no_scheduler_can_be_is_not_asked(monkeypatch, address):
    monkeypatch.setattr(distributed, 'Client', lambda *args, **options: pytest.fail('it is asked'))
    with pytest.raises(InputError, match=rf"^the scheduler '{address}' has no host, or no port"):
        with connected(Cluster(1, scheduler=address)):
            pytest.fail('it goes on')


@pytest.mark.parametrize('address', ['host:1', 'tls://host:65535', 'tcp://[::1]:8786/'])
def test_any_kind_of_address_is_asked(monkeypatch, address):
    asked = []

    def client(address, timeout):
        asked.append(address)
        raise OSError('refused')
    monkeypatch.setattr(distributed, 'Client', client)
    with pytest.raises(InputError, match='does not answer'):
        with connected(Cluster(1, scheduler=address)):
            pytest.fail('it goes on')
    assert asked == [address]


@pytest.mark.parametrize('error', [OSError('refused'), TimeoutError('late'), ValueError('odd'),
                                   TypeError('without TLS')])
def test_a_scheduler_that_cannot_be_asked_is_named(monkeypatch, error):
    calls = []

    def client(address, timeout):
        calls.append((address, timeout))
        raise error
    monkeypatch.setattr(distributed, 'Client', client)
    with pytest.raises(InputError, match=rf'^the scheduler tcp://x:1 does not answer \({error}\)'):
        with connected(Cluster(1, scheduler='tcp://x:1')):
            pytest.fail('it goes on')
    assert calls == [('tcp://x:1', 10.0)]
