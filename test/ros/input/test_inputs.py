# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images and calibrations as real cameras send them, over DDS to the node in its process."""

import dataclasses
import time

import cv2
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.odometry import Odometry
from aick_ros.ros.conversions import from_pose, to_time
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.renderer import Renderer

OPTICAL, INFRARED = 'camera_rgb_optical_frame', 'camera_depth_optical_frame'
COUNT = 6


@pytest.fixture(scope='module')
def frames(all_frames):
    return list(all_frames[:COUNT])


def offline(frames):
    odometry = Odometry()
    return {frame.stamp: odometry.register_frame(frame).T_odom_camera for frame in frames}


def assert_answers(rig, frames, atol=1e-6):
    for stamp, T in offline(frames).items():
        np.testing.assert_allclose(from_pose(rig.answer(stamp).pose.pose), T, atol=atol)


def camera_info(camera, **changes):
    p = np.hstack([camera.matrix, np.zeros((3, 1))])
    return CameraInfo(**{
        'width': camera.width, 'height': camera.height, 'k': camera.matrix.ravel(),
        'p': p.ravel(), 'distortion_model': camera.distortion_model, 'd': camera.distortion,
        **changes})


def millimetres(frame):
    return np.where(np.isnan(frame.depth), 0, np.rint(1000 * frame.depth)).astype(np.uint16)


def of_millimetres(frame):
    units = millimetres(frame)
    depth = np.where(units > 0, units / 1000.0, np.nan).astype(np.float32)
    return dataclasses.replace(frame, depth=depth)


# Encodings.

def bayer(colour):
    """A sensor behind the filter red, green / green, blue."""
    mosaic = np.empty(colour.shape[:2], np.uint8)
    for (row, column), channel in (((0, 0), 0), ((0, 1), 1), ((1, 0), 1), ((1, 1), 2)):
        mosaic[row::2, column::2] = colour[row::2, column::2, channel]
    return mosaic


def yuv(colour):
    """Two bytes a pixel, U and V shared by two, as UYVY."""
    luma, u, v = cv2.split(cv2.cvtColor(colour, cv2.COLOR_RGB2YUV))
    luma = np.clip(16 + luma.astype(float) * 219 / 255, 0, 255).astype(np.uint8)
    packed = np.empty((*luma.shape, 2), np.uint8)
    packed[..., 1] = luma
    packed[:, ::2, 0], packed[:, 1::2, 0] = u[:, ::2], v[:, ::2]
    return packed


@pytest.mark.parametrize('encoding, pixels, exact', [
    ('bgr8', lambda colour: colour[..., ::-1], True),
    ('8UC3', lambda colour: colour[..., ::-1], True),
    ('rgba8', lambda colour: np.dstack([colour, colour[..., 0]]), True),
    ('bgra8', lambda colour: np.dstack([colour[..., ::-1], colour[..., 0]]), True),
    ('mono8', lambda colour: cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), True),
    ('8UC1', lambda colour: cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), True),
    ('mono16', lambda colour: cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY).astype('>u2') * 257, True),
    ('bayer_rggb8', bayer, False),
    ('yuv422', yuv, False),
    ('yuv422_yuy2', lambda colour: np.ascontiguousarray(yuv(colour)[..., ::-1]), False),
], ids=lambda value: value if isinstance(value, str) else '')
def test_colour_encodings(rig, start_node, frames, encoding, pixels, exact):
    start_node()
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        image = np.ascontiguousarray(pixels(frame.colour))
        if encoding == 'mono16':
            image = image.astype('>u2')
        rig.send(frame, rig.image_message(frame.stamp, encoding, image))
    # of a mosaic the colours come back only roughly, and with them the keypoints
    assert_answers(rig, frames, atol=1e-6 if exact else 0.03)


@pytest.mark.parametrize('encoding', ['16UC1', 'mono16'])
def test_depth_in_millimetres(rig, start_node, frames, encoding):
    start_node()
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame, depth=rig.image_message(frame.stamp, encoding, millimetres(frame)))
    assert_answers(rig, [of_millimetres(frame) for frame in frames])


# Transports, as image_transport names their topics.

def compressed(stamp, format_, data):
    message = CompressedImage(format=format_, data=data)
    message.header.stamp, message.header.frame_id = to_time(stamp), OPTICAL
    return message


def quantised(depth):
    """32FC1 by compressedDepth: A / (stored - B) with its default parameters, 10 m and 100."""
    a = 100.0 * 101.0
    b = 1.0 - a / 10.0
    with np.errstate(invalid='ignore'):
        stored = np.where(np.isfinite(depth), a / depth + b, 0).astype(np.uint16)
    header = np.int32(0).tobytes() + np.float32([a, b]).tobytes()
    return header + cv2.imencode('.png', stored)[1].tobytes()


