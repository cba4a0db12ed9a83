# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bags whose depth is in the image of its own camera: against what the renderer registered."""

import numpy as np
import pytest
from rosbags.rosbag2 import Writer

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages.raw_image import encode_colour, encode_depth
from aick_ros.sources import SourceOptions, open_source, raise_damage
from aick_ros.sources.bag import BagSource
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.renderer import Renderer
from aick_ros.sources.writers.bag_messages import TYPESTORE, camera_info, image

COLOUR_CAMERA = Camera(320, 240, 262, 262, 159.5, 119.5)
DEPTH_CAMERA = Camera(256, 212, 182, 182, 127.2, 106.1)
T_COLOUR_DEPTH = se3.exp([0.05, -0.01, 0.005, 0.01, -0.02, 0.015])
T_BASE_COLOUR = se3.exp([0.2, 0.1, 0.5, -1.2, 1.2, -1.2])
STAMP = 5_000_000_000
NUMBERS = (*T_COLOUR_DEPTH[:3, 3], *se3.to_quaternion(T_COLOUR_DEPTH[:3, :3]))


@pytest.fixture(scope='module')
def views():
    """Return the depth of a room in the colour camera and in the depth camera, HxW [m]."""
    room = SyntheticSource(SyntheticOptions.perfect(seed=3, frames=1))
    T_world_colour = room.pose(room.ground_truth.stamps[0])
    surfaces = room.scene.surfaces
    return (Renderer(surfaces, COLOUR_CAMERA).render_depth(T_world_colour),
            Renderer(surfaces, DEPTH_CAMERA).render_depth(T_world_colour @ T_COLOUR_DEPTH))


def of_frame(message, frame):
    message.header.frame_id = frame
    return message


def tf_static(*links):
    """Return a message of links (parent, child, T_parent_child)."""
    types = TYPESTORE.types

    def link(parent, child, T):
        header = of_frame(image(STAMP, encode_depth(np.ones((1, 1), np.float32))), parent).header
        return types['geometry_msgs/msg/TransformStamped'](
            header, child, types['geometry_msgs/msg/Transform'](
                types['geometry_msgs/msg/Vector3'](*map(float, T[:3, 3])),
                types['geometry_msgs/msg/Quaternion'](
                    *map(float, se3.to_quaternion(T[:3, :3])))))
    return types['tf2_msgs/msg/TFMessage']([link(*each) for each in links])


COLOUR = ('/rgb/image_raw', of_frame(image(STAMP, encode_colour(
    np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8))), 'rgb'))
INFO = '/rgb/camera_info', camera_info(STAMP, COLOUR_CAMERA)
DEPTH_INFO = '/depth/camera_info', camera_info(STAMP, DEPTH_CAMERA)
TREE = ('/tf_static', tf_static(
    ('base', 'rgb', T_BASE_COLOUR), ('/base', '/depth', T_BASE_COLOUR @ T_COLOUR_DEPTH)))


def depth(view, frame='depth', topic='/depth/image_raw'):
    return topic, of_frame(image(STAMP, encode_depth(view)), frame)


def write(path, *messages):
    connections = {}
    with Writer(path, version=9) as writer:
        for topic, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=TYPESTORE)
            writer.write(connections[topic], STAMP,
                         TYPESTORE.serialize_cdr(message, message.__msgtype__))
    return path


def assert_registered(frame, truth):
    seen = np.isfinite(frame.depth) & np.isfinite(truth)
    assert seen.mean() > 0.8
    error = np.abs(frame.depth - truth)[seen] / truth[seen]
    assert np.median(error) < 1e-4
    assert np.mean(error < 0.003) > 0.9  # the others lie beside edges


@pytest.mark.parametrize('given', [False, True], ids=['by /tf_static', 'by option'])
def test_depth_is_registered_to_colour(tmp_path, views, given):
    truth, measured = views
    extrinsic = () if given else (TREE,)
    bag = write(tmp_path / 'bag', *extrinsic, INFO, DEPTH_INFO, COLOUR, depth(measured))
    options = SourceOptions(register_depth=True, depth_in_colour=NUMBERS if given else None)
    frame, = open_source(bag, options).frames(raise_damage)
    assert frame.camera == COLOUR_CAMERA
    assert_registered(frame, truth)


