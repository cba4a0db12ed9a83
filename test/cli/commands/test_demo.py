# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a demonstration plays to the node, and what it makes of the answers."""

import json
import os
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.cli.commands import demo
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory, read_trajectory
from aick_ros.ros.playback.answers import UNKNOWN, Answer, LiveRun
from aick_ros.sources import SourceOptions

T_BASE_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
TOPICS = ('/camera/rgb/image_raw', '/camera/depth/image_raw', '/camera/rgb/camera_info')


def test_the_base_is_where_its_camera_and_the_extrinsic_say():
    """A base that drives ahead: its camera looks along x, with y down."""
    bases = np.array([se3.from_roll_pitch_yaw(0.1, 0.2, 0.3 * i, (0.5 * i, -0.2, 0.1))
                      for i in range(5)])
    found = demo._of_base(Trajectory(np.arange(5), bases @ T_BASE_CAMERA))
    np.testing.assert_array_equal(found.stamps, np.arange(5))
    np.testing.assert_allclose(found.poses, bases, atol=1e-12)
    assert demo._of_base(None) is None


@pytest.fixture
def played(monkeypatch, recording):
    """Let a node answer all frames but one, exactly; return what was asked of its parts."""
    asked = SimpleNamespace(opened=[], written=[], rates=[], played=[], plotted=[], answers=None)
    truth = recording.ground_truth
    bases = truth.poses @ se3.inverse(T_BASE_CAMERA)
    stamps = [frame.stamp for frame in recording.frames(None)]
    answers = [Answer(stamp, se3.inverse(bases[0]) @ bases[list(truth.stamps).index(stamp)],
                      np.eye(6), np.zeros(6), 0.05 + i) for i, stamp in enumerate(stamps[1:], 1)]

    def play(bag, topics, show):
        asked.played.append((bag, topics))
        show(1)
        return LiveRun({stamp: float(i) for i, stamp in enumerate(stamps)},
                       answers if asked.answers is None else asked.answers)

    def open_source(*arguments):
        asked.opened.append(arguments)
        return recording

    def write_bag(bag, source, on_damaged, progress):
        bag.mkdir()
        progress(1, 2)
        asked.written.append((bag, source))
        for error in asked.damage:
            on_damaged(error)

    asked.damage = []
    monkeypatch.setattr(demo, '_player', lambda rate: (asked.rates.append(rate), play)[1])
    monkeypatch.setattr(demo, 'open_source', open_source)
    monkeypatch.setattr(demo, 'SyntheticSource',
                        lambda options: (asked.opened.append(options.frames), recording)[1])
    monkeypatch.setattr(demo.bag_writer, 'write_bag', write_bag)
    monkeypatch.setattr(demo, 'plot_path',
                        lambda *parts: (asked.plotted.append(parts), 'a.png')[1])
    return asked


@pytest.fixture
def lost(recording):
    """Return the answers of a node that tracks no frame."""
    return [Answer(frame.stamp, np.eye(4), UNKNOWN, np.zeros(6), 0.05 + i)
            for i, frame in enumerate(recording.frames(None))]


def test_a_rendered_sequence_is_played_and_scored(aick, played, recording, tmp_path):
    outcome = aick('demo', '--frames', '14', '--rate', '2.5', '--json', 'live.json')
    assert (outcome.code, outcome.err, played.rates, played.opened[0]) == (0, '', [2.5], 14)
    folder = (tmp_path / 'runs' / 'latest').resolve()
    assert folder.name.startswith('demo-in_memory-')
    bag = tmp_path / 'runs' / folder.name / 'bag'
    [(asked_bag, source)], [(played_bag, topics)] = played.written, played.played
    assert asked_bag == played_bag and bag.samefile(asked_bag) and source is recording
    assert topics == TOPICS
    content = json.loads((tmp_path / 'live.json').read_text())
    assert (content['source'], content['frames_played'], content['frames_answered']) == (
        'in memory', len(recording), len(recording) - 1)
    assert content['delay_ms'] == {'p50': pytest.approx(50), 'p99': pytest.approx(50)}
    assert max(content['trajectory'].values()) < 1e-6
    estimate = read_trajectory(folder / 'trajectory.tum')
    assert len(estimate) == len(recording) - 1
    lines = outcome.out.splitlines()
    assert lines[0].strip() == 'odom_node on in memory'
    assert lines[-3:] == [f'trajectory of base_link: runs/{folder.name}/trajectory.tum',
                          'plot: a.png', f'played bag (may be deleted): runs/{folder.name}/bag']
    [(png, name, shown, truth, images)] = played.plotted
    assert (str(png), name, images) == (f'runs/{folder.name}/trajectory.png', 'in memory',
                                        recording)
    assert len(shown) == len(estimate)
    np.testing.assert_allclose(truth.poses[0] @ T_BASE_CAMERA, recording.ground_truth.poses[0],
                               atol=1e-9)
    assert played.opened[-1] == (asked_bag, SourceOptions(None, *TOPICS))


def test_a_demo_that_is_taken_for_a_run_is_named(aick, played, tmp_path):
    assert aick('demo').code == 0
    for bag in ('runs/latest/bag', 'SOURCE'):
        for command in (['view', 'runs/latest', '--save', 'x.rrd'],
                        ['compare', 'runs/latest', 'runs/latest']):
            outcome = aick(*command)
            assert (outcome.code, outcome.sentence) == (
                2, 'runs/latest is the folder of a demo (aick demo), not of a run: aick view '
                   f'{bag} shows the recording that it played, aick replay {bag} makes a run of '
                   'it to view or compare')
        if bag != 'SOURCE':
            (tmp_path / bag).rmdir()  # it may be deleted


