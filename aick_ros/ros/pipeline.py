# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""From images to odometry: what the node does between its topics."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable
from functools import partial
from typing import NamedTuple, TypeVar

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.timer import Timer

from aick_ros.borders import no_memory
from aick_ros.borders.allocator import release_freed_memory
from aick_ros.errors import InputError
from aick_ros.messages.synchronizer import Pair
from aick_ros.registration.preparation import Preparation
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.image_stream import ImageStream
from aick_ros.ros.input.assembler import Arrival, FrameAssembler
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.guess import Guess
from aick_ros.ros.input.imu import ImuInput
from aick_ros.ros.input.rate_limit import RateLimit
from aick_ros.ros.input.rgbd_images import require_messages
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.load_control import LoadControl
from aick_ros.ros.output.outputs import Outputs
from aick_ros.ros.overlapping_worker import OverlappingWorker
from aick_ros.ros.process.warm_up import warm_up
from aick_ros.ros.report import Report
from aick_ros.ros.requests import Requests
from aick_ros.ros.robot_odometry import RobotOdometry
from aick_ros.ros.work_queue import WorkQueue
from aick_ros.ros.worker import Worker
from aick_ros.settings import NodeSettings, Settings

_BURST = 1  # pair; chosen: a frame that takes three times as long as most makes no other one lost
_LONGEST_BACKLOG = 100  # pairs; chosen: 3 s at 30 Hz
_LARGEST_BACKLOG = 256 * 2 ** 20  # bytes; chosen: a pair of 640x480 takes 1.5 to 2.1 MB
_RELEASE_EVERY = 10  # seconds; chosen: a frame that then takes some milliseconds more is rare
_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen

_Result = TypeVar('_Result')


class _Prepared(NamedTuple):
    """An arrival, decoded and prepared."""

    arrival: Arrival
    preparation: Preparation


