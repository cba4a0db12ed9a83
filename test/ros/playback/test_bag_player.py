# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The bag player as a process: messages as recorded, with /clock, or step by step."""

import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import lz4.frame
import numpy as np
import pytest
from rclpy.logging import LoggingSeverity
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rosbags.interfaces import (
    Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime)
from rosbags.rosbag2 import Reader, Writer
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image

from aick_ros.borders import bag_limits, bag_reading
from aick_ros.borders.unpacking import unpack
from aick_ros.errors import InputError
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.playback import bag_player
from aick_ros.ros.playback.pace import RealTime, StepByStep
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

PLAYER_COMMAND = (sys.executable, '-c',
                  'from aick_ros.ros.process.entry_points import bag_player; bag_player()')
COUNT = 6
PATIENCE = 120.0  # seconds that nothing takes, even on a loaded machine
QOS = Qos(QosHistory.KEEP_LAST, 1, QosReliability.BEST_EFFORT, QosDurability.VOLATILE,
          QosTime(0, 0), QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False)


@pytest.fixture(scope='module')
def bag(tmp_path_factory, source):
    path = tmp_path_factory.mktemp('player') / 'bag'
    bag_writer.write_bag(path, SyntheticSource(
        SyntheticOptions(frames=COUNT, camera=source.frame(0).camera), source.scene))
    return path


@pytest.fixture
def play(rig):
    """Start bag_player with its topics remapped to those of the rig's own."""
    started = []

    def start(*arguments):
        started.append(subprocess.Popen(
            [*PLAYER_COMMAND, *map(str, arguments)],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            text=True))
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
        process.stdin.close()


def listen(rig):
    images, clocks = [], []
    rig.listen(Image, bag_writer.COLOUR_TOPIC, images.append)
    rig.listen(Image, bag_writer.DEPTH_TOPIC, lambda message: None)
    rig.listen(Clock, '/clock', clocks.append)
    return images, clocks


def test_plays_what_was_recorded_with_clock(rig, play, bag):
    images, clocks = listen(rig)
    assert play(bag).wait(PATIENCE) == 0
    rig.wait_until(lambda: len(images) == COUNT, 'all images')
    for image, frame in zip(images, open_source(bag).frames(raise_damage)):
        assert to_stamp(image.header.stamp) == frame.stamp
        np.testing.assert_array_equal(
            np.frombuffer(image.data, np.uint8).reshape(240, 320, 3), frame.colour)
    stamps = [to_stamp(message.clock) for message in clocks]
    assert stamps == sorted(stamps)
    assert stamps[-1] == to_stamp(images[-1].header.stamp)


def test_step_by_step(rig, play, bag):
    images, _ = listen(rig)
    player = play(bag, '--step')
    for step in range(1, 4):
        player.stdin.write('\n')
        player.stdin.flush()
        rig.wait_until(lambda: len(images) == step, f'image {step}')
    time.sleep(0.2)  # long enough for a player that does not wait
    assert len(images) == 3
    player.stdin.close()
    assert player.wait(PATIENCE) == 0


@pytest.mark.parametrize('make, sentence', [
    (lambda folder: folder / 'nowhere', 'cannot play'),
    (lambda folder: folder, 'the folder of a ROS 2 bag is required')])