def test_a_recording_is_written_as_a_bag_and_json_stands_alone(aick, played, tmp_path):
    outcome = aick('demo', 'desk', '--out', 'there', '--json', '-')
    assert (outcome.code, played.opened[0], played.rates) == (
        0, ('desk', SourceOptions()), [1.0])
    assert json.loads(outcome.out)['frames_not_tracked'] == 0
    assert 'trajectory of base_link: there/' in outcome.err and 'plot: a.png' in outcome.err
    assert (tmp_path / 'there' / 'latest' / 'trajectory.tum').is_file()


def test_a_bag_of_raw_images_is_played_as_it_is(aick, played, monkeypatch, recording, tmp_path):
    monkeypatch.setattr(demo, 'BagSource', type(recording))
    monkeypatch.setattr(recording, 'raw_topics', ('/c', '/d', '/i'), raising=False)
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').touch()
    outcome = aick('demo', 'bag')
    assert [(str(bag), topics) for bag, topics in played.played] == [('bag', ('/c', '/d', '/i'))]
    assert played.written == [] and 'may be deleted' not in outcome.out
    assert played.opened[-1][1] == SourceOptions(None, '/c', '/d', '/i')


def test_a_bag_of_which_no_image_can_be_used_is_not_played(
        aick, played, monkeypatch, in_memory, tmp_path):
    """As one whose depth is to be registered: the node would say the same, and then more."""
    class Spoilt(in_memory):
        raw_topics = TOPICS

        def frames(self, on_damaged):
            on_damaged(InputError('depth is not registered: give --register-depth'))
            return iter(())

    monkeypatch.setattr(demo, 'BagSource', Spoilt)
    monkeypatch.setattr(demo, 'open_source', lambda *_: Spoilt([]))
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').touch()
    outcome = aick('demo', 'bag')
    assert (outcome.code, outcome.err.splitlines()) == (2, [
        'aick: skipped: depth is not registered: give --register-depth',
        'aick: in memory has no usable frame'])
    assert (played.played, (tmp_path / 'runs').exists()) == ([], False)


@pytest.mark.parametrize('flags', [['--register-depth'], ['--depth-info-topic', '/x']])
def test_depth_of_a_rendered_sequence_is_not_to_be_registered(aick, played, flags):
    assert aick('demo', *flags).sentence == (
        f'{flags[0]} has no effect on a rendered recording: omit it')


def test_damaged_images_are_an_unusable_input(aick, played):
    played.damage = [InputError('1.png is torn')]
    outcome = aick('demo', 'desk')
    assert outcome.code == 2 and 'skipped: 1.png is torn' in outcome.err


def test_without_ground_truth_there_are_no_errors(aick, played, monkeypatch, recording):
    monkeypatch.setattr(recording, 'ground_truth', None)
    content = json.loads(aick('demo', 'desk', '--json', '-').out)
    assert set(content['trajectory'].values()) == {None}
    assert played.plotted[0][3] is None


def test_a_recording_of_which_nothing_was_tracked_has_no_errors_and_says_so(aick, played, lost):
    """As one whose depth images are empty: poses at the start are no measurement."""
    played.answers = lost
    outcome = aick('demo', 'desk', '--json', '-')
    content = json.loads(outcome.out)
    assert content['frames_not_tracked'] == content['frames_answered'] > 0
    assert set(content['trajectory'].values()) == {None}
    assert outcome.code == 2 and outcome.err.splitlines()[-1] == (
        'aick: no frame of in memory was tracked: see the log of odom_node above')


def test_a_node_without_answers_is_an_error_that_leaves_nothing(aick, played, tmp_path):
    played.answers = []
    outcome = aick('demo', 'desk')
    assert (outcome.code, outcome.sentence) == (
        2, 'odom_node answered none of the 14 frames of in memory: see its log above')
    assert list(tmp_path.iterdir()) == []


def test_the_node_has_a_domain_of_its_own_and_answers_every_frame(monkeypatch, tmp_path):
    live_run = pytest.importorskip('aick_ros.ros.playback.live_run')
    asked = []
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        monkeypatch.setenv(name, 'before')
    monkeypatch.setattr(live_run, 'run_live', lambda *parts, **named: asked.append((parts, named)))
    demo._player(3.0)(tmp_path, TOPICS, print)
    [((bag, remappings, parameters, pace), named)] = asked
    assert (bag, named) == (tmp_path, {'on_progress': print})
    assert remappings == dict(zip(('rgb/image', 'depth/image', 'rgb/camera_info'), TOPICS))
    assert parameters['process_every_frame'] is True and parameters['topic_queue_size'] == 30
    T = se3.from_quaternion(parameters['camera_in_base'][3:], parameters['camera_in_base'][:3])
    np.testing.assert_allclose(T, T_BASE_CAMERA, atol=1e-12)
    assert pace._rate == 3.0
    assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert 1 <= int(os.environ['ROS_DOMAIN_ID']) <= 101


def test_advice_about_a_calibration_can_be_followed(aick, tmp_path):
    """The demo has no --camera: the command that makes a recording with a calibration is named."""
    (tmp_path / 'tum').mkdir()
    for name in ('rgb.txt', 'depth.txt'):
        (tmp_path / 'tum' / name).write_text('1 a.png\n')
    outcome = aick('demo', 'tum')
    assert outcome.code == 2
    assert 'with --camera FILE (of aick convert, for commands without this option)' in (
        outcome.sentence)
    assert '{"width": ..., "height": ...' in outcome.sentence
    assert '--camera' in aick('convert', '--help').out