class Pipeline:
    """
    Visual odometry of an RGB-D camera on the topics of a node.

    The executor's thread pairs images and queues the pairs. A thread decodes and prepares them,
    while another one registers the frame before and publishes; on a single core one thread does
    both. Services and changed parameters are tasks between two registrations. Images are taken
    from :meth:`activate` to :meth:`deactivate`; then the odometry continues from the last tracked
    frame.

    :raises InputError: where a setting cannot be used.
    """

    def __init__(self, node: Node, settings: NodeSettings, core: Settings) -> None:
        require_messages(settings)
        self._node, self._logger, self._settings = node, node.get_logger(), settings
        self._diagnostics = Diagnostics(node)
        self._queue = _queue(settings)
        # what frames are made of
        self._transforms = Transforms(
            node, (settings.odom_frame_id, settings.guess_frame_id or settings.frame_id),
            on_change=self._queue.wake)
        extrinsics = Extrinsics(self._transforms, settings)
        self._assembler = FrameAssembler(node, settings, extrinsics, on_change=self._queue.wake)
        self._imu = ImuInput(node, self._transforms, on_change=self._queue.wake,
                             is_required=settings.wait_imu_to_init)
        guess = (Guess(self._transforms, extrinsics, settings)
                 if settings.guess_frame_id else None)
        # from frames to odometry
        self._odometry = RobotOdometry(
            settings, core, extrinsics, self._imu, guess, self._logger.info)
        self._outputs = Outputs(node, settings, guess, self._odometry.local_map)
        self._requests = Requests(
            node, settings.odom_frame_id, self._odometry, self._outputs, self._between_frames,
            is_active=lambda: self._images is not None)
        # from images to the queue
        self._rate_limit = RateLimit(settings.max_update_rate)
        self._load = LoadControl(settings, core, self._apply, self._logger.warning)
        self._report = Report(node, settings, self._diagnostics, self._transforms, self._queue,
                              self._odometry, self._load)
        self._images: ImageStream | None = None
        self._timer: Timer | None = None
        self._seconds = 0
        self._worker = self._new_worker()
        self._between_frames(lambda: warm_up(core))

    def activate(self) -> None:
        """Subscribe to the images and to the IMU."""
        self._diagnostics.restart()
        self._imu.activate()
        self._images = ImageStream(self._node, self._settings, self._assembler, self._transforms,
                                   self._diagnostics, self._enqueue, self._imu.compare_clock)
        # a steady timer: a /clock that stands still must not stop it
        self._timer = self._node.create_timer(
            1.0, partial(self._each_second, self._images),
            clock=Clock(clock_type=ClockType.STEADY_TIME))

    def start(self) -> None:
        """Start the worker's thread."""
        self._worker.start()

    def deactivate(self) -> None:
        """Unsubscribe from both; nothing is published any more once this returns."""
        self._imu.deactivate()
        if self._images is not None and self._timer is not None:
            self._images.close()
            self._node.destroy_timer(self._timer)
            self._images = self._timer = None
        self._worker.drain()

    def close(self) -> None:
        """Finish the frames at hand and end."""
        self._worker.stop()

    def change_settings(self, core: Settings) -> None:
        """Change the settings of the algorithm between two frames."""
        self._load.change_settings(core)

    # A frame, from the executor's thread ...

    def _enqueue(self, pair: Pair) -> None:
        """Queue a pair with the cameras as they are now."""
        if self._requests.paused:
            self._diagnostics.count(Count.SKIPPED_WHILE_PAUSED)
        elif not self._rate_limit.admits(pair.colour_stamp):
            self._diagnostics.count(Count.SKIPPED_BY_RATE_LIMIT)
        elif not self._load.admits_next():
            self._diagnostics.count(Count.SKIPPED_TO_SHED_LOAD)
        else:
            self._queue.put(self._assembler.arrival(pair))

    # ... to those of the worker

    def _new_worker(self) -> Worker[Arrival] | OverlappingWorker[Arrival, _Prepared]:
        """Return a worker with two threads, where these have a core each."""
        if len(os.sched_getaffinity(0)) > 1:
            return OverlappingWorker(self._queue, self._prepare, self._answer, self._is_ready,
                                     self._transforms.waited)
        return Worker(self._queue, self._prepare_and_answer, self._is_ready,
                      waited=self._transforms.waited)

    def _is_ready(self, arrival: Arrival) -> bool:
        """Return whether a pair can be answered, or must not block the newest one, which can."""
        if self._requests.discarded_as(arrival.paired_at):
            return True
        images = self._images
        newest = None if images is None else images.newest
        return any(not self._assembler.missing_for(pair) and self._imu.reaches(pair.colour_stamp)
                   for pair in (arrival.pair, newest) if pair)

    def _prepare_and_answer(self, arrival: Arrival) -> None:
        prepared = self._prepare(arrival)
        if prepared is not None:
            self._answer(prepared)

    def _prepare(self, arrival: Arrival) -> _Prepared | None:
        """Decode and prepare a pair; None where it cannot be used."""
        return self._reporting(arrival, lambda: _Prepared(
            arrival, self._odometry.prepare(self._assembler.frame(arrival))))

    def _answer(self, prepared: _Prepared) -> None:
        """Register a frame and publish."""
        self._reporting(prepared.arrival, lambda: self._register(*prepared))

    def _reporting(self, arrival: Arrival, work: Callable[[], _Result]) -> _Result | None:
        """
        Return the result of work on a pair; None where it is not answered.

        It is not where a request came after it, and where the work fails, so that the next one
        follows.
        """
        discarded_as = self._requests.discarded_as(arrival.paired_at)
        if discarded_as:
            self._diagnostics.count(discarded_as)
            return None
        stamp = arrival.pair.colour_stamp
        try:
            return work()
        except InputError as error:
            self._skip(stamp, str(error))
        except Exception as error:  # of one frame, which must not end the odometry
            if not self._node.context.ok():
                return None  # a consequence of the shutdown
            if no_memory.is_of_memory(error):
                self._skip(stamp, no_memory.SENTENCE)
                return None
            self._diagnostics.damaged('internal error, see the log', Count.FAILED)
            self._logger.error(f'frame {stamp} ns failed, please report this:\n'
                               f'{traceback.format_exc()}', throttle_duration_sec=_THROTTLE)
        return None

    def _skip(self, stamp: int, reason: str) -> None:
        self._diagnostics.damaged(reason)
        self._logger.warning(f'frame {stamp} ns skipped: {reason}',
                             throttle_duration_sec=_THROTTLE)

    def _register(self, arrival: Arrival, preparation: Preparation) -> None:
        answer = self._odometry.register(preparation, arrival.camera_frame)
        self._outputs.publish(answer)
        update = answer.camera
        self._diagnostics.answered(
            update, 1e3 * (time.monotonic() - arrival.paired_at),
            1e-6 * (self._node.get_clock().now().nanoseconds - update.stamp))
        if not update.status.ok:
            self._logger.warning(
                f'frame {update.stamp} ns: {update.status.value}: {update.reason}',
                throttle_duration_sec=_THROTTLE)
        self._outputs.show(answer)

    # Between two frames, and once a second.

    def _apply(self, core: Settings) -> None:
        self._between_frames(lambda: self._odometry.change_settings(core))

    def _between_frames(self, task: Callable[[], None]) -> None:
        def run() -> None:
            try:
                task()
            except Exception:  # must not end the odometry, as little as a frame
                self._logger.error('failed between two frames, please report this:\n'
                                   f'{traceback.format_exc()}')
        self._worker.put_task(run)

    def _each_second(self, images: ImageStream) -> None:
        self._seconds += 1
        if self._seconds % _RELEASE_EVERY == 0:
            self._between_frames(release_freed_memory)
        self._load.update(
            self._worker.dropped, self._worker.busy, self._transforms.waited_in_all)
        self._report.publish(images, self._worker.dropped, self._requests.paused)


def _queue(settings: NodeSettings) -> WorkQueue[Arrival]:
    """Return the queue of the pairs: all of them, or the newest, and one before it in a burst."""
    capacity, burst = (_LONGEST_BACKLOG, 0) if settings.process_every_frame else (1, _BURST)
    return WorkQueue(capacity, lambda arrival: arrival.size, _LARGEST_BACKLOG, burst)
