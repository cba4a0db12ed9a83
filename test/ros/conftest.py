# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera, a consumer and the node's process for the tests of the ROS side."""

import dataclasses
import fcntl
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, Vector3
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import LoggingSeverity
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, Image, Imu

from aick_ros.geometry.camera import Camera
from aick_ros.ros.conversions import to_stamp, to_time
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

ROOT = Path(__file__).parents[2]
OPTICAL = 'camera_rgb_optical_frame'
QUEUE = 1000
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine

# A process that has imported the node and ROS, from which nodes are forked
FORK_SERVER = multiprocessing.get_context('forkserver')
FORK_SERVER.set_forkserver_preload(['aick_ros.ros.odom_node'])

# Run in the fork, which has nothing of the test's but what it is given here
NODE = '''
import os, sys
os.environ.clear()
os.environ.update(environment)
for stream in (1, 2):
    os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
sys.argv = ['odom_node', *arguments]
for name in list(sys.modules):  # rtabmap_msgs is there in some tests, and in others not
    if name.startswith(('aick_ros.ros', 'rtabmap_msgs')):
        del sys.modules[name]
from aick_ros.ros.process.entry_points import odom_node
odom_node()
'''


def wait_until(condition, what, pause=lambda: time.sleep(0.005)):
    """Wait for a condition; what it is about is said, or given by a function, where it fails."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, (
            f'waited {PATIENCE:g} s in vain for {what() if callable(what) else what}')
        pause()


def info_message(camera):
    return CameraInfo(width=camera.width, height=camera.height, k=camera.matrix.ravel(),
                      distortion_model=camera.distortion_model, d=camera.distortion)


def imu_message(stamp, turn_rate, acceleration):
    """Return the message of a sample at the colour camera."""
    sample = Imu(angular_velocity=Vector3(**dict(zip('xyz', turn_rate))),
                 linear_acceleration=Vector3(**dict(zip('xyz', acceleration))))
    sample.header.stamp, sample.header.frame_id = to_time(stamp), OPTICAL
    return sample


def in_the_dark(frame):
    """Return a frame without anything to see; depth alone would do to go on."""
    return dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                               depth=np.full_like(frame.depth, np.nan))


class Rig:
    """The other side of the node: publishes what a camera does, collects what comes back."""

    patience = PATIENCE
    wait_until = staticmethod(wait_until)
    camera_info_message = staticmethod(info_message)

    @staticmethod
    def image_message(stamp, encoding, pixels, frame_id=OPTICAL):
        """An Image of rows without padding."""
        message = Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                        step=pixels.strides[0], is_bigendian=int(pixels.dtype.byteorder == '>'))
        message.header.stamp = Time(sec=stamp // 10 ** 9, nanosec=stamp % 10 ** 9)
        message.header.frame_id = frame_id
        message.data = np.ascontiguousarray(pixels).tobytes()
        return message

    def __init__(self):
        self.node = rclpy.create_node('rig')
        self.colour = self.node.create_publisher(Image, 'rgb/image', QUEUE)
        self.depth = self.node.create_publisher(Image, 'depth/image', QUEUE)
        self.info = self.node.create_publisher(CameraInfo, 'rgb/camera_info', QUEUE)
        self.odom, self.poses, self.diagnostics, self.links = [], [], [], []
        self.listen(Odometry, 'odom', self.odom.append)
        self.listen(PoseWithCovarianceStamped, 'pose', self.poses.append)
        self.listen(DiagnosticArray, '/diagnostics', self.diagnostics.append)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def add(self, node):
        """Have a node's callbacks done by this executor."""
        self._executor.add_node(node)

    def remove(self, node):
        """Stop that."""
        self._executor.remove_node(node)

    def listen(self, kind, topic, take):
        self.node.create_subscription(kind, topic, take, QUEUE)

    def withdraw(self, entity):
        """Destroy a publisher or subscription between two waits, of which one may be using it."""
        is_publisher = isinstance(entity, Publisher)
        task = self._executor.create_task(
            self.node.destroy_publisher if is_publisher else self.node.destroy_subscription,
            entity)
        self.wait_until(task.done, f'{entity.topic_name} to be withdrawn')

    def listen_to_tf(self):
        from tf2_msgs.msg import TFMessage
        self.listen(TFMessage, '/tf', lambda message: self.links.extend(message.transforms))

    def close(self):
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()

    def wait_for_node(self):
        wait_until(lambda: all(publisher.get_subscription_count() for publisher in (
            self.colour, self.depth, self.info)), 'the node to subscribe')
        # it looks what we offer and subscribes anew; a camera_info sent meanwhile may be missed
        wait_until(lambda: any(
            endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE for endpoint in
            self.node.get_subscriptions_info_by_topic(self.info.topic_name)),
            'a reliable subscription of camera_info')
        # once one of its messages has come, the node knows all subscriptions of this side
        wait_until(lambda: self.diagnostics, 'the node to publish')

    def send_camera_info(self, camera):
        self.info.publish(info_message(camera))

    def send(self, frame, colour=None, depth=None):
        """Publish a frame, or other messages in place of its images."""
        self.colour.publish(colour or self.image_message(frame.stamp, 'rgb8', frame.colour))
        self.depth.publish(depth or self.image_message(
            frame.stamp if frame.depth_stamp is None else frame.depth_stamp, '32FC1',
            frame.depth))

    def offer_imu(self, samples):
        """Let the node subscribe to an IMU at the colour camera; return what sends its samples."""
        publisher, rows = self.node.create_publisher(Imu, 'imu', 1000), iter(range(len(samples)))
        stamps = [int(stamp) for stamp in samples.stamps]

        def send_until(end):
            for row in rows:
                publisher.publish(imu_message(
                    stamps[row], samples.turn_rates[row], samples.accelerations[row]))
                if stamps[row] > end:  # the first one after it
                    break
        return publisher, send_until

    def answer(self, stamp):
        """Wait for the odometry of a stamp [ns], as long as any comes, and return it."""
        while stamp not in self.stamps():
            seen = len(self.odom)
            wait_until(lambda: len(self.odom) > seen, lambda: (
                f'odometry of {stamp} ns, there is {self.stamps()}, and {self.values()}'))
        return self.odom[self.stamps().index(stamp)]

    def call(self, kind, name, request=None):
        """Call a service and return its response."""
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(PATIENCE), f'no service {name}'
        response = client.call(request or kind.Request(), timeout_sec=PATIENCE)
        assert response is not None, f'{name} does not answer'
        return response

    def values(self):
        """Values of the last message on /diagnostics, by key."""
        return {value.key: value.value for value in self.diagnostics[-1].status[0].values}

    def stamps(self):
        return [to_stamp(message.header.stamp) for message in self.odom]

    def _spin(self):
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass


