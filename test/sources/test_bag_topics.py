# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of topics: the bags of common cameras, and ambiguous or missing topics."""

import pytest

from aick_ros.errors import InputError
from aick_ros.sources.bag_topics import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, BagTopics

POSE = 'geometry_msgs/msg/PoseStamped'
ODOMETRY = 'nav_msgs/msg/Odometry'

CAMERAS = {
    'RealSense': (
        {'/camera/camera/color/image_raw': IMAGE,
         '/camera/camera/color/image_raw/compressed': COMPRESSED_IMAGE,
         '/camera/camera/color/camera_info': CAMERA_INFO,
         '/camera/camera/depth/image_rect_raw': IMAGE,
         '/camera/camera/depth/camera_info': CAMERA_INFO,
         '/camera/camera/infra1/image_rect_raw': IMAGE,
         '/camera/camera/infra1/camera_info': CAMERA_INFO,
         '/camera/camera/aligned_depth_to_color/image_raw': IMAGE,
         '/camera/camera/aligned_depth_to_color/camera_info': CAMERA_INFO},
        ('/camera/camera/color/image_raw', '/camera/camera/aligned_depth_to_color/image_raw',
         '/camera/camera/color/camera_info')),
    'TUM': (
        {'/camera/rgb/image_color': IMAGE, '/camera/rgb/camera_info': CAMERA_INFO,
         '/camera/depth/image': IMAGE, '/camera/depth/camera_info': CAMERA_INFO,
         '/imu': 'sensor_msgs/msg/Imu'},
        ('/camera/rgb/image_color', '/camera/depth/image', '/camera/rgb/camera_info')),
    'Azure Kinect': (
        {'/rgb/image_raw': IMAGE, '/rgb/camera_info': CAMERA_INFO, '/depth/image_raw': IMAGE,
         '/depth/camera_info': CAMERA_INFO, '/depth_to_rgb/image_raw': IMAGE,
         '/depth_to_rgb/camera_info': CAMERA_INFO, '/ir/image_raw': IMAGE},
        ('/rgb/image_raw', '/depth_to_rgb/image_raw', '/rgb/camera_info')),
    'Orbbec, compressed': (
        {'/camera/color/image_raw/compressed': COMPRESSED_IMAGE,
         '/camera/color/camera_info': CAMERA_INFO,
         '/camera/depth/image_raw/compressed': COMPRESSED_IMAGE,
         '/camera/depth/image_raw/compressedDepth': COMPRESSED_IMAGE},
        ('/camera/color/image_raw/compressed', '/camera/depth/image_raw/compressedDepth',
         '/camera/color/camera_info')),
    'Kinect': (
        {'/camera/rgb/image_raw': IMAGE, '/camera/rgb/image_rect_color': IMAGE,
         '/camera/rgb/camera_info': CAMERA_INFO, '/camera/depth/image_raw': IMAGE,
         '/camera/depth_registered/image_raw': IMAGE},
        ('/camera/rgb/image_raw', '/camera/depth_registered/image_raw',
         '/camera/rgb/camera_info')),
    'plain names': (
        {'/image': IMAGE, '/depth': IMAGE, '/camera_info': CAMERA_INFO},
        ('/image', '/depth', '/camera_info')),
    'camera_info elsewhere': (
        {'/cam/image': IMAGE, '/cam/depth': IMAGE, '/calibration': CAMERA_INFO},
        ('/cam/image', '/cam/depth', '/calibration')),
}
TWO = {f'/{name}/{part}': type_ for name in ('left', 'right') for part, type_ in (
    ('color/image_raw', IMAGE), ('depth/image_raw', IMAGE), ('color/camera_info', CAMERA_INFO))}


@pytest.mark.parametrize('name', CAMERAS)
def test_topics_of_common_cameras_are_found(name):
    types, (colour, depth, info) = CAMERAS[name]
    topics = BagTopics(types, 'a.bag')
    assert topics.colour(None) == colour
    assert topics.depth(None, colour) == depth
    assert topics.info(None, colour) == info
    assert topics.ground_truth(None) is None


@pytest.mark.parametrize('registered, chosen', [
    (True, '/head/aligned_depth_to_color/image_raw'), (False, '/head/rgbd/depth/image_raw')])
