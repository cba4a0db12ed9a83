# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The YAML of bags is parsed as rosbags does it, once, and within limits."""

import pytest
import ruamel.yaml
from rosbags.interfaces import (
    Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime)
from rosbags.rosbag2 import Reader, Writer, metadata, reader
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from aick_ros.borders.bag_metadata import limit_metadata, listed_files
from aick_ros.borders.limits import MAX_METADATA_BYTES, MAX_YAML_DEPTH
from aick_ros.errors import InputError

QOS = Qos(QosHistory.KEEP_LAST, 3, QosReliability.RELIABLE, QosDurability.VOLATILE, QosTime(1, 2),
          QosTime(3, 4), QosLiveliness.AUTOMATIC, QosTime(5, 6), False)
BOMB = 'a0: &a0 [x, x]\n' + ''.join(
    f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 9)}]\n' for i in range(1, 12))


@pytest.fixture(params=[reader, metadata])
def load(request):
    limit_metadata()
    return request.param.YAML(typ='safe').load


@pytest.mark.parametrize('text', [
    '', 'a: [1, 2.5, yes, 0o17, null, 2001-01-01]', '- history: 1\n  depth: 10\n',
    '[' * MAX_YAML_DEPTH + ']' * MAX_YAML_DEPTH])
def test_content_is_that_of_rosbags(load, text):
    assert load(text) == YAML(typ='safe').load(text)


def test_the_files_of_a_bag(tmp_path):
    with Writer(tmp_path / 'bag', version=9):
        pass
    assert listed_files((tmp_path / 'bag/metadata.yaml').read_bytes()) == ('.db3', ['bag.db3'])


@pytest.mark.parametrize('content', [
    b'', b'\xff', b'a: [', b'[]', b'rosbag2_bagfile_information: 1', BOMB.encode()])
def test_damage_is_left_to_rosbags(content):
    assert listed_files(content) == ('', [])


@pytest.mark.parametrize('text', ['a: [', 'a: 1\na: 2', '!!python/object:x {}', '\0'])
def test_errors_are_those_of_rosbags(load, text):
    with pytest.raises(ruamel.yaml.YAMLError):
        load(text)


@pytest.mark.parametrize('text, reason', [
    (BOMB, 'has aliases'), ('&a [*a]', 'has aliases'),
    ('[' * 900 + ']' * 900, f'deeper than {MAX_YAML_DEPTH} levels'), ('[' * 100_000, 'deeper'),
    ('-' * (MAX_METADATA_BYTES + 1), f'more than {MAX_METADATA_BYTES} characters')])
def test_what_is_too_large_is_rejected(load, text, reason):
    with pytest.raises(InputError, match=reason):
        load(text)


def test_more_values_than_the_limit_are_rejected(load, monkeypatch):
    monkeypatch.setattr('aick_ros.borders.bag_metadata.MAX_YAML_VALUES', 1000)
    assert load('- y\n' * 990) == 990 * ['y']
    with pytest.raises(InputError, match='more than 1000 values'):
        load('- x\n' * 1000)


def test_bags_are_written_as_before(tmp_path):
    """Up to version 8, rosbags writes the QoS by the class that it reads it with."""
    limit_metadata()
    types = get_typestore(Stores.ROS2_JAZZY)
    with Writer(tmp_path / 'bag', version=8) as writer:
        writer.add_connection('/a', 'std_msgs/msg/String', typestore=types,
                              offered_qos_profiles=[QOS])
    with Reader(tmp_path / 'bag') as bag:
        [connection] = bag.connections
        assert connection.ext.offered_qos_profiles == [QOS]


def test_a_text_is_parsed_once(load, monkeypatch):
    text = 'parsed: once'
    content = load(text)
    monkeypatch.setattr(YAML, 'parse', lambda *_: pytest.fail('it is parsed again'))
    assert load(text) == content
