# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The queue by itself: what is dropped, what is next, what its end means."""

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