@pytest.mark.parametrize('depth_transport, kind', [
    ('compressedDepth', '16UC1'), ('compressedDepth', '32FC1'), ('compressed', '16UC1')])
def test_compressed_images(rig, start_node, frames, depth_transport, kind):
    rig.colour = rig.node.create_publisher(CompressedImage, 'rgb/image/compressed', 100)
    rig.depth = rig.node.create_publisher(
        CompressedImage, f'depth/image/{depth_transport}', 100)
    start_node(image_transport='compressed', depth_transport=depth_transport)
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        png = cv2.imencode('.png', frame.colour[..., ::-1])[1].tobytes()
        rig.colour.publish(compressed(frame.stamp, 'rgb8; png compressed bgr8', png))
        data = (quantised(frame.depth) if kind == '32FC1' else
                bytes(12 if depth_transport == 'compressedDepth' else 0)
                + cv2.imencode('.png', millimetres(frame))[1].tobytes())
        rig.depth.publish(compressed(frame.stamp, f'{kind}; {depth_transport} png', data))
    if kind == '16UC1':
        assert_answers(rig, [of_millimetres(frame) for frame in frames])
    else:
        assert_answers(rig, frames, atol=0.03)


def test_depth_compressed_by_rvl(rig, start_node, frames):
    rvl = pytest.importorskip('rvl')
    rig.depth = rig.node.create_publisher(CompressedImage, 'depth/image/compressedDepth', 100)
    node = start_node(depth_transport='compressedDepth')
    rig.send_camera_info(frames[0].camera)

    def send(frame, size=None):
        rig.colour.publish(rig.image_message(frame.stamp, 'rgb8', frame.colour))
        # the package puts the number of pixels before the data, image_transport the size
        data = rvl.compress(millimetres(frame).tobytes())[4:size]
        rig.depth.publish(compressed(frame.stamp, '16UC1; compressedDepth rvl',
                                     bytes(12) + np.int32([320, 240]).tobytes() + data))

    for frame in frames[:-1]:
        send(frame)
    assert_answers(rig, [of_millimetres(frame) for frame in frames[:-1]])
    send(frames[-1], size=1000)
    node.wait_for_log('its RVL data is truncated')


# Cameras.

def test_depth_of_half_the_size(rig, start_node, source, frames):
    """Of a camera whose pixels are twice as large; truth is the path at full size."""
    camera = frames[0].camera
    half = Camera(160, 120, camera.fx / 2, camera.fy / 2, (camera.cx + 0.5) / 2 - 0.5,
                  (camera.cy + 0.5) / 2 - 0.5)
    renderer = Renderer(source.scene.surfaces, half)
    start_node()
    rig.send_camera_info(camera)
    for frame in frames:
        rig.send(frame, depth=rig.image_message(
            frame.stamp, '32FC1', renderer.render_depth(source.pose(frame.stamp))))
    assert_follows(rig, source, frames)


def assert_follows(rig, source, frames, atol=0.02):
    """Assert that the node's path is the true one."""
    T_camera_world = se3.inverse(source.pose(frames[0].stamp))
    for frame in frames:
        np.testing.assert_allclose(from_pose(rig.answer(frame.stamp).pose.pose),
                                   T_camera_world @ source.pose(frame.stamp), atol=atol)


def test_rectified_images_take_p(rig, start_node, frames):
    """The camera_info has a k and d that would be wrong."""
    start_node(image_rectification='rectified')
    camera = frames[0].camera
    rig.info.publish(camera_info(camera, k=2 * camera.matrix.ravel(),
                                 d=[0.3, -0.2, 0.0, 0.0, 0.0]))
    for frame in frames:
        rig.send(frame)
    assert_answers(rig, frames)


def test_a_camera_that_changes_its_resolution(rig, start_node, frames):
    camera = frames[0].camera
    twice = Camera(640, 480, 2 * camera.fx, 2 * camera.fy, 2 * camera.cx + 0.5,
                   2 * camera.cy + 0.5)
    larger = SyntheticSource(SyntheticOptions(seed=5, frames=COUNT, camera=twice))
    mixed = [*frames[:2], larger.frame(2), larger.frame(3), *frames[4:]]
    node = start_node()
    for i, frame in enumerate(mixed):
        if i in (0, 2, 4):
            rig.send_camera_info(frame.camera)
            rig.wait_until(lambda: node.log.count('camera of /rgb/image') == 1 + i // 2,
                           'the camera to be known')
        rig.send(frame)
        rig.answer(frame.stamp)
    assert_answers(rig, mixed)
    assert all(message.pose.covariance[0] < 9999.0 for message in rig.odom)
    assert 'Traceback' not in node.log