def test_a_path_that_is_no_bag_is_rejected_in_one_line(ros_domain, tmp_path, make, sentence):
    run = subprocess.run(
        [*PLAYER_COMMAND, str(make(tmp_path))],
        capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert sentence in run.stderr
    assert run.stderr.count('\n') == 1


@pytest.mark.parametrize('arguments, sentence', [
    (['--rate', '0'], 'a number of at least 0.001'), (['--rate', 'nan'], 'at least 0.001'),
    (['--rate', '1e-300'], 'at least 0.001'), (['--wait', 'nan'], 'a number of at least 0'),
    (['--wait', '-1'], 'a number of at least 0'), (['--rate', 'x'], 'invalid float value'),
    (['--ros-args', '-r', 'x'], "Couldn't parse remap rule"),
    (['--ros-args', '--nonsense'], '--nonsense'), (['\udcff'], 'surrogates not allowed'),
    (['\x1b[31m'], r'unrecognized arguments: \x1b[31m')])
def test_arguments_are_rejected_in_one_printable_line(monkeypatch, capsys, arguments, sentence):
    monkeypatch.setattr(sys, 'argv', ['bag_player', 'bag', *arguments])
    with pytest.raises(SystemExit) as end:
        bag_player._arguments()
    error = capsys.readouterr().err
    assert end.value.code == 2 and sentence in error
    assert error.startswith('bag_player: ') and error.endswith('see bag_player --help\n')
    assert error[:-1].isprintable()


def test_a_name_that_ros_cannot_take_is_named(bag, tmp_path):
    named = os.fsdecode(os.fsencode(tmp_path) + b'/b\xffg')
    shutil.copytree(bag, named)
    run = subprocess.run([*PLAYER_COMMAND, named], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (2, '')
    assert run.stderr == (
        f'bag_player: the argument {tmp_path}/b\\xffg is not UTF-8, as ROS requires: rename what '
        'it names, or give a link to it\n')


def test_a_name_that_is_too_long_is_an_input_error():
    with pytest.raises(InputError, match='cannot play n+: it does not exist'):
        with bag_player._reading(Path('n' * 5000)):
            pass


def test_damage_of_any_kind_is_an_input_error(bag, tmp_path):
    damaged = tmp_path / 'bag'
    shutil.copytree(bag, damaged)
    (storage,) = damaged.glob('*.mcap')
    content = storage.read_bytes()
    for cut in (0, 7, 100, len(content) // 2, len(content) - 1):
        storage.write_bytes(content[:cut])
        with (pytest.raises(InputError, match='cannot play'),
              bag_player._reading(damaged) as reader):
            list(bag_player._readable(damaged, reader.messages(reader.connections)))


@pytest.mark.parametrize('key', ['name', 'type'])
@pytest.mark.parametrize('value', ['-1', 'true', '{}', '[]', '1.5'])
def test_names_that_are_no_text_are_an_input_error(bag, tmp_path, key, value):
    with (pytest.raises(InputError, match='cannot play .* no name of a topic or of a message'),
          bag_player._reading(with_metadata(bag, tmp_path, key, value))):
        pass


@pytest.mark.parametrize('name', ['/bad topic!', '""', "'../../etc/passwd'", '"\\x1b[31m"'])
def test_topics_without_a_valid_name_are_not_played(ros_domain, bag, tmp_path, name):
    run = subprocess.run([*PLAYER_COMMAND, str(with_metadata(bag, tmp_path, 'name', name))],
                         capture_output=True, text=True, timeout=PATIENCE)
    assert run.returncode == 2
    assert run.stderr.splitlines()[-1].endswith('has no topic whose message type is installed')
    assert all('is not played' in line for line in run.stderr.splitlines()[:-1])
    assert run.stderr.replace('\n', '').isprintable()


def with_metadata(bag, folder, key, value):
    """Return a copy of a bag with another value of a key of all topics in its metadata."""
    changed = folder / 'changed'
    shutil.copytree(bag, changed)
    path = changed / 'metadata.yaml'
    text = re.sub(rf'(\s*-?\s*{key}:).*', lambda match: f'{match[1]} {value}', path.read_text())
    assert value in text
    path.write_text(text)
    return changed


def test_a_chunk_that_unpacks_to_too_many_bytes_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr(unpack, '__defaults__', (1_000_000,))
    content = lz4.frame.compress(bytes(1_000_001))
    chunk = struct.pack('<QQQII3sQ', 0, 1, 9, 0, 3, b'lz4', len(content)) + content
    path = tmp_path / 'bomb.mcap'
    path.write_bytes(b'\x89MCAP0\r\n' + struct.pack('<BQI4sI', 1, 12, 4, b'ros2', 0)
                     + struct.pack('<BQ', 6, len(chunk)) + chunk
                     + struct.pack('<BQ', 2, 20) + bytes(20) + b'\x89MCAP0\r\n')
    for read in (bag_player._reading, lambda path: open_source(path)):
        with pytest.raises(InputError, match='unpacks to more than 1000000 bytes'):
            with read(path):
                pass


def test_chunks_and_metadata_are_limited(bag, tmp_path, monkeypatch):
    (storage,) = bag.glob('*.mcap')
    aliased = tmp_path / 'aliased'
    shutil.copytree(bag, aliased)
    with open(aliased / 'metadata.yaml', 'a') as file:
        file.write('a: &a [x, x]\nb: *a\n')
    with pytest.raises(InputError, match='its YAML has aliases'), bag_player._reading(aliased):
        pass
    monkeypatch.setattr(bag_limits, 'MAX_MESSAGE_BYTES', 50)
    monkeypatch.setattr(bag_reading, 'check_bag', lambda path: None)  # which comes before
    for path in (bag, storage):
        with (pytest.raises(InputError, match='has chunks of more than 50 bytes for one time'),
              bag_player._reading(path)):
            pass


@pytest.mark.parametrize('name', ['antigravity/x', 'antigravity/msg/fly', 'os/path', '', 'a/b/c/d',
                                  'sensor_msgs/msg/Nothing', 'sensor_msgs/msg/\u0301', '../msg/a'])
def test_types_that_are_no_messages_import_nothing(name):
    assert bag_player._message_class(name) is None
    assert 'antigravity' not in sys.modules


def test_messages_shorter_than_a_stamp_have_none():
    assert bag_player._header_stamp(bytes(11)) is None
    assert bag_player._header_stamp(b'\0\1\0\0' + struct.pack('<iI', 2, 3)) == 2_000_000_003


@pytest.fixture
def player(graph, bag):
    """Return the player of the bag in this process."""
    return graph.add(bag_player.BagPlayer(bag))


def recorded(bag):
    """Return topic, time of recording and bytes of each message, as rosbags reads them."""
    with Reader(bag) as reader:
        return [(connection.topic, stamp, message)
                for connection, stamp, message in reader.messages()]


def test_messages_are_published_byte_for_byte_each_after_its_time(
        graph, player, bag, monkeypatch):
    events, acknowledged = [], {}
    received = {each.topic_name: graph.listen(each.msg_type, each.topic_name, raw=True)
                for each in player.publishers if each.topic_name in player.topics}
    clocks = graph.listen(Clock, '/clock')
    wait = Publisher.wait_for_all_acked

    def watched(publisher, timeout):
        acknowledged[publisher.topic_name] = timeout.nanoseconds
        return wait(publisher, timeout)

    def pace(stamp):
        events.append(stamp)
        for topic in (*player.topics, '/clock'):
            graph.sent(player, topic)
        assert len(clocks) == len(events) - 1  # the clock does not run ahead
        assert sum(map(len, received.values())) == len(events) - 1

    monkeypatch.setattr(Publisher, 'wait_for_all_acked', watched)
    played = list(player.play(pace))
    expected = recorded(bag)
    assert [each.topic for each in played] == [topic for topic, *_ in expected]
    assert events == [stamp for _, stamp, _ in expected]
    assert [to_stamp(message.clock) for message in graph.sent(player, '/clock')] == events
    for topic in player.topics:
        assert graph.sent(player, topic) == [
            bytes(message) for name, _, message in expected if name == topic]
        assert acknowledged[topic] == 2 * 10 ** 9  # so that the last messages arrive
    times = [each.published_at for each in played]
    assert times == sorted(times) and abs(times[-1] - time.monotonic()) < PATIENCE


def test_only_images_have_a_stamp_which_is_that_of_their_header(player, bag, monkeypatch):
    def later(path, items):
        for connection, stamp, message in items:
            yield connection, stamp + 5_000_000, message  # as it takes a recorder to receive it
    monkeypatch.setattr(bag_player, '_readable', later)
    stamps = {}
    for each in player.play(lambda stamp: None):
        stamps.setdefault(each.topic, []).append(each.stamp)
    frames = list(open_source(bag).frames(raise_damage))
    assert stamps[bag_writer.COLOUR_TOPIC] == [frame.stamp for frame in frames]
    others = [stamp for topic, found in stamps.items() if 'image' not in topic for stamp in found]
    assert others and set(others) == {None}


def test_of_a_bag_all_is_played_but_its_clock_and_what_is_not_installed(graph, tmp_path):
    with Writer(tmp_path / 'bag', version=9) as writer:
        for topic, kind, qos in (
                ('/clock', 'rosgraph_msgs/msg/Clock', ()), ('/a', 'std_msgs/msg/Header', ()),
                ('/b', 'nothing/msg/Nothing', ()), ('/a', 'std_msgs/msg/Header', (QOS,))):
            writer.add_connection(topic, kind, msgdef='int32 x\n', rihs01='RIHS01_0',
                                  offered_qos_profiles=qos)
    player = graph.add(bag_player.BagPlayer(tmp_path / 'bag'))
    assert player.topics == ['/a']
    assert player.get_name() == 'bag_player'
    assert [each.topic_name for each in player.publishers].count('/clock') == 1
    assert [each.topic_name for each in player.publishers].count('/a') == 1
    assert graph.log(player) == [
        (LoggingSeverity.WARN, '/b is not played: nothing/msg/Nothing is not installed')]


def test_every_subscriber_is_matched_and_tf_static_is_kept_for_late_ones(player):
    for topic, publisher in player._publishers_by_topic.items():
        assert publisher.qos_profile.reliability is ReliabilityPolicy.RELIABLE, topic
        assert publisher.topic_name == topic
    for topic, durability in (('/tf_static', DurabilityPolicy.TRANSIENT_LOCAL),
                              ('/tf', DurabilityPolicy.VOLATILE)):
        qos = bag_player._qos(topic)
        assert (qos.durability, qos.reliability, qos.depth) == (
            durability, ReliabilityPolicy.RELIABLE, 10)


def test_all_of_the_topics_must_have_a_subscriber(graph, player):
    topics = [bag_writer.COLOUR_TOPIC, bag_writer.DEPTH_TOPIC]
    graph.listen(Image, topics[0])
    assert not player.has_subscribers(topics)
    assert player.has_subscribers(topics[:1])
    graph.listen(Image, topics[1])
    assert player.has_subscribers(topics)


@pytest.mark.parametrize('stamp', [-1, 2 ** 31 * 10 ** 9])
def test_a_time_of_recording_that_ros_cannot_have_is_rejected(
        graph, player, monkeypatch, stamp):
    graph.listen(Clock, '/clock')

    def messages(path, items):
        for connection, _, message in items:
            yield connection, stamp, message
    monkeypatch.setattr(bag_player, '_readable', messages)
    with pytest.raises(InputError, match=f'was recorded at {stamp} ns, which is no time of ROS'):
        next(player.play(lambda stamp: None))
    assert graph.sent(player, '/clock') == []


def test_the_stamp_of_a_header_is_read_in_either_byte_order():
    assert bag_player._header_stamp(b'\0\0\0\0' + struct.pack('>iI', 2, 3)) == 2_000_000_003
    assert bag_player._header_stamp(b'\0\1\0\0' + struct.pack('<iI', -1, 5)) == 5 - 10 ** 9


@pytest.mark.parametrize('name, kind', [('sensor_msgs/msg/Image', Image),
                                        ('rosgraph_msgs/msg/Clock', Clock)])
def test_types_are_those_of_their_package(name, kind):
    assert bag_player._message_class(name) is kind


def test_without_arguments_it_plays_as_recorded_and_waits_ten_seconds(monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['bag_player', 'a', '--ros-args', '-r', '/a:=/b'])
    arguments = bag_player._arguments()
    assert vars(arguments) == {'bag': Path('a'), 'rate': 1.0, 'step': False, 'wait': 10.0}
    monkeypatch.setattr(sys, 'argv', ['bag_player', 'a', '--rate', '0.001', '--wait', '0',
                                      '--step'])
    arguments = bag_player._arguments()
    assert (arguments.rate, arguments.wait, arguments.step) == (0.001, 0.0, True)


def test_a_bag_may_be_in_the_home_folder(monkeypatch, tmp_path):
    """As no shell fills in ~ in bag:=~/bag of the launch file."""
    monkeypatch.setenv('HOME', str(tmp_path))
    monkeypatch.setattr(sys, 'argv', ['bag_player', '~/bag'])
    assert bag_player._arguments().bag == tmp_path / 'bag'


@pytest.fixture
def playing(player, monkeypatch):
    """Return a player whose images get their subscribers after some looks, and which is asked."""
    def make(looks):
        asked = SimpleNamespace(topics=[], paces=[])
        monkeypatch.setattr(player, 'has_subscribers', lambda topics: (
            asked.topics.append(topics) or len(asked.topics) > looks))
        monkeypatch.setattr(player, 'play', lambda pace: asked.paces.append(pace) or iter('abc'))
        return asked
    return make


IMAGES = [bag_writer.COLOUR_TOPIC, bag_writer.DEPTH_TOPIC]


@pytest.mark.parametrize('step, rate', [(False, 1.0), (False, 2.5), (True, 1.0)])
def test_it_is_played_once_the_images_have_subscribers_at_the_pace_asked_for(
        graph, player, playing, step, rate):
    asked = playing(looks=3)
    bag_player._play(player, SimpleNamespace(bag='a', rate=rate, step=step, wait=PATIENCE))
    assert [sorted(topics) for topics in asked.topics] == 4 * [sorted(IMAGES)]
    assert graph.log(player) == [(LoggingSeverity.INFO, 'played 3 messages of a')]
    [pace] = asked.paces
    assert isinstance(pace, StepByStep if step else RealTime)
    assert step or pace._rate == rate


def test_after_the_wait_it_is_played_without_subscribers_and_that_is_said(
        graph, player, playing):
    playing(looks=10 ** 9)
    bag_player._play(player, SimpleNamespace(bag='a', rate=1.0, step=False, wait=0.0))
    images = ', '.join(topic for topic in player.topics if topic in IMAGES)
    assert graph.log(player) == [
        (LoggingSeverity.WARN, f'not all of {images} have a subscriber: remap them to the topics '
         'of the node'), (LoggingSeverity.INFO, 'played 3 messages of a')]
