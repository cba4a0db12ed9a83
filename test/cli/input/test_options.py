# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Precedence of the values of a setting: preset, file, command line."""

import pytest

from aick_ros.cli.input.options import bytes_from, gaps_from, settings_from
from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset
from aick_ros.settings.text import config_text


@pytest.fixture
def config(tmp_path):
    """Return a function that writes a parameter file."""
    def write(text):
        file = tmp_path / 'node.yaml'
        file.write_text(text)
        return file
    return write


def aick_values(settings):
    return settings.aick.alpha, settings.aick.iterations, settings.features.max_keypoints


def test_command_line_over_file_over_preset(config):
    file = config('/**: {ros__parameters: {aick.iterations: 7, aick: {alpha: 0.5}}}')
    assert settings_from(None, None, None) == Settings()
    assert aick_values(settings_from('paper-full', None, None)) == (0.8, 25, 0)
    assert aick_values(settings_from('paper-full', file, None)) == (0.5, 7, 0)
    assert aick_values(settings_from('paper-full', file, ['aick.iterations=3'])) == (0.5, 3, 0)
    assert aick_values(settings_from(None, None, ['aick.alpha = 0.3'])) == (
        0.3, Settings().aick.iterations, Settings().features.max_keypoints)


def test_the_file_may_name_the_preset(config):
    file = config('odom_node: {ros__parameters: {preset: paper-full, aick: {alpha: 0.5}}}')
    assert aick_values(settings_from(None, file, None)) == (0.5, 25, 0)
    assert aick_values(settings_from('paper-fast', file, None)) == (0.5, 10, 350)
    empty = config("odom_node: {ros__parameters: {preset: ''}}")
    assert settings_from(None, empty, None) == Settings()


@pytest.mark.parametrize('name', ['frame_id', 'approx_sync', 'topic_queue_size'])
def test_parameters_of_the_node_alone_are_rejected(name):
    """A parameter file for the node may have them; who sets one here expects an effect."""
    with pytest.raises(InputError) as raised:
        settings_from(None, None, ['aick.alpha=0.5', f'{name}=1'])
    assert str(raised.value) == (f'--set {name}: this is a parameter of the node alone and has no '
                                 'effect on recordings: omit it')


@pytest.mark.parametrize('nodes, alpha', [
    ('/**', 0.5), ('odom_node', 0.5), ('/robot/odom_node', 0.5), ('/robot/*', 0.5)])
def test_reads_the_sections_of_this_node(config, nodes, alpha):
    file = config(f'{nodes}:\n  ros__parameters:\n    aick:\n      alpha: {alpha}\n'
                  'camera:\n  ros__parameters:\n    serial: 12\n')
    assert settings_from(None, file, None).aick.alpha == alpha


def test_takes_nested_namespaces_and_later_sections(config):
    file = config('/**: {ros__parameters: {aick.alpha: 0.5, aick.iterations: 4}}\n'
                  'robot: {odom_node: {ros__parameters: {aick.alpha: 0.4}}}\n')
    assert aick_values(settings_from(None, file, None))[:2] == (0.4, 4)


def test_reads_what_the_node_reads(config):
    settings = with_values(preset('paper-full'), {'sensor.depth_sigma': 1e-6})
    file = config(config_text(NodeSettings(frame_id='camera_link'), settings))
    assert settings_from('paper-fast', file, None) == settings


def test_parameters_of_ros_and_of_the_node_do_no_harm(config):
    file = config('odom_node: {ros__parameters: {use_sim_time: true, frame_id: base, '
                  'qos_overrides: {/tf: {publisher: {depth: 3}}}, publish_tf: false}}')
    assert settings_from(None, file, None) == Settings()


@pytest.mark.parametrize('text, sentence', [
    ('/**: {ros__parameters: {aick.alhpa: 0.5}}', 'did you mean aick.alpha'),
    ('/**: {ros__parameters: {aick: {alpha: 1.5}}}', 'aick.alpha = 1.5 is outside 0 to 1'),
    ('/**: {ros__parameters: {aick: {iterations: }}}', 'aick.iterations has no value'),
    ('/**: {ros__parameters: {frame_idd: base}}', 'did you mean frame_id'),
    ('/**: {ros__parameters: {publish_tf: 3}}', 'publish_tf = 3 is not true or false'),
    ('/**: {ros__parameters: }', 'ros__parameters has no parameters'),
    ('/**: {ros__parameters: {preset: best}}', "unknown preset 'best'"),
    ('aick: {alpha: 0.5}', 'has no parameters: write the parameters under "ros__parameters:"'),
    ('', 'has no parameters'),
    ('camera: {ros__parameters: {serial: 12}}',
     'has parameters of /camera, but none of odom_node'),
    ('/**: {ros__parameters: [1, 2', 'it is not YAML')])