def test_depth_in_the_image_of_colour_comes_before_depth_beside_it(registered, chosen):
    """Or the other way round, where the depth camera's own images are wanted."""
    colour = '/head/rgbd/color/image_raw'
    topics = BagTopics(dict.fromkeys(
        [colour, '/head/rgbd/depth/image_raw', '/head/aligned_depth_to_color/image_raw',
         '/foot/rgbd/depth/image_raw'], IMAGE), 'a bag')
    assert topics.depth(None, colour, registered) == chosen


def test_given_topics_are_used():
    types = {**CAMERAS['RealSense'][0], '/mocap/pose': POSE}
    topics = BagTopics(types, 'a.bag')
    infra = '/camera/camera/infra1/image_rect_raw'
    assert topics.colour(infra) == infra
    assert topics.depth('/camera/camera/depth/image_rect_raw', infra) == (
        '/camera/camera/depth/image_rect_raw')
    assert topics.info(None, infra) == '/camera/camera/infra1/camera_info'
    assert topics.ground_truth('/mocap/pose') == '/mocap/pose'


@pytest.mark.parametrize('transport', ['', '/compressed', '/compressedDepth'])
def test_the_calibration_beside_the_images_is_that_of_any_transport(transport):
    """Beside them it is taken whatever its name; infrared ones are not taken otherwise."""
    images = f'/camera/infra1/image_rect_raw{transport}'
    topics = BagTopics({images: COMPRESSED_IMAGE if transport else IMAGE,
                        '/camera/infra1/camera_info': CAMERA_INFO,
                        '/camera/color/camera_info': CAMERA_INFO}, 'a.bag')
    assert topics.info(None, images) == '/camera/infra1/camera_info'


def test_of_two_cameras_one_must_be_chosen():
    topics = BagTopics(TWO, 'two.bag')
    with pytest.raises(InputError, match=(
            '^two.bag has several that may be the colour topic, '
            '/left/color/image_raw, /right/color/image_raw: choose with --colour-topic$')):
        topics.colour(None)
    colour = topics.colour('/right/color/image_raw')
    assert topics.depth(None, colour) == '/right/depth/image_raw'
    assert topics.info(None, colour) == '/right/color/camera_info'
    assert topics.colour(None, '/left/depth/image_raw') == '/left/color/image_raw'


def test_errors_about_missing_topics_list_those_of_the_bag():
    topics = BagTopics({'/depth/image': IMAGE, '/imu': 'sensor_msgs/msg/Imu'}, 'a.bag')
    listing = r'it has /depth/image \(sensor_msgs/msg/Image\), /imu \(sensor_msgs/msg/Imu\)'
    with pytest.raises(InputError, match=f'a.bag has no colour topic .*--colour-topic; {listing}'):
        topics.colour(None)
    with pytest.raises(InputError, match=(
            fr'^a.bag has no camera_info topic \(sensor_msgs/msg/CameraInfo\): give it with '
            fr'--info-topic; {listing}$')):
        topics.info(None, '/x/image')
    with pytest.raises(InputError, match=f'on /rgb \\(--colour-topic\\); {listing}'):
        topics.colour('/rgb')
    with pytest.raises(InputError, match='has no .*PoseStamped.* on /imu'):
        topics.ground_truth('/imu')
    with pytest.raises(InputError, match='it has no messages'):
        BagTopics({}, 'a.bag').depth(None, '/rgb')


@pytest.mark.parametrize('topic, type_', [
    ('/ground_truth', POSE), ('/groundtruth/pose', POSE), ('/robot/ground_truth/odom', ODOMETRY)])
def test_ground_truth_is_found_by_its_name(topic, type_):
    topics = BagTopics({topic: type_, '/odom': ODOMETRY, '/pose': POSE}, 'a.bag')
    assert topics.ground_truth(None) == topic


def test_a_topic_of_another_type_is_not_ground_truth():
    assert BagTopics({'/ground_truth': 'nav_msgs/msg/Path'}, 'a.bag').ground_truth(None) is None


@pytest.mark.parametrize('name', [
    'infra1', 'ir', 'disparity', 'confidence', 'mask', 'label', 'debug', 'INFRARED'])
