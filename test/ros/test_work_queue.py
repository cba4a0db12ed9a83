# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The queue by itself: what is dropped, what is next, what its end means."""

import threading
from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from aick_ros.ros.work_queue import WorkQueue


def ready(item):
    return True


def do_next(queue, is_ready=ready):
    """Take one job and return what it works on."""
    done = []
    queue.take(done.append, is_ready)()
    return done


def test_the_oldest_are_dropped_for_new_ones():
    queue = WorkQueue(capacity=2)
    for item in 'abcd':
        queue.put(item)
    assert (queue.backlog, queue.dropped) == (2, 2)
    assert do_next(queue) + do_next(queue) == ['c', 'd']


def test_one_more_may_wait_until_one_has_to_be_dropped():
    """Then only the newest waits, until the thread has waited for an item."""
    queue, done = WorkQueue(capacity=1, burst=1), []
    for item in 'ab':
        queue.put(item)
    assert (queue.backlog, queue.dropped) == (2, 0)
    assert do_next(queue) == ['a']
    for item in 'cde':
        queue.put(item)
    assert (queue.backlog, queue.dropped) == (1, 3)
    assert do_next(queue) == ['e']
    for item in 'fg':  # the thread has not waited meanwhile
        queue.put(item)
    assert (queue.backlog, queue.dropped) == (1, 4)
    assert do_next(queue) == ['g']
    with ThreadPoolExecutor(1) as thread:
        taken = thread.submit(queue.take, done.append, ready)
        assert not wait([taken], 0.05).done
        queue.put('h')
        taken.result()()
    for item in 'ij':
        queue.put(item)
    assert (queue.backlog, queue.dropped) == (2, 4)
    assert do_next(queue) + do_next(queue) == ['i', 'j'] and done == ['h']


def test_the_oldest_are_dropped_where_all_are_too_large():
    queue = WorkQueue(capacity=100, size=len, max_bytes=10)
    for item in ('aaaa', 'bbbb', 'cc', 'ddd', 'longer than all'):
        queue.put(item)
        assert queue.backlog_bytes <= 10 or queue.backlog == 1
    assert (queue.backlog, queue.dropped) == (1, 4)
    assert do_next(queue) == ['longer than all']
    assert queue.backlog_bytes == 0


def test_as_many_as_fit_exactly_are_kept():
    queue = WorkQueue(capacity=100, size=len, max_bytes=10)
    for item in ('aaaa', 'bbbbbb'):
        queue.put(item)
    assert (queue.backlog, queue.backlog_bytes, queue.dropped) == (2, 10, 0)


def test_tasks_go_before_items_that_are_not_ready():
    queue, done = WorkQueue(capacity=10), []
    queue.put('frame')
    queue.put_task(lambda: done.append('task'))
    queue.take(done.append, lambda item: False)()
    assert done == ['task']
    assert queue.backlog == 1


def test_a_closed_queue_gives_nothing_however_much_waits():
    queue = WorkQueue(capacity=10)
    queue.put('frame')
    queue.put_task(lambda: None)
    queue.close()
    assert queue.take(print, ready) is None


def test_cleared_it_keeps_its_tasks_only():
    queue, done = WorkQueue(capacity=2, size=len), []
    for item in 'abc':
        queue.put(item)
    queue.put_task(lambda: done.append('task'))
    queue.clear()
    assert (queue.backlog, queue.backlog_bytes, queue.dropped) == (0, 0, 0)
    queue.put('d')
    assert do_next(queue) == []
    assert done == ['task']
    assert do_next(queue) == ['d']


def test_only_a_queue_of_one_keeps_the_newest():
    assert WorkQueue(capacity=1).keeps_newest
    assert not WorkQueue(capacity=2).keeps_newest


def test_sizes_are_subtracted_for_what_is_taken_and_what_is_dropped():
    queue = WorkQueue(capacity=2, size=len)
    for item in ('a', 'bb', 'cccc'):
        queue.put(item)
    assert queue.backlog_bytes == 6
    assert do_next(queue) == ['bb']
    assert (queue.backlog_bytes, queue.backlog, queue.dropped) == (4, 1, 1)


def test_items_without_a_size_have_none():
    queue = WorkQueue(capacity=3)
    queue.put('frame')
    assert (queue.backlog, queue.backlog_bytes) == (1, 0)


def test_only_as_many_are_dropped_as_must_be():
    queue = WorkQueue(capacity=100, size=len, max_bytes=10)
    for item in ('aaa', 'bbb', 'ccc', 'dddd'):
        queue.put(item)
    assert (queue.backlog, queue.dropped, queue.backlog_bytes) == (3, 1, 10)


def test_tasks_are_done_in_order():
    queue, done = WorkQueue(capacity=1), []
    for number in range(3):
        queue.put_task(lambda number=number: done.append(number))
    for _ in range(3):
        queue.take(done.append, ready)()
    assert done == [0, 1, 2]


def test_it_is_the_oldest_item_that_must_be_ready():
    queue, asked = WorkQueue(capacity=10), []
    for item in 'ab':
        queue.put(item)
    assert do_next(queue, lambda item: asked.append(item) or True) == ['a']
    assert asked == ['a']


@pytest.mark.parametrize('event', ['put', 'put_task', 'wake', 'close'])
def test_who_waits_is_woken_by_whatever_may_end_the_wait(event):
    queue, done, is_ready = WorkQueue(capacity=10), [], threading.Event()
    if event == 'wake':
        queue.put('frame')
    with ThreadPoolExecutor(1) as thread:
        taken = thread.submit(queue.take, done.append, lambda item: is_ready.is_set())
        assert not wait([taken], 0.05).done
        is_ready.set()
        {'put': lambda: queue.put('frame'), 'put_task': lambda: queue.put_task(print),
         'wake': queue.wake, 'close': queue.close}[event]()
        try:
            job = taken.result(30.0)
        finally:
            queue.close()
    assert (job is None) is (event == 'close')
    assert job is print if event == 'put_task' else True
    if event in ('put', 'wake'):
        job()
        assert done == ['frame']