def test_where_it_is_not_the_option_that_does_it_is_named(tmp_path, views):
    bag = write(tmp_path / 'bag', TREE, INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    with pytest.raises(InputError, match=r'or register it here \(--register-depth\)$'):
        list(open_source(bag).frames(raise_damage))


def test_images_whose_depth_is_to_be_registered_are_not_to_be_played_as_they_are(tmp_path, views):
    bag = write(tmp_path / 'bag', TREE, INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    assert BagSource(bag).raw_topics == (COLOUR[0], '/depth/image_raw', INFO[0])
    assert BagSource(bag, SourceOptions(register_depth=True)).raw_topics is None


def test_a_topic_of_that_name_with_other_messages_has_no_transforms(tmp_path, views):
    text = '/tf_static', TYPESTORE.types['std_msgs/msg/String']('none')
    bag = write(tmp_path / 'bag', text, INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    with pytest.raises(InputError, match="has no transform from 'depth' .* on /tf_static: give"):
        list(open_source(bag, SourceOptions(register_depth=True)).frames(raise_damage))


def test_the_given_extrinsic_comes_before_tf_static(tmp_path, views):
    wrong = '/tf_static', tf_static(('rgb', 'depth', np.eye(4)))
    bag = write(tmp_path / 'bag', wrong, INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    options = SourceOptions(register_depth=True, depth_in_colour=NUMBERS)
    frame, = BagSource(bag, options).frames(raise_damage)
    assert_registered(frame, views[0])


def test_the_depth_cameras_own_images_are_preferred(tmp_path, views):
    """Without the option, the images that the driver registered are."""
    registered = depth(views[0], 'rgb', '/aligned_depth_to_color/image_raw')
    bag = write(tmp_path / 'bag', TREE, INFO, DEPTH_INFO, COLOUR, depth(views[1]), registered)
    frame, = BagSource(bag).frames(raise_damage)
    np.testing.assert_array_equal(frame.depth, views[0])
    frame, = BagSource(bag, SourceOptions(register_depth=True)).frames(raise_damage)
    assert_registered(frame, views[0])
    assert not np.array_equal(frame.depth, views[0], equal_nan=True)


def test_images_of_one_frame_need_no_transform(tmp_path, views):
    bag = write(tmp_path / 'bag', INFO, ('/depth/camera_info', INFO[1]), COLOUR,
                depth(views[0], 'rgb'))
    frame, = BagSource(bag, SourceOptions(register_depth=True)).frames(raise_damage)
    assert np.mean(np.abs(frame.depth - views[0]) < 1e-5) > 0.98


def test_a_missing_extrinsic_ends_the_reading(tmp_path, views):
    bag = write(tmp_path / 'bag', ('/tf_static', tf_static(('base', 'rgb', T_BASE_COLOUR))), INFO,
                DEPTH_INFO, COLOUR, depth(views[1]))
    source = BagSource(bag, SourceOptions(register_depth=True))
    with pytest.raises(InputError, match="bag has no transform from 'depth' .* to 'rgb' .* on "
                       '/tf_static: .*--depth-in-colour'):
        list(source.frames(lambda error: None))


@pytest.mark.parametrize('numbers', [NUMBERS[:6], (0.0,) * 7])
def test_an_extrinsic_that_is_no_pose_is_rejected(tmp_path, views, numbers):
    bag = write(tmp_path / 'bag', INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    with pytest.raises(InputError, match='--depth-in-colour .* is no pose: x y z qx qy qz qw'):
        BagSource(bag, SourceOptions(register_depth=True, depth_in_colour=numbers))


def test_a_missing_calibration_of_the_depth_camera_is_rejected(tmp_path, views):
    bag = write(tmp_path / 'bag', INFO, COLOUR, depth(views[1]))
    with pytest.raises(InputError, match='no depth camera_info topic .*--depth-info-topic'):
        BagSource(bag, SourceOptions(register_depth=True))


def test_a_given_calibration_topic_is_used(tmp_path, views):
    bag = write(tmp_path / 'bag', TREE, INFO, ('/calibration', DEPTH_INFO[1]), COLOUR,
                depth(views[1]))
    options = SourceOptions(register_depth=True, depth_info_topic='/calibration',
                            info_topic=INFO[0])
    frame, = BagSource(bag, options).frames(raise_damage)
    assert_registered(frame, views[0])


def test_depth_has_the_camera_of_the_latest_camera_info(tmp_path, views):
    other = '/depth/camera_info', camera_info(STAMP, COLOUR_CAMERA)
    bag = write(tmp_path / 'bag', TREE, INFO, other, DEPTH_INFO, COLOUR, depth(views[1]))
    frame, = BagSource(bag, SourceOptions(register_depth=True)).frames(raise_damage)
    assert_registered(frame, views[0])


def test_depth_of_another_size_than_its_calibration_is_reported(tmp_path, views):
    bag = write(tmp_path / 'bag', TREE, INFO, DEPTH_INFO, COLOUR, depth(views[0]))
    damage = []
    assert list(BagSource(bag, SourceOptions(register_depth=True)).frames(damage.append)) == []
    assert '/depth/image_raw at 5.000000000: the image is 320 x 240 pixels' in str(damage[0])


@pytest.mark.parametrize('options', [
    {'depth_info_topic': '/depth/camera_info'}, {'depth_in_colour': NUMBERS}])
def test_without_register_depth_its_calibration_is_rejected(tmp_path, views, options):
    bag = write(tmp_path / 'bag', INFO, DEPTH_INFO, COLOUR, depth(views[1]))
    with pytest.raises(InputError, match='has no effect without --register-depth'):
        BagSource(bag, SourceOptions(**options))
