# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Launch files in the style of rtabmap_ros's, with package and executable of the odometry changed.

What they start as odometry is started and fed; odom and odom_info come back for each frame. The
package index has no launch: a stand-in reads the files, and hands their parameters over in a
file, typed as YAML, as launch_ros does.
"""

import runpy
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, Imu

from aick_ros.ros.conversions import header, to_stamp, to_time
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import values

FOLDER = Path(__file__).parent / 'launch_files'
OPTICAL = 'camera_rgb_optical_frame'
OURS = {"package='rtabmap_odom'": "package='aick_ros'",
        "executable='rgbd_odometry'": "executable='odom_node'"}
COUNT = 3  # frames


@dataclass
class Launch:
    """The stand-in for launch: its arguments, and parameters for all nodes."""

    arguments: dict
    everywhere: dict = field(default_factory=dict)

    def modules(self):
        """Return what launch files import, by module."""
        return {
            'launch': {'LaunchDescription': list},
            'launch.actions': {
                'DeclareLaunchArgument': self._declare,
                'OpaqueFunction': lambda function: lambda: function(self)},
            'launch.conditions': {
                'IfCondition': lambda value: lambda: self.value(value) == 'true',
                'UnlessCondition': lambda value: lambda: self.value(value) != 'true'},
            'launch.substitutions': {'LaunchConfiguration': LaunchConfiguration},
            'launch_ros': {},
            'launch_ros.actions': {
                'Node': lambda **fields: SimpleNamespace(**fields),
                'SetParameter': lambda name, value: self.everywhere.update({name: value})}}

    def _declare(self, name, default_value):
        self.arguments.setdefault(name, default_value)

    def value(self, given):
        """Return the text of a substitution, or a list of them; other values as they are."""
        if isinstance(given, LaunchConfiguration):
            return self.value(self.arguments[given])
        return ''.join(map(self.value, given)) if isinstance(given, list) else given

    def nodes(self, actions):
        """Yield the nodes to start, all their fields as text, their parameters typed."""
        for action in actions:
            if callable(action):
                yield from self.nodes(action())
            elif action is not None and getattr(action, 'condition', lambda: True)():
                yield self._node(**vars(action))

    def _node(self, package, executable, parameters=(), remappings=(), arguments=(),
              namespace='', name='', **_):
        parameters = {key: value for group in parameters for key, value in group.items()}
        return SimpleNamespace(
            package=package, executable=executable, arguments=list(map(self.value, arguments)),
            parameters={**self.everywhere, **{key: self._typed(value)
                                              for key, value in parameters.items()}},
            remappings=[f'{key}:={self.value(topic)}' for key, topic in remappings]
            + [f'__ns:=/{self.value(namespace)}', f'__node:={name or executable}'])

    def _typed(self, given):
        is_text = isinstance(given, LaunchConfiguration)
        return yaml.safe_load(self.value(given)) if is_text else given


class LaunchConfiguration(str):
    """The name of a launch argument, in place of its value."""

    def perform(self, context):
        """Return its value."""
        return context.value(self)


@pytest.fixture
def odometry(monkeypatch, tmp_path, start_node):
    """Start the odometry of a launch file after its two names were changed; return its process."""
    def start(name, arguments):
        launch = Launch(dict(arguments))
        for module, contents in launch.modules().items():
            monkeypatch.setitem(sys.modules, module, ModuleType(module))
            vars(sys.modules[module]).update(contents)
        text = (FOLDER / f'{name}.launch.py').read_text()
        for theirs, ours in OURS.items():
            assert theirs in text
            text = text.replace(theirs, ours)
        changed = tmp_path / f'{name}.launch.py'
        changed.write_text(text)
        description = runpy.run_path(str(changed))['generate_launch_description']()
        [node] = [node for node in launch.nodes(description) if node.package == 'aick_ros']
        assert node.executable == 'odom_node'
        file = tmp_path / 'parameters.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': node.parameters}}))
        return start_node(*node.arguments, '--ros-args', '--params-file', str(file), '--',
                          wait=False, bare=True, remappings=node.remappings)
    return start


@pytest.fixture(scope='module')
def frames(source):
    return [source.frame(i) for i in range(COUNT)]


class Robot:
    """The camera of a robot, and what else is there: TF of its odometry, and a clock."""

    def __init__(self, rig, kind, imu=''):
        from tf2_msgs.msg import TFMessage
        self._rig, self._send = rig, getattr(self, f'_send_{kind}')
        mount = TransformStamped(header=header(0, 'camera_link'), child_frame_id=OPTICAL)
        mount.transform.rotation.x = mount.transform.rotation.z = -0.5
        mount.transform.rotation.y = mount.transform.rotation.w = 0.5
        self._static = rig.node.create_publisher(TFMessage, '/tf_static', QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self._static.publish(TFMessage(transforms=[mount]))
        self._clock = rig.node.create_publisher(Clock, '/clock', 10)
        self._tf = rig.node.create_publisher(TFMessage, '/tf', 10)
        self._imu = [rig.node.create_publisher(Imu, imu, 10)] if imu else []
        self._publishers = [rig.node.create_publisher(*topic, 10) for topic in self._topics(kind)]

    @staticmethod
    def _topics(kind):
        if kind == 'synchronised':
            from rtabmap_msgs.msg import RGBDImage
            return [(RGBDImage, '/camera/rgbd_image')]
        if kind == 'all_cameras':
            from rtabmap_msgs.msg import RGBDImages
            return [(RGBDImages, '/rtabmap/rgbd_images')]
        image = '/infra/image_rect_raw' if kind == 'infrared' else '/camera/color/image_raw'
        return [(Image, image), (Image, '/camera/aligned_depth_to_color/image_raw'),
                (CameraInfo, '/camera/color/camera_info')]

    def wait_for(self, node, has_clock, has_guess):
        """Wait until the node receives what it subscribes to."""
        listened = [*self._imu, *[self._clock] * has_clock, *[self._tf] * has_guess]
        self._rig.wait_until(lambda: all(any(
            endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE for endpoint in
            self._rig.node.get_subscriptions_info_by_topic(publisher.topic_name))
            for publisher in self._publishers) and all(
                publisher.get_subscription_count() for publisher in listened),
            lambda: f'the node to subscribe: {node.log}')
        self._rig.wait_until(lambda: self._rig.diagnostics, lambda: f'diagnostics: {node.log}')

    def send(self, frame):
        """Publish a frame, the time and the pose of the robot by its own odometry."""
        from tf2_msgs.msg import TFMessage
        self._clock.publish(Clock(clock=to_time(frame.stamp)))
        link = TransformStamped(header=header(frame.stamp, 'odom'), child_frame_id='camera_link')
        link.transform.translation.x = 5.0
        self._tf.publish(TFMessage(transforms=[link]))
        for publisher in self._imu:
            sample = Imu(header=header(frame.stamp, 'camera_link'))
            sample.linear_acceleration.z = 9.81
            publisher.publish(sample)
        info = self._rig.camera_info_message(frame.camera)
        info.header = header(frame.stamp, OPTICAL)
        self._send(frame, self._rig.image_message(frame.stamp, 'rgb8', frame.colour),
                   self._rig.image_message(frame.stamp, '32FC1', frame.depth), info)

    def _send_separate(self, frame, *messages):
        for publisher, message in zip(self._publishers, messages):
            publisher.publish(message)

    def _send_infrared(self, frame, colour, *others):
        grey = self._rig.image_message(frame.stamp, 'mono8', frame.colour[..., 1].copy())
        self._send_separate(frame, grey, *others)

    def _send_synchronised(self, frame, *messages):
        self._publishers[0].publish(self._together(*messages))

    def _send_all_cameras(self, frame, *messages):
        from rtabmap_msgs.msg import RGBDImages
        image = self._together(*messages)
        self._publishers[0].publish(RGBDImages(header=image.header, rgbd_images=[image, image]))

    @staticmethod
    def _together(colour, depth, info):
        from rtabmap_msgs.msg import RGBDImage
        return RGBDImage(header=colour.header, rgb=colour, depth=depth, rgb_camera_info=info,
                         depth_camera_info=info)


DELETE = 'argument {} is one of the SLAM node of RTAB-Map and changes nothing here'
NO_RESET = "'Odom/ResetCountdown' of rgbd_odometry changes nothing here: a lost odometry needs no"
ODD_SENSOR = "'depth_module.emitter_enabled' is not one of this node and changes nothing"
PLANAR = "'Reg/Force3DoF' is read as odometry.planar = True"


@dataclass(frozen=True)
class Case:
    """A launch file with arguments, what is there when it is started, and what the node says."""

    file: str
    arguments: dict = field(default_factory=dict)
    camera: str = 'separate'
    namespace: str = ''
    odom: str = 'odom'
    has_guess: bool = False
    imu: str = ''
    said: tuple = ()

    @property
    def has_clock(self):
        """Whether the node takes the time from /clock."""
        return (self.file in ('recording', 'cameras_in_one_message')
                or self.arguments.get('use_sim_time') == 'true')


# by the names of the 14 launch files of rtabmap_ros with rgbd_odometry that do the same
CASES = {
    'realsense_d400': Case('images', {'approx_sync': 'false'}),
    'kinect_xbox_360': Case('images', {'namespace': 'rtabmap'}, namespace='/rtabmap'),
    'rgbdslam_datasets': Case('recording', said=(
        NO_RESET, "'Odom/Strategy' of rgbd_odometry changes nothing here: frames are registered",
        "'RGBD/CreateOccupancyGrid' of rgbd_odometry changes nothing here")),
    'realsense_d435i_color': Case(
        'images_and_imu', {'args': '-d', 'odom_args': '--Vis/MinInliers 15 --Reg/Force3DoF true'},
        said=(ODD_SENSOR, PLANAR, DELETE.format('-d'),
              "'Vis/MinInliers' of rgbd_odometry changes nothing here"), imu='/imu/data'),
    'realsense_d435i_infra': Case('images_and_imu', {'image': '/infra/image_rect_raw'},
                                  camera='infrared', imu='/imu/data'),
    'k4a': Case('images_by_the_odometry', said=(
        "'queue_size' is read as sync_queue_size = 30",
        "'qos' is read as qos_reliability = 'reliable'",
        "'Rtabmap/ImagesAlreadyRectified' is read as image_rectification = 'raw'",
        "'keep_color' of rgbd_odometry changes nothing here: odom_rgbd_image is always"),
        imu='/imu/data'),
    'rtabmap': Case('by_arguments', {'args': '--delete_db_on_start'}, namespace='/rtabmap',
                    said=(DELETE.format('--delete_db_on_start'),)),
    'rtabmap, rgbd_sync': Case(
        'by_arguments', {'rgbd_sync': 'true', 'odom_topic': 'vo', 'wait_imu_to_init': 'true',
                         'odom_args': '--Odom/ResetCountdown 1'},
        camera='synchronised', namespace='/rtabmap', odom='vo', said=(NO_RESET,),
        imu='/imu/data'),
    'depthai, zed': Case('rgbd_image', camera='synchronised',
                         imu='/imu/data'),
    'depthai_color': Case('rgbd_image', {'wait_imu': 'false'}, camera='synchronised'),
    'rtabmap_D405x2, rtabmap_D405x3': Case(
        'several_cameras', {'args': '--delete_db_on_start'}, camera='synchronised',
        namespace='/rtabmap', said=(DELETE.format('--delete_db_on_start'),)),
    'two cameras for the odometry': Case(
        'several_cameras', {'all_of_them': 'true'}, camera='synchronised', namespace='/rtabmap',
        said=('rgbd_cameras = 2: only the first camera is used, on rgbd_image0',)),
    'multi_rgbd_inertial_dataset': Case(
        'cameras_in_one_message', {'use_imu': 'true'}, camera='all_cameras',
        namespace='/rtabmap', imu='/imu', said=(
            'rgbd_images has 2 images: only the first is used',)),
    'champ_vslam': Case('guess_by_the_robot', camera='synchronised', odom='vo', has_guess=True,
                        imu='/imu/data/filtered',
                        said=(NO_RESET,)),
    'isaac_vslam': Case(
        'guess_by_the_robot', {'use_sim_time': 'true', 'use_imu': 'false',
                               'namespace': 'rtabmap'}, camera='synchronised',
        namespace='/rtabmap', odom='vo', has_guess=True, said=(PLANAR,)),
}


@pytest.mark.parametrize('case', CASES.values(), ids=CASES)
def test_a_launch_file_needs_two_names_changed(rtabmap_msgs, rig, odometry, frames, case):
    """Odometry, odom_info and images, for which SLAM and viewer wait, come for each frame."""
    pytest.importorskip('tf2_msgs', reason='tf2_msgs is not installed')
    from rtabmap_msgs.msg import OdomInfo, RGBDImage
    answers, infos, images = received = [], [], []
    for kind, topic, messages in zip((Odometry, OdomInfo, RGBDImage),
                                     (case.odom, 'odom_info', 'odom_rgbd_image'), received):
        rig.listen(kind, f'{case.namespace}/{topic}', messages.append)
    robot = Robot(rig, case.camera, case.imu)
    node = odometry(case.file, case.arguments)
    robot.wait_for(node, case.has_clock, case.has_guess)
    for frame in frames:
        robot.send(frame)
        for messages in received:
            rig.wait_until(lambda: messages and to_stamp(
                messages[-1].header.stamp) == frame.stamp,
                lambda: f'the answer to a frame: {node.log}')
    assert [len(messages) for messages in received] == 3 * [COUNT]
    assert {(message.header.frame_id, message.child_frame_id) for message in answers} == {
        (case.odom, 'camera_link')}
    assert [message.lost for message in infos] == COUNT * [False]
    assert answers[0].pose.pose.position.x == pytest.approx(5.0 if case.has_guess else 0.0)
    for sentence in case.said:
        node.wait_for_log(sentence)


# all of rgbd_odometry, by its documentation; none has its default value
PARAMETERS = {
    'frame_id': 'camera_link', 'odom_frame_id': 'vo', 'publish_tf': False,
    'wait_for_transform': 0.3, 'initial_pose': '1 2 3 0 0 0', 'guess_frame_id': 'wheels',
    'guess_min_translation': 0.1, 'guess_min_rotation': 0.1, 'guess_min_time': 0.1,
    'guess_linear_variance': 0.01, 'guess_angular_variance': 0.01,
    'ground_truth_frame_id': 'world', 'ground_truth_base_frame_id': 'truth',
    'config_path': '/a.ini', 'publish_null_when_lost': False, 'expected_update_rate': 20.0,
    'max_update_rate': 10.0, 'min_update_rate': 1.0, 'wait_imu_to_init': True,
    'always_check_imu_tf': True, 'imu_queue_size': 10, 'qos': 1, 'qos_camera_info': 1,
    'qos_imu': 1, 'log_to_rosout_level': 2, 'sensor_data_compression_format': '.png',
    'sensor_data_parallel_compression': False, 'publish_compressed_sensor_data': True,
    'always_process_most_recent_frame': False, 'approx_sync': False, 'topic_queue_size': 20,
    'sync_queue_size': 20, 'queue_size': 20, 'approx_sync_max_interval': 0.1,
    'image_transport': 'compressed', 'rgb_transport': 'compressed',
    'depth_transport': 'compressedDepth', 'subscribe_rgbd': False, 'rgbd_cameras': 2,
    'keep_color': True, 'Odom/ResetCountdown': '1', 'Reg/Force3DoF': 'true',
    'Odom/Strategy': '1', 'Vis/EstimationType': '0', 'Rtabmap/ImagesAlreadyRectified': 'false'}
TOPICS = ['odom', 'odom_info', 'odom_info_lite', 'odom_last_frame', 'odom_local_map',
          'odom_rgbd_image']
ABSENT_TOPICS = ['odom_local_scan_map', 'odom_sensor_data/raw']
SERVICES = ['reset_odom', 'reset_odom_to_pose', 'pause_odom', 'resume_odom', 'log_debug',
            'log_info', 'log_warning', 'log_error']


def test_nothing_of_rgbd_odometry_is_absent_in_silence(rtabmap_msgs, rig, start_node, tmp_path):
    """Parameters are ours or named in the log; topics are there, or whoever waits is told."""
    file = tmp_path / 'parameters.yaml'
    file.write_text(yaml.safe_dump({'/**': {'ros__parameters': PARAMETERS}}))
    node = start_node('--ros-args', '--params-file', str(file), '--', bare=True, wait=False,
                      remappings=['__node:=rgbd_odometry'])
    for topic in TOPICS:
        rig.wait_until(lambda: rig.node.count_publishers(topic), topic)
    for service in SERVICES:
        rig.wait_until(lambda: rig.node.count_services(f'/rgbd_odometry/{service}'), service)
    ours = values(NodeSettings)
    unnamed = [name for name in PARAMETERS if name not in ours and f"'{name}'" not in node.log]
    assert unnamed == []
    for topic in ABSENT_TOPICS:
        rig.listen(Image, topic, lambda message: None)
        node.wait_for_log(f'somebody subscribes to /{topic}, which')
