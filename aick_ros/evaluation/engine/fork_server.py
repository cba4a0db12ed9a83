# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The process that forks the processes of this machine, with all that they import."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import forkserver

from aick_ros.borders.threads import ONE_THREAD
from aick_ros.evaluation.engine.terminal import unreached_by_the_terminal

_BEFORE_TASKS = ('distributed.nanny', 'distributed.http.worker', f'{__package__}.silence')
_LAST = f'{__package__}.forked'


def start_fork_server(modules: Sequence[str] = ()) -> None:
    """
    Start the process that forks others, unless it runs; it imports while this one goes on.

    What it forks starts in 0.1 s, also in place of a process that was lost. It ends with this
    process.

    :param modules: of the tasks.
    """
    forkserver.set_forkserver_preload([*_BEFORE_TASKS, *modules, _LAST])
    # where it cannot be started, the first process fails for the same reason, and says so
    with suppress(OSError), unreached_by_the_terminal(), _in_the_environment(ONE_THREAD):
        forkserver.ensure_running()


@contextmanager
def _in_the_environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables for processes that the block starts, but for those that the user has set."""
    added = {name: value for name, value in values.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