class Graph:
    """
    Nodes of this process, and a node beside them that hears what they send and log.

    Nodes do their callbacks only while the test waits for something of them.
    """

    def __init__(self):
        self.beside = rclpy.create_node('beside')
        self._executor = SingleThreadedExecutor()  # that of rclpy outlives its context
        self._executor.add_node(self.beside)
        self._nodes, self._logged, self._ends = [self.beside], [], 0
        self._received = {}
        # a line may be logged before the two have found each other
        self.beside.create_subscription(Log, '/rosout', self._logged.append, QoSProfile(
            depth=QUEUE, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def node(self, name='odom_node', **options):
        """Make a node, named and with options as rclpy.create_node has them."""
        return self.add(rclpy.create_node(name, **options))

    def add(self, node):
        """Take a node that was made elsewhere; it is destroyed with the others."""
        self._nodes.append(node)
        return node

    def listen(self, kind, topic, raw=False):
        """
        Return the list of all messages to come on a topic; who is there has found it.

        :param raw: take them as they are serialized.
        """
        received = []
        subscription = self.beside.create_subscription(
            kind, topic, received.append, QUEUE, raw=raw)
        self._received[subscription.topic_name] = received
        publishers = [each for node in self._nodes for each in node.publishers
                      if each.topic_name == subscription.topic_name]
        wait_until(lambda: all(each.get_subscription_count() for each in publishers),
                   f'the publishers of {topic} to find its subscriber')
        return received

    def sent(self, node, topic):
        """Return all that a node has sent on a topic that is listened to, and sends no longer."""
        topic = node.resolve_topic_name(topic)
        [publisher] = [each for each in node.publishers if each.topic_name == topic]
        received, last = self._received[topic], publisher.msg_type()

        def is_last(message):
            if isinstance(message, bytes):
                message = deserialize_message(message, publisher.msg_type)
            return message == last

        publisher.publish(last)  # what is sent before it comes before it
        self.wait_until(lambda: received and is_last(received[-1]), f'the last of {topic}')
        received.pop()
        return received

    def wait_until(self, condition, what, *nodes):
        """Do the callbacks of the node beside, and of others, until a condition is met."""
        for node in nodes:
            self._executor.add_node(node)
        wait_until(condition, what, lambda: self._executor.spin_once(timeout_sec=0.1))
        for node in nodes:
            self._executor.remove_node(node)

    def call(self, node, kind, name, request=None):
        """Call a service of a node and return its response."""
        client = self.beside.create_client(kind, name)
        self.wait_until(client.service_is_ready, f'the service {name}')
        answer = client.call_async(kind.Request() if request is None else request)
        self.wait_until(answer.done, f'an answer of {name}', node)
        return answer.result()

    def log(self, node):
        """Return level and text of each line that a node has logged."""
        self._ends += 1
        end = f'end {self._ends}'
        node.get_logger().fatal(end)  # what comes after it was logged after it
        self.wait_until(lambda: any(each.msg == end for each in self._logged), 'the log')
        return [(LoggingSeverity(each.level), each.msg) for each in self._logged
                if each.name == node.get_logger().name and not each.msg.startswith('end ')]

    def close(self):
        self._executor.shutdown()
        for node in self._nodes:
            node.get_logger().set_level(LoggingSeverity.UNSET)  # that of the name, in the process
            node.destroy_node()


class NodeProcess:
    """
    odom_node in a process of its own; its log goes to a file.

    :param command: that starts it; None: it is forked, which saves most imports.
    """

    def __init__(self, log, arguments, parameters, remappings, command):
        arguments = [*arguments, '--ros-args']
        for name, value in parameters.items():
            arguments += ['-p', f'{name}:={value}']
        for rule in remappings:
            arguments += ['-r', rule]
        self._log = log
        log.touch()
        self._process = (ForkedProcess(arguments, log) if command is None else
                         subprocess.Popen([*command, *arguments], stdout=log.open('w'),
                                          stderr=subprocess.STDOUT))

    @property
    def log(self):
        return self._log.read_text()

    def wait_for_log(self, sentence):
        wait_until(lambda: sentence in self.log, lambda: f'{sentence!r} in the log:\n{self.log}')

    def stop(self, how=signal.SIGINT):
        """End the process as Ctrl-C does; return its exit code."""
        if self._process.poll() is None:
            self._process.send_signal(how)
        try:
            return self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise


@pytest.fixture(scope='session')
def built_rtabmap_msgs(tmp_path_factory):
    """Build rtabmap_msgs once, for all processes of the tests; return a folder for PYTHONPATH."""
    folder = tmp_path_factory.getbasetemp()
    if 'PYTEST_XDIST_WORKER' in os.environ:
        folder = folder.parent
    with (folder / 'rtabmap_msgs.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / 'messages').is_dir():
            done = subprocess.run(
                [sys.executable, str(ROOT / 'tools' / 'make_messages.py'),
                 str(ROOT / 'test' / 'ros' / 'rtabmap_msgs'), '--into', str(folder / 'building')],
                capture_output=True, text=True)
            if 'there is no ' in done.stderr or 'has no Python' in done.stderr:
                pytest.skip(done.stderr.strip())
            assert done.returncode == 0, done.stderr
            (folder / 'building').rename(folder / 'messages')
    return folder / 'messages'


@pytest.fixture
def rtabmap_msgs(built_rtabmap_msgs, monkeypatch):
    """Let this process and those that it starts find rtabmap_msgs."""
    monkeypatch.syspath_prepend(built_rtabmap_msgs)
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(
        [str(built_rtabmap_msgs), os.environ.get('PYTHONPATH', '')]))


@pytest.fixture
def rtabmap_types(rtabmap_msgs):
    """Return the types of rtabmap_msgs, by their names."""
    from rtabmap_msgs import msg, srv
    return {**vars(msg), **vars(srv)}


class ForkedProcess:
    """What NodeProcess asks of a subprocess.Popen, of a fork of the process with the imports."""

    def __init__(self, arguments, log):
        self._process = FORK_SERVER.Process(daemon=True, target=exec, args=(NODE, {
            'environment': dict(os.environ), 'arguments': arguments, 'log': str(log)}))
        self._process.start()
        self.kill = self._process.kill

    def poll(self):
        return self._process.exitcode

    def send_signal(self, how):
        os.kill(self._process.pid, how)

    def wait(self, timeout=None):
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired('odom_node', timeout)
        return self._process.exitcode


@pytest.fixture(scope='session')
def source():
    """Return the rendered sequence of ``frames``, small as the node takes its time on each."""
    return SyntheticSource(SyntheticOptions(
        seed=5, frames=24, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5)))


@pytest.fixture(scope='session')
def all_frames(source):
    return tuple(source.frames())


@pytest.fixture(scope='session')
def darken():
    return in_the_dark


@pytest.fixture(scope='session', name='wait_until')
def waiting():
    return wait_until


@pytest.fixture
def ros(ros_domain):
    """Start ROS in this process, in a domain of the test's own."""
    rclpy.init(args=[])
    yield
    rclpy.try_shutdown()


@pytest.fixture
def rig(ros):
    rig = Rig()
    yield rig
    rig.close()


@pytest.fixture
def graph(ros):
    """Return where the test makes nodes of this process, and hears them."""
    graph = Graph()
    yield graph
    graph.close()


@pytest.fixture
def start_node(rig, tmp_path):
    """Start odom_node with parameters that suit a test: every frame, nothing lost on the way."""
    started = []

    def start(*arguments, wait=True, bare=False, command=None, remappings=(), **parameters):
        suitable = {} if bare else {
            'process_every_frame': 'true', 'qos_reliability': 'reliable',
            # frames come in bursts here: their images must not push each other out
            'topic_queue_size': 100, 'sync_queue_size': 100, 'frame_id': OPTICAL}
        parameters = {**suitable, **{name.replace('__', '.'): value
                                     for name, value in parameters.items()}}
        node = NodeProcess(tmp_path / f'odom_node_{len(started)}.log', arguments, parameters,
                           remappings, command)
        started.append(node)
        if wait:
            rig.wait_for_node()
        return node

    yield start
    for node in started:
        node.stop()