def test_images_of_other_kinds_are_neither(name):
    """Nor is their camera_info that of colour or depth, unless it lies beside the images."""
    others = {f'/camera/{name}/image_raw': IMAGE, f'/camera/depth/{name}': IMAGE,
              f'/camera/{name}/camera_info': CAMERA_INFO}
    topics = BagTopics({'/camera/a': IMAGE, '/camera/depth': IMAGE, '/x/camera_info': CAMERA_INFO,
                        **others}, 'a bag')
    assert topics.colour(None) == '/camera/a'
    assert topics.depth(None, '/camera/a') == '/camera/depth'
    assert topics.info(None, '/camera/a') == '/x/camera_info'


@pytest.mark.parametrize('name', ['first', 'circle', 'irregular'])
def test_ir_is_a_word_of_its_own(name):
    assert BagTopics({f'/{name}/image': IMAGE}, 'a bag').colour(None) == f'/{name}/image'


@pytest.mark.parametrize('better, worse', [
    ('/camera/rgb/image', '/camera/left/image'), ('/camera/color/image', '/camera/left/image'),
    ('/camera/colour/image', '/camera/left/image'), ('/camera/RGB/image', '/camera/left/image'),
    ('/rgb/image_raw', '/rgb/image_rect'), ('/rgb/image', '/rgb/image/compressed'),
    ('/rgb/image_raw/compressed', '/rgb/image/compressed')])
def test_of_two_colour_topics_the_better_one_is_taken(better, worse):
    topics = BagTopics({topic: COMPRESSED_IMAGE if topic.endswith('compressed') else IMAGE
                        for topic in (worse, better)}, 'a bag')
    assert topics.colour(None) == better


@pytest.mark.parametrize('better, worse', [
    ('/c/depth_registered/image', '/c/depth/image'), ('/c/aligned_depth/image', '/c/depth/image'),
    ('/c/depth_to_rgb/image', '/c/depth/image'), ('/c/Depth/image', '/d/depth/image'),
    ('/c/depth/image/compressedDepth', '/c/depth/image/compressed'),
    ('/c/depth/image_raw', '/c/depth/image_rect'),
    ('/c/depth/image', '/c/depth/a/compressedDepth')])
def test_of_two_depth_topics_the_better_one_is_taken(better, worse):
    topics = BagTopics({topic: COMPRESSED_IMAGE if 'compressed' in topic else IMAGE
                        for topic in (worse, better)}, 'a bag')
    assert topics.depth(None, '/c/rgb/image') == better


def test_the_calibration_of_depth_is_that_of_a_depth_camera():
    topics = BagTopics({'/c/rgb/camera_info': CAMERA_INFO, '/c/depth/camera_info': CAMERA_INFO,
                        '/d/depth/camera_info': CAMERA_INFO}, 'a bag')
    assert topics.depth_info(None, '/c/depth/image') == '/c/depth/camera_info'
    assert topics.depth_info(None, '/d/other/image') == '/d/depth/camera_info'
    assert topics.info(None, '/d/rgb/image') == '/c/rgb/camera_info'


@pytest.mark.parametrize('find, option', [
    (lambda topics: topics.colour('/x'), '--colour-topic'),
    (lambda topics: topics.depth('/x', '/rgb'), '--depth-topic'),
    (lambda topics: topics.info('/x', '/rgb'), '--info-topic'),
    (lambda topics: topics.depth_info('/x', '/depth'), '--depth-info-topic'),
    (lambda topics: topics.ground_truth('/x'), '--ground-truth-topic'),
    (lambda topics: topics.only_imu('/x'), '--imu-topic')])
def test_the_sentence_names_the_option_of_each_topic(find, option):
    with pytest.raises(InputError, match=rf'a bag has no .* on /x \({option}\); it has no mess'):
        find(BagTopics({}, 'a bag'))


def test_of_two_calibrations_beside_the_images_that_named_camera_info_is_taken():
    topics = BagTopics({'/c/rgb/image': IMAGE, '/c/rgb/camera_info': CAMERA_INFO,
                        '/c/rgb/a_info': CAMERA_INFO, '/c/rgb/z_info': CAMERA_INFO}, 'a bag')
    assert topics.info(None, '/c/rgb/image') == '/c/rgb/camera_info'
