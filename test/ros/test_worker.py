# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The worker's thread: one job after the other, and an end that waits for the job at hand."""

import threading
from types import SimpleNamespace

import pytest

from aick_ros.ros.work_queue import WorkQueue
from aick_ros.ros.worker import Worker

PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine


@pytest.fixture
def gate():
    """A gate at which the work stops, and the items worked on."""
    class Gate:
        def __init__(self):
            self.open, self.entered, self.done = (
                threading.Event(), threading.Semaphore(0), [])

        def work(self, item):
            self.entered.release()
            assert self.open.wait(PATIENCE)
            self.done.append(item)

    return Gate()


@pytest.fixture
def start(gate):
    """Start a worker on a queue; return the worker."""
    started = []

    def start(queue, **options):
        started.append(Worker(queue, gate.work, **options))
        started[-1].start()
        return started[-1]

    yield start
    gate.open.set()
    for worker in started:
        worker.stop()


def wait_for_a_task(queue):
    """Wait until the thread has checked its queue once more."""
    done = threading.Event()
    queue.put_task(done.set)
    assert done.wait(PATIENCE)


def do_two(worker, queue):
    """Have a worker do two items."""
    queue.put('first')
    queue.put('second')
    worker.start()
    while queue.backlog:
        wait_for_a_task(queue)
    worker.stop()


def test_items_are_done_in_order(gate, start):
    queue = WorkQueue(capacity=100)
    worker = start(queue)
    for item in range(50):
        queue.put(item)
    gate.open.set()
    for _ in range(50):
        assert gate.entered.acquire(timeout=PATIENCE)
    worker.stop()
    assert gate.done == list(range(50))
    assert queue.dropped == 0


def put_four(queue, gate):
    """Put an item that is worked on, and three that wait for it."""
    queue.put('first')
    assert gate.entered.acquire(timeout=PATIENCE)
    for item in ('second', 'third', 'fourth'):
        queue.put(item)


def test_with_a_capacity_of_one_the_newest_is_next(gate, start):
    queue = WorkQueue(capacity=1)
    worker = start(queue)
    put_four(queue, gate)
    gate.open.set()
    assert gate.entered.acquire(timeout=PATIENCE)
    worker.stop()
    assert gate.done == ['first', 'fourth']


def test_items_wait_until_they_are_ready(gate, start):
    gate.open.set()
    ready, queue = threading.Event(), WorkQueue(capacity=10)
    worker = start(queue, is_ready=lambda item: ready.is_set())
    queue.put('frame')
    wait_for_a_task(queue)
    assert gate.done == []
    ready.set()
    queue.wake()
    assert gate.entered.acquire(timeout=PATIENCE)
    worker.stop()
    assert gate.done == ['frame']


def test_a_task_runs_between_two_items(gate, start):
    queue = WorkQueue(capacity=10)
    worker = start(queue)
    queue.put('first')
    assert gate.entered.acquire(timeout=PATIENCE)
    queue.put('second')
    queue.put_task(lambda: gate.done.append('task'))
    gate.open.set()
    assert gate.entered.acquire(timeout=PATIENCE)
    worker.stop()
    assert gate.done == ['first', 'task', 'second']


def test_stop_waits_for_the_item_at_hand_and_drops_the_others(gate, start):
    queue = WorkQueue(capacity=10)
    worker = start(queue)
    for item in range(5):
        queue.put(item)
    assert gate.entered.acquire(timeout=PATIENCE)
    stopper = threading.Thread(target=worker.stop)
    stopper.start()
    assert stopper.is_alive()
    assert gate.done == []
    queue.close()
    gate.open.set()
    stopper.join(PATIENCE)
    assert not stopper.is_alive()
    assert gate.done == [0]


def test_it_is_drained_once_the_item_at_hand_is_done(gate, start):
    queue = WorkQueue(capacity=10)
    worker = start(queue)
    queue.put('first')
    assert gate.entered.acquire(timeout=PATIENCE)
    queue.put('second')
    drained, seen = threading.Event(), []

    def drain():
        worker.drain()
        seen.extend(gate.done)
        drained.set()

    threading.Thread(target=drain).start()
    assert not drained.wait(0.05)
    gate.open.set()
    assert drained.wait(PATIENCE)
    assert seen == ['first']


def test_a_worker_that_never_started_can_be_stopped(gate):
    Worker(WorkQueue(capacity=1), gate.work).stop()


def test_the_time_at_work_is_counted_and_that_of_waiting_is_not(monkeypatch):
    """By a clock that goes on by three seconds in each item and by nine before it."""
    clock = SimpleNamespace(now=0.0)
    clock.monotonic = lambda: clock.now
    monkeypatch.setattr('aick_ros.ros.worker.time', clock)

    class Slow(WorkQueue):
        def take(self, *arguments):
            job = super().take(*arguments)
            clock.now += 9.0
            return job

    def work(item):
        clock.now += 3.0

    queue = Slow(capacity=10)
    worker = Worker(queue, work)
    assert worker.busy == (0.0,)
    do_two(worker, queue)
    assert worker.busy == (6.0,)


def test_waits_within_the_work_are_no_work(monkeypatch):
    """Of each job's seven seconds five are waits, as for a transform."""
    clock = SimpleNamespace(now=0.0, waited=2.0)
    clock.monotonic = lambda: clock.now
    monkeypatch.setattr('aick_ros.ros.worker.time', clock)

    def work(item):
        clock.now += 7.0
        clock.waited += 5.0

    queue = WorkQueue(capacity=10)
    worker = Worker(queue, work, waited=lambda: clock.waited)
    do_two(worker, queue)
    assert worker.busy == (4.0,)


def test_drained_it_counts_what_is_dropped_anew(gate, start):
    queue = WorkQueue(capacity=1)
    worker = start(queue)
    put_four(queue, gate)
    assert worker.dropped == queue.dropped == 2
    gate.open.set()
    worker.drain()
    assert (worker.dropped, gate.done) == (0, ['first'])


def test_the_thread_has_a_name_and_does_not_keep_the_process_alive(start):
    worker = start(WorkQueue(capacity=1), name='preparation')
    assert (worker._thread.name, worker._thread.daemon) == ('preparation', True)
    assert start(WorkQueue(capacity=1))._thread.name == 'odometry'


def test_a_task_is_done_without_any_item(start):
    worker, done = start(WorkQueue(capacity=1)), threading.Event()
    worker.put_task(done.set)
    assert done.wait(PATIENCE)
