# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The worker's thread: order, newest only, readiness, errands."""

import threading

import pytest

from aick_ros.ros.worker import Worker


@pytest.fixture
def gate():
    """A gate at which the work stops, and what was worked on."""
    class Gate:
        def __init__(self):
            self.open, self.entered, self.done = (
                threading.Event(), threading.Semaphore(0), [])

        def work(self, item):
            self.entered.release()
            assert self.open.wait(5)
            self.done.append(item)

    return Gate()


def drain(worker):
    """Wait until the thread has looked at its queue once more."""
    done = threading.Event()
    worker.run(done.set)
    assert done.wait(5)


def test_every_item_in_order(gate):
    worker = Worker(gate.work, capacity=100)
    for item in range(50):
        worker.put(item)
    gate.open.set()
    for _ in range(50):
        assert gate.entered.acquire(timeout=5)
    worker.stop(5)
    assert gate.done == list(range(50))
    assert worker.dropped == 0


def test_with_room_for_one_the_newest_is_next(gate):
    worker = Worker(gate.work, capacity=1)
    worker.put('first')
    assert gate.entered.acquire(timeout=5)  # at work on the first
    for item in ('second', 'third', 'fourth'):
        worker.put(item)
    assert worker.backlog == 1
    gate.open.set()
    assert gate.entered.acquire(timeout=5)
    worker.stop(5)
    assert gate.done == ['first', 'fourth']
    assert worker.dropped == 2


def test_the_oldest_go_where_those_that_wait_are_too_large(gate):
    worker = Worker(gate.work, capacity=100, size=len, max_bytes=10)
    worker.put('at work')
    assert gate.entered.acquire(timeout=5)
    for item in ('aaaa', 'bbbb', 'cc', 'ddd', 'longer than all'):
        worker.put(item)
        assert worker.backlog_bytes <= 10 or worker.backlog == 1
    assert (worker.backlog, worker.dropped) == (1, 4)
    gate.open.set()
    assert gate.entered.acquire(timeout=5)
    worker.stop(5)
    assert gate.done == ['at work', 'longer than all']
    assert worker.backlog_bytes == 0


def test_items_wait_until_they_are_ready(gate):
    gate.open.set()
    ready = threading.Event()
    worker = Worker(gate.work, capacity=10, ready=lambda item: ready.is_set())
    worker.put('frame')
    drain(worker)
    assert gate.done == []
    ready.set()
    worker.nudge()
    assert gate.entered.acquire(timeout=5)
    worker.stop(5)
    assert gate.done == ['frame']


def test_an_errand_runs_between_two_items(gate):
    worker = Worker(gate.work, capacity=10)
    worker.put('first')
    assert gate.entered.acquire(timeout=5)
    worker.put('second')
    worker.run(lambda: gate.done.append('errand'))
    gate.open.set()
    assert gate.entered.acquire(timeout=5)
    worker.stop(5)
    assert gate.done == ['first', 'errand', 'second']


def test_stop_does_not_wait_for_what_is_queued(gate):
    worker = Worker(gate.work, capacity=10)
    for item in range(5):
        worker.put(item)
    assert gate.entered.acquire(timeout=5)
    stopper = threading.Thread(target=worker.stop, args=(5,))
    stopper.start()
    gate.open.set()
    stopper.join(5)
    assert not stopper.is_alive()
    assert len(gate.done) < 5
