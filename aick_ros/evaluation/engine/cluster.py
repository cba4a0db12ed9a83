# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Connection to the processes that run tasks: of this machine, or of a cluster."""

from __future__ import annotations

import logging
import re
import resource
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from multiprocessing import active_children
from typing import TYPE_CHECKING

from aick_ros.borders.threads import ONE_THREAD
from aick_ros.errors import InputError
from aick_ros.evaluation.engine import silence
from aick_ros.evaluation.engine.fork_server import start_fork_server
from aick_ros.evaluation.engine.requirements import check_dask
from aick_ros.evaluation.engine.scratch_folder import scratch_folder
from aick_ros.evaluation.engine.terminal import OF_THE_TERMINAL, unreached_by_the_terminal

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

_CONNECTION_LIMIT = 10.0  # [s] for a scheduler to answer, or to come back; chosen
_LAST_PORT = 65535  # by definition
_FILES, _FILES_PER_PROCESS = 48, 16  # measured: 33 to 48 with one process; chosen above that

_SETTINGS = {
    'distributed.scheduler.allowed-failures': 0,  # who asked for the task decides on another try
    'distributed.scheduler.worker-saturation': 1.0,  # tasks wait here, not on a process that dies
    'distributed.scheduler.no-workers-timeout': '5 minutes',
    # Dask gives up a process that restarts so long after it was lost, even if for another reason
    'distributed.deploy.lost-worker-timeout': '1000 days',
    'distributed.worker.memory.spill': False,  # results are small, images are not theirs
    'distributed.worker.memory.target': False,
    'distributed.worker.memory.pause': False,
    'distributed.admin.tick.interval': '1s',  # a watch over delays, 50 times a second by default
    'distributed.worker.profile.enabled': False,  # it would take part of the measured times
    'distributed.worker.multiprocessing-method': 'forkserver',  # a process starts in 0.1 s
    'distributed.nanny.pre-spawn-environ': ONE_THREAD,
}


@dataclass(frozen=True)
class Cluster:
    """
    Where tasks run.

    :param workers: number of processes on this machine; ignored with a scheduler.
    :param memory_limit: of each of them, as Dask reads it: 2GB, or auto for an equal share.
    :param scheduler: address of the scheduler of an existing cluster; None: this machine.
    :param has_dashboard: serve Dask's pages about the tasks on this machine.
    :param modules: of the tasks, imported once for all processes of this machine.
    """

    workers: int
    memory_limit: str = 'auto'
    scheduler: str | None = None
    has_dashboard: bool = False
    modules: Sequence[str] = ()


@contextmanager
def connected(cluster: Cluster) -> Iterator[Client]:
    """
    Connect to a cluster while the block runs; processes of this machine end with it.

    :raises InputError: where Dask cannot be used, or the scheduler does not answer.
    """
    check_dask()
    import dask
    from distributed import Client
    with _quiet(), dask.config.set(_SETTINGS):
        if cluster.scheduler is None:
            with _own_processes(cluster) as client:
                yield client
            return
        _check_address(cluster.scheduler)
        try:
            client = Client(cluster.scheduler, timeout=_CONNECTION_LIMIT)
        except Exception as error:  # also of kinds of addresses that need settings or packages
            raise InputError(f'the scheduler {cluster.scheduler} does not answer ({error}): start '
                             'one with "dask scheduler"') from None
        with client:
            yield client


def _check_address(scheduler: str) -> None:
    """Raise InputError where an address has no host and port; Dask would wait for an answer."""
    address = re.fullmatch(r'([a-z]+://)?[^/]+:([0-9]{1,5})/?', scheduler)
    if address is None or not 0 < int(address[2]) <= _LAST_PORT:
        raise InputError(f'the scheduler {scheduler!r} has no host, or no port from 1 to '
                         f'{_LAST_PORT}: write tcp://HOST:PORT')


@contextmanager
def _own_processes(cluster: Cluster) -> Iterator[Client]:
    import dask
    from distributed import Client, utils
    _check_files(cluster.workers)
    start_fork_server(cluster.modules)
    utils._forkserver_preload_set = True  # to a list with pandas, which no process here needs
    parent = dask.config.get('temporary-directory', None)
    parent = None if parent is None else str(parent)  # any YAML
    with unreached_by_the_terminal(), scratch_folder(parent) as folder, dask.config.set(
            {'temporary-directory': str(folder)}), ExitStack() as stack:
        with _sigterm_delayed():
            processes = stack.enter_context(_local_cluster(cluster))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, OF_THE_TERMINAL)
        with Client(processes) as client:
            yield client


def _local_cluster(cluster: Cluster) -> LocalCluster:
    from distributed import LocalCluster
    before = set(active_children())
    try:
        return LocalCluster(
            n_workers=cluster.workers, threads_per_worker=1, processes=True, host='127.0.0.1',
            memory_limit=cluster.memory_limit, silence_logs=logging.CRITICAL,
            preload=[silence.__name__], dashboard_address='127.0.0.1:0',
            scheduler_kwargs={'dashboard': cluster.has_dashboard})
    except Exception as error:  # nearly anything, also of Dask's settings
        for child in set(active_children()) - before:  # which Dask leaves, and reports at exit
            child.kill()
            child.join()
        count = f'{cluster.workers} process{"es" if cluster.workers > 1 else ""}'
        raise InputError(f'{count} cannot be started ({error}): {_remedy()}') from None


def _remedy() -> str:
    """Return what to do where processes do not start; Dask does not know why."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_AS)
    if allowed != resource.RLIM_INFINITY:
        return (f'raise the limit to the memory of each, now {allowed // 10 ** 6} MB (ulimit -v), '
                'or use fewer')
    return "use fewer, free memory, raise limits (ulimit -a), or correct Dask's settings (DASK_*)"


def _check_files(workers: int) -> None:
    """Raise InputError where Dask would find too few descriptors; asyncio then prints lines."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    required = _FILES + _FILES_PER_PROCESS * workers
    if allowed != resource.RLIM_INFINITY and allowed < required:
        raise InputError(f'{allowed} open files are allowed, {workers} processes require '
                         f'{required}: raise the limit (ulimit -n {required})')


@contextmanager
def _sigterm_delayed() -> Iterator[None]:
    """
    Handle SIGTERM after the block: processes that are ended while they start leave a traceback.

    It is not blocked, as processes that the block starts would have it blocked too. Where they
    receive it themselves, the block fails, and was interrupted.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: received.append(number))
    try:
        yield
    except Exception:
        if received:
            raise KeyboardInterrupt from None
        raise
    finally:
        signal.signal(signal.SIGTERM, before)
        if received:
            signal.raise_signal(signal.SIGTERM)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's messages from the terminal."""
    logger = logging.getLogger('distributed')
    before = logger.handlers[:], logger.propagate
    logger.handlers, logger.propagate = [logging.NullHandler()], False
    try:
        yield
    finally:
        logger.handlers, logger.propagate = before