def test_binning_and_roi(rig, start_node, frames):
    """The whole sensor has twice the pixels, and its middle was read out."""
    start_node()
    camera = frames[0].camera
    k = np.diag((2.0, 2.0, 1.0)) @ camera.matrix
    k[:2, 2] += (100, 60)
    info = camera_info(camera, width=840, height=600, k=k.ravel(), binning_x=2, binning_y=2)
    info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height = 100, 60, 640, 480
    rig.info.publish(info)
    for frame in frames:
        rig.send(frame)
    assert_answers(rig, frames)


def test_a_latched_camera_info_is_received(rig, start_node, frames):
    """Published once, before the node was there."""
    rig.withdraw(rig.info)
    rig.info = rig.node.create_publisher(CameraInfo, 'rgb/camera_info', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    rig.send_camera_info(frames[0].camera)
    start_node()
    for frame in frames:
        rig.send(frame)
    assert_answers(rig, frames)


def test_a_camera_on_a_moving_arm_leaves_the_base_where_it_is(rig, start_node, source, frames):
    """The arm's transform comes on /tf, at other times than the images and after them."""
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    from aick_ros.ros.conversions import transform_stamped
    arm = rig.node.create_publisher(tf2_msgs.TFMessage, '/tf', 100)
    start_node(frame_id='base_link', wait_for_transform=5.0)
    rig.send_camera_info(frames[0].camera)
    rig.send(frames[0])
    rig.wait_until(arm.get_subscription_count, 'the node to listen to /tf')

    def tell(stamp):
        arm.publish(tf2_msgs.TFMessage(transforms=[
            transform_stamped(stamp, 'base_link', OPTICAL, source.pose(stamp))]))

    tell(frames[0].stamp - 7_000_000)
    for frame in frames[1:]:
        rig.send(frame)
    for stamp in range(frames[0].stamp + 3_000_000, frames[-1].stamp + 20_000_000, 10_000_000):
        tell(stamp)
    for frame in frames:
        np.testing.assert_allclose(from_pose(rig.answer(frame.stamp).pose.pose), np.eye(4),
                                   atol=0.02)
    assert np.linalg.norm((se3.inverse(source.pose(frames[0].stamp)) @ source.pose(
        frames[-1].stamp))[:3, 3]) > 0.02


# Depth of a camera beside the colour camera.

T_COLOUR_DEPTH = se3.exp([0.05, 0.0, 0.0, 0.0, 0.01, 0.0])
DEPTH_CAMERA = Camera(320, 240, 240, 240, 160.3, 118.7)


@pytest.fixture
def depth_info(rig):
    """The depth camera's own calibration, published from before the node starts."""
    return rig.node.create_publisher(CameraInfo, 'depth/camera_info', 10)


def send_from_two_cameras(rig, depth_info, source, frames):
    rig.wait_until(depth_info.get_subscription_count, 'the node to want depth/camera_info')
    depth_info.publish(camera_info(DEPTH_CAMERA))
    rig.send_camera_info(frames[0].camera)
    renderer = Renderer(source.scene.surfaces, DEPTH_CAMERA)
    for frame in frames:
        depth = renderer.render_depth(source.pose(frame.stamp) @ T_COLOUR_DEPTH)
        rig.send(frame, depth=rig.image_message(frame.stamp, '32FC1', depth, INFRARED))


def test_depth_is_registered_with_the_extrinsic_of_a_parameter(rig, start_node, depth_info,
                                                               source, frames):
    x, y, z = T_COLOUR_DEPTH[:3, 3]
    numbers = [x, y, z, *se3.to_quaternion(T_COLOUR_DEPTH[:3, :3])]
    start_node(register_depth='true', depth_in_colour=str([float(n) for n in numbers]))
    send_from_two_cameras(rig, depth_info, source, frames)
    assert_follows(rig, source, frames)


def test_depth_is_registered_with_the_extrinsic_of_tf(rig, start_node, depth_info, source,
                                                      frames):
    tf2_msgs = pytest.importorskip('tf2_msgs.msg', reason='tf2_msgs is not installed')
    from aick_ros.ros.conversions import transform_stamped
    node = start_node(register_depth='true')
    send_from_two_cameras(rig, depth_info, source, frames)
    node.wait_for_log(f"no transform from '{INFRARED}' (the depth image) to '{OPTICAL}'")
    latched = rig.node.create_publisher(tf2_msgs.TFMessage, '/tf_static', QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    latched.publish(tf2_msgs.TFMessage(transforms=[
        transform_stamped(0, OPTICAL, INFRARED, T_COLOUR_DEPTH)]))
    assert_follows(rig, source, frames)


def values(rig):
    return {value.key: value.value for value in rig.diagnostics[-1].status[0].values}


# Time, silence and losses.

def test_lost_images_name_the_cure(rig, start_node, frames):
    """Every other image does not arrive, as where Fast DDS loses them."""
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    arriving = np.flatnonzero(np.random.default_rng(0).random(120) < 0.5)
    for i in arriving:
        rig.send(dataclasses.replace(frames[i % 2], depth_stamp=None,
                                     stamp=frames[0].stamp + int(i) * 33_333_333))
        time.sleep(0.01)
    node.wait_for_log('start the driver with config/fastdds.xml')
    rig.wait_until(lambda: 40 < int(values(rig).get(
        'colour images that did not arrive', 0)) < 80, 'the count in /diagnostics')


def test_one_stamp_in_the_future_is_rejected(rig, start_node, frames):
    """Published on /tf it would have tf2 refuse the transforms of all others."""
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    for i, frame in enumerate(frames):
        rig.send(frame if i != 3 else dataclasses.replace(
            frame, stamp=frame.stamp + 3600 * 10 ** 9, depth_stamp=None))
    good = [frame for i, frame in enumerate(frames) if i != 3]
    assert_answers(rig, good)
    assert rig.stamps() == [frame.stamp for frame in good]
    node.wait_for_log('is far ahead of those before')


def test_a_clock_set_forward_goes_on(rig, start_node, frames):
    start_node()
    rig.send_camera_info(frames[0].camera)
    later = [dataclasses.replace(frame, stamp=frame.stamp + 3600 * 10 ** 9, depth_stamp=None)
             for frame in frames[3:]]
    for frame in (*frames[:3], *later):
        rig.send(frame)
    assert_answers(rig, [*frames[:3], *later[1:]])  # one is needed to know that it is no stray


def test_stamps_ahead_of_the_nodes_clock_are_explained(rig, start_node, frames):
    node = start_node()
    ahead = time.time_ns() + 60 * 10 ** 9
    rig.send_camera_info(frames[0].camera)
    for i in range(2):
        rig.send(dataclasses.replace(frames[i], stamp=ahead + i * 10 ** 8, depth_stamp=None))
    node.wait_for_log("s ahead of this node's clock: let the clocks of both computers be")


def test_without_clock_simulated_time_is_explained_and_nothing_stops(rig, start_node, frames):
    node = start_node(use_sim_time='true')
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame)
    assert_answers(rig, frames)
    node.wait_for_log('use_sim_time is true, and nobody publishes /clock')


def test_a_bag_that_loops_goes_on_with_its_clock(rig, start_node, frames):
    """The clock goes back with the images; the pose stays where it was."""
    from rosgraph_msgs.msg import Clock
    clock = rig.node.create_publisher(Clock, '/clock', 10)
    start_node(use_sim_time='true')
    rig.send_camera_info(frames[0].camera)
    turns = [[dataclasses.replace(frame, stamp=frame.stamp + turn, depth_stamp=None)
              for frame in frames] for turn in (10 ** 10, 0)]
    for turn in turns:
        for frame in turn:
            clock.publish(Clock(clock=to_time(frame.stamp)))
            rig.send(frame)
        rig.answer(turn[-1].stamp)  # or a late depth image falls into the next turn
    first, second = ([from_pose(rig.answer(frame.stamp).pose.pose) for frame in turn]
                     for turn in turns)
    np.testing.assert_allclose(second[0], first[-1], atol=1e-9)
    # by then more is known of the camera, which may choose other keyframes
    np.testing.assert_allclose(se3.inverse(second[0]) @ second[-1], first[-1], atol=1e-3)


def test_a_topic_of_another_transport_is_named(rig, start_node, frames):
    rig.withdraw(rig.colour)
    rig.node.create_publisher(CompressedImage, 'rgb/image/compressed', 10)
    node = start_node(wait=False)
    node.wait_for_log('there is /rgb/image/compressed: set image_transport to compressed')


def test_depth_of_another_frame_is_reported_once(rig, start_node, frames):
    node = start_node()
    rig.send_camera_info(frames[0].camera)
    for frame in frames:
        rig.send(frame, depth=rig.image_message(frame.stamp, '32FC1', frame.depth, INFRARED))
    rig.answer(frames[-1].stamp)
    assert node.log.count('set register_depth to true') == 1
