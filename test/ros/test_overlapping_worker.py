# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two threads, one ahead of the other: what overlaps, what is replaced, and in which order."""

import threading
import time
from types import SimpleNamespace

import pytest

from aick_ros.ros.overlapping_worker import OverlappingWorker
from aick_ros.ros.work_queue import WorkQueue

PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine


class Rig:
    """A worker whose second half stops at a gate; both halves record what they did."""

    def __init__(self, capacity, **options):
        self.queue = WorkQueue(capacity)
        self.prepared, self.entered, self.gate = (threading.Semaphore(0) for _ in range(3))
        self.log, self.done = [], []
        self.worker = OverlappingWorker(self.queue, self.prepare, self.work, **options)
        self.worker.start()

    def prepare(self, item):
        self.log.append(item)
        self.prepared.release()
        return None if item == 'useless' else f'prepared {item}'

    def work(self, prepared):
        self.entered.release()
        assert self.gate.acquire(timeout=PATIENCE)
        self.done.append(prepared)

    def await_preparation(self):
        """Wait until another item was prepared, and the thread has checked its queue again."""
        assert self.prepared.acquire(timeout=PATIENCE)
        self.settle()

    def settle(self):
        checked = threading.Event()
        self.queue.put_task(checked.set)
        assert checked.wait(PATIENCE)

    def begin(self, *items):
        """Put items, and return once the first one is at the gate."""
        for item in items:
            self.queue.put(item)
        assert self.entered.acquire(timeout=PATIENCE)

    def finish(self, count):
        """Open the gate for some items, and return once they are done."""
        for _ in range(count):
            self.gate.release()
        done = threading.Event()
        for _ in range(count - 1):
            assert self.entered.acquire(timeout=PATIENCE)
        self.worker.put_task(done.set)
        assert done.wait(PATIENCE)


@pytest.fixture
def make():
    made = []

    def make(capacity, **options):
        made.append(Rig(capacity, **options))
        return made[-1]

    yield make
    for rig in made:
        for _ in range(100):
            rig.gate.release()
        rig.worker.stop()


def test_one_item_is_prepared_while_the_one_before_is_worked_on(make):
    rig = make(capacity=100)
    rig.begin('a', 'b', 'c', 'd')
    for _ in 'ab':
        rig.await_preparation()
    assert rig.log == ['a', 'b']  # and no more: b waits
    assert (rig.done, rig.queue.backlog) == ([], 2)
    rig.finish(4)
    assert rig.done == ['prepared a', 'prepared b', 'prepared c', 'prepared d']
    assert rig.worker.dropped == 0


def test_where_the_newest_counts_it_replaces_the_one_that_is_prepared(make):
    rig = make(capacity=1)
    rig.begin('a')
    rig.await_preparation()
    for item in 'bcd':
        rig.queue.put(item)
        rig.await_preparation()
    rig.finish(2)
    assert rig.done == ['prepared a', 'prepared d']
    assert rig.worker.dropped == 2


def test_what_cannot_be_used_is_not_worked_on(make):
    rig = make(capacity=100)
    rig.begin('useless', 'a')
    rig.finish(1)
    assert (rig.log, rig.done) == (['useless', 'a'], ['prepared a'])


def test_a_task_goes_before_an_item_that_is_prepared(make):
    rig = make(capacity=100)
    rig.begin('a', 'b')
    for _ in 'ab':
        rig.await_preparation()
    rig.worker.put_task(lambda: rig.done.append('task'))
    rig.finish(2)
    assert rig.done == ['prepared a', 'task', 'prepared b']


def test_drained_nothing_waits_any_more_in_either_half(make):
    rig = make(capacity=100)
    rig.begin('a', 'b', 'c')
    for _ in 'ab':
        rig.await_preparation()
    drained = threading.Event()
    thread = threading.Thread(target=lambda: (rig.worker.drain(), drained.set()))
    thread.start()
    while rig.queue.backlog or rig.worker._ahead.backlog:
        time.sleep(1e-3)
    assert not drained.is_set()
    rig.gate.release()
    assert drained.wait(PATIENCE)
    thread.join()
    assert rig.done == ['prepared a']
    rig.begin('d')
    rig.finish(1)
    assert rig.done == ['prepared a', 'prepared d']


def test_stop_waits_for_both_halves(make):
    rig = make(capacity=100)
    rig.begin('a', 'b')
    rig.await_preparation()
    stopper = threading.Thread(target=rig.worker.stop)
    stopper.start()
    stopper.join(0.05)
    assert stopper.is_alive() and rig.done == []
    rig.gate.release()
    rig.gate.release()
    stopper.join(PATIENCE)
    assert not stopper.is_alive()
    assert rig.done[0] == 'prepared a'


@pytest.mark.parametrize('capacity', [1, 100])
def test_an_item_waits_until_it_is_ready(make, capacity):
    ready = threading.Event()
    rig = make(capacity, is_ready=lambda item: item == 'a' and ready.is_set())
    rig.queue.put('a')
    rig.settle()
    assert rig.log == []
    ready.set()
    rig.queue.wake()
    rig.await_preparation()
    rig.finish(1)
    assert rig.done == ['prepared a']


def test_the_time_of_each_thread_is_given_first_that_of_the_preparation(monkeypatch):
    """By a clock that goes on by two seconds in the first half, and by three in the second."""
    clock = threading.local()  # each thread has its own
    monkeypatch.setattr('aick_ros.ros.worker.time', SimpleNamespace(
        monotonic=lambda: getattr(clock, 'now', 0.0)))
    done = threading.Semaphore(0)

    def prepare(item):
        clock.now = getattr(clock, 'now', 0.0) + 2.0
        return item

    def work(item):
        clock.now = getattr(clock, 'now', 0.0) + 3.0
        done.release()

    queue = WorkQueue(capacity=100)
    worker = OverlappingWorker(queue, prepare, work)
    assert worker.busy == (0.0, 0.0)
    worker.start()
    assert {'preparation', 'odometry'} <= {thread.name for thread in threading.enumerate()}
    for item in 'ab':
        queue.put(item)
        assert done.acquire(timeout=PATIENCE)
    worker.stop()
    assert worker.busy == (4.0, 6.0)


def test_what_both_halves_drop_is_counted_until_it_is_drained(make):
    rig = make(capacity=1)
    rig.begin('a')
    rig.await_preparation()
    for item in 'bc':  # c takes the place of b, which was prepared
        rig.queue.put(item)
        rig.await_preparation()
    rig.worker._first._queue.dropped += 4
    assert rig.worker.dropped == 5
    for _ in 'ac':  # c may be taken before it is dropped
        rig.gate.release()
    rig.worker.drain()
    assert rig.worker.dropped == 0