def test_an_invalid_file_is_rejected_in_one_sentence(config, text, sentence):
    with pytest.raises(InputError) as error:
        settings_from(None, config(text), None)
    assert sentence in str(error.value)
    assert '\n' not in str(error.value)


def test_a_missing_or_binary_file_is_rejected(tmp_path):
    with pytest.raises(InputError, match='cannot read the settings .*none.yaml'):
        read_settings_file(tmp_path / 'none.yaml')
    (tmp_path / 'image.yaml').write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match='cannot read the settings .*image.yaml'):
        read_settings_file(tmp_path / 'image.yaml')


@pytest.mark.parametrize('assignment, sentence', [
    ('aick.alpha', '--set aick.alpha: NAME=VALUE is required'),
    ('aick.alpha=', "aick.alpha = '' is not a number"),
    ('aick.alpha=2', 'outside 0 to 1'),
    ('aick.apha=0.5', 'did you mean aick.alpha'),
    ('features.detector=brisk', "is none of 'orb', 'surf', 'sift'")])
def test_an_invalid_assignment_is_rejected(assignment, sentence):
    with pytest.raises(InputError) as error:
        settings_from(None, None, [assignment])
    assert sentence in str(error.value)


def test_an_unknown_preset_is_rejected():
    with pytest.raises(InputError, match='unknown preset .*paper-full, paper-fast'):
        settings_from('paper', None, None)


@pytest.mark.parametrize('text, gaps', [
    ('1', [1]), ('5,1,5', [1, 5]), (' 10 , 2', [2, 10]), ('1000000', [1000000]),
    (','.join(map(str, range(1, 101))), list(range(1, 101)))])
def test_gaps_are_whole_numbers_in_order_each_once(text, gaps):
    assert gaps_from(text) == gaps


@pytest.mark.parametrize('text', ['', '0', '-1,5', '1.5', '1,', 'x', '1000001',
                                  ','.join(map(str, range(1, 102)))])
def test_what_are_no_gaps_is_shown_shortened_with_what_would_be(text):
    with pytest.raises(InputError) as error:
        gaps_from(text)
    assert str(error.value) == (
        f'--gaps {text[:80]}: at most 100 whole numbers from 1 to 1000000 are required, for '
        'example --gaps 1,5,10')


@pytest.mark.parametrize('text, count', [
    ('0', 0), ('7', 7), ('1kB', 1000), ('50GB', 50 * 10 ** 9), ('1.5MiB', 3 * 2 ** 19)])
def test_numbers_of_bytes_have_units(text, count):
    pytest.importorskip('dask', reason="no processes: pip install '.[fleet]'")
    assert bytes_from('--memory-limit', text) == count


@pytest.mark.parametrize('text', ['', 'much', '-1', '5 parrots', '1e400'])
def test_what_is_no_number_of_bytes_is_named_with_its_option(text):
    pytest.importorskip('dask', reason="no processes: pip install '.[fleet]'")
    with pytest.raises(InputError) as error:
        bytes_from('--scratch-limit', text)
    assert str(error.value) == f'--scratch-limit {text} is no number of bytes: try 50GB'


@pytest.mark.parametrize('node, is_ours', [
    ('odom_node', True), ('/odom_node', True), ('/robot/odom_node', True), ('/**', True),
    ('/robot/*', True), ('my_odom_node', False), ('/odom_node/child', False)])
def test_sections_are_those_of_the_node_in_any_namespace(config, node, is_ours):
    file = config(f'"{node}": {{ros__parameters: {{aick.iterations: 7}}}}')
    if is_ours:
        assert settings_from(None, file, None).aick.iterations == 7
    else:
        with pytest.raises(InputError, match=f'has parameters of .*{node}, but none of odom_node'):
            settings_from(None, file, None)


def test_a_settings_file_says_what_is_in_it(config):
    file = config('odom_node: {ros__parameters: {preset: paper-fast, use_sim_time: true, '
                  'aick: {alpha: 0.5}, frame_id: base}}')
    found = read_settings_file(file)
    assert (found.path, found.preset, found.changes) == (
        file, 'paper-fast', {'aick.alpha': 0.5, 'frame_id': 'base'})
    assert read_settings_file(config('/**: {ros__parameters: {preset: ""}}')).preset is None


def test_a_plane_needs_what_no_recording_has(tmp_path):
    """In the file of a robot on wheels, too, which is read once it is switched off."""
    file = tmp_path / 'robot.yaml'
    file.write_text('/**: {ros__parameters: {odometry: {planar: true, max_speed: 1.5}}}')
    for config, assignments in ((file, None), (None, ['odometry.planar=true'])):
        with pytest.raises(InputError, match='only the node knows: add --set odometry'):
            settings_from(None, config, assignments)
    settings = settings_from(None, file, ['odometry.planar=false'])
    assert settings.odometry.max_speed == 1.5
