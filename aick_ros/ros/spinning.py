# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A node whose callbacks are done on a thread of its own."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


@contextmanager
def spinning(node: Node) -> Iterator[Future[None]]:
    """
    Do the callbacks of a node for the length of a block, after which it is destroyed.

    An error of a callback is raised after the block.

    :returns: done as soon as no more callbacks are, after an error of one.
    """
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with ThreadPoolExecutor(1) as thread:
        spin = thread.submit(_spin, executor)
        try:
            yield spin
        finally:
            executor.shutdown()
            wait([spin])
            node.destroy_node()
    spin.result()


def _spin(executor: SingleThreadedExecutor) -> None:
    try:
        executor.spin()
    except ExternalShutdownException:
        pass
