# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is given to a command reaches what it is for, in each command that takes it."""

from contextlib import nullcontext
from importlib import import_module
from pathlib import Path

import pytest

from aick_ros.cli.commands import benchmark as benchmark_module
from aick_ros.cli.commands import convert as convert_module
from aick_ros.cli.commands import fleet as fleet_module
from aick_ros.cli.commands import vocabulary as vocabulary_module
from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.settings.parameter import values, with_values
from aick_ros.settings.presets import preset
from aick_ros.sources import SourceOptions

READING = ['--camera', 'camera.json', '--colour-topic', '/c', '--depth-topic', '/d',
           '--info-topic', '/i', '--ground-truth-topic', '/g', '--max-interval', '0.07']
OPTIONS = {'camera': Path('camera.json'), 'colour_topic': '/c', 'depth_topic': '/d',
           'info_topic': '/i', 'ground_truth_topic': '/g', 'max_interval': 0.07}
REGISTERED = ['--register-depth', '--depth-info-topic', '/di', '--depth-in-colour',
              '0.1', '0.2', '0.3', '0', '0', '0', '1']
REGISTERED_OPTIONS = {'register_depth': True, 'depth_info_topic': '/di',
                      'depth_in_colour': (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0)}
SETTINGS = ['--preset', 'paper-fast', '--config', 'node.yaml', '--set', 'aick.alpha=0.7']
EXPECTED = {'aick.iterations': 33, 'aick.alpha': 0.7}


@pytest.fixture
def config(tmp_path):
    """Write a parameter file that changes the preset, and is overridden itself."""
    path = tmp_path / 'node.yaml'
    path.write_text('/**:\n  ros__parameters:\n    aick.iterations: 33\n    aick.alpha: 0.1\n')
    return path


def stop(asked):
    """Return a function that notes what it is called with, and ends the command."""
    def note(*arguments, **options):
        asked.append((*arguments, *options.values()))
        raise InputError('enough is known')
    return note


@pytest.mark.parametrize('command, others', [
    ('replay', []), ('evaluate', []), ('noise', []), ('convert', ['out']),
    ('view', ['--save', 'x.rrd'])])
def test_a_recording_is_opened_as_it_is_asked_for(aick, monkeypatch, command, others):
    asked = []
    monkeypatch.setattr(import_module(f'aick_ros.cli.commands.{command}'), 'open_source',
                        stop(asked))
    for flags, expected in ((READING, OPTIONS),
                            (READING + REGISTERED, OPTIONS | REGISTERED_OPTIONS),
                            ([], {})):
        assert aick(command, 'desk.bag', *others, *flags).sentence == 'enough is known'
        assert asked.pop() == ('desk.bag', SourceOptions(**expected))


@pytest.mark.parametrize('command, others', [('vocabulary', ['--out', 'words']), ('demo', [])])
def test_depth_is_registered_where_it_is_asked_for(aick, monkeypatch, command, others):
    asked, module = [], import_module(f'aick_ros.cli.commands.{command}')
    monkeypatch.setattr(module, 'open_source', stop(asked))
    if command == 'demo':
        monkeypatch.setattr(module, '_player', lambda rate: None)
    for flags, expected in ((REGISTERED, REGISTERED_OPTIONS), ([], {})):
        assert aick(command, 'desk.bag', *others, *flags).sentence == 'enough is known'
        assert asked.pop() == ('desk.bag', SourceOptions(**expected))


@pytest.mark.parametrize('command, function', [
    ('replay', 'Odometry'), ('evaluate', 'evaluate_source'), ('noise', 'estimate_noise'),
    ('view', 'Odometry')])
def test_the_settings_are_those_of_preset_file_and_assignment(
        aick, monkeypatch, recording, config, command, function):
    asked, flags = [], SETTINGS if command != 'noise' else SETTINGS[2:]
    module = import_module(f'aick_ros.cli.commands.{command}')
    monkeypatch.setattr(module, 'open_source', lambda *_: recording)
    monkeypatch.setattr(module, function, stop(asked))
    outcome = aick(command, 'desk.bag', *flags, *['--save', 'x.rrd'] * (command == 'view'))
    assert outcome.err.endswith('enough is known\n')
    [given] = [each for each in asked.pop() if hasattr(each, 'aick')]
    base = preset('paper-fast') if command != 'noise' else type(given)()
    assert values(given) == values(with_values(base, EXPECTED))


@pytest.mark.parametrize('command, function', [
    ('evaluate', 'evaluate_source'), ('noise', 'estimate_noise'), ('convert', 'write_bag')])
def test_no_more_frames_are_read_than_the_limit(aick, monkeypatch, recording, command, function):
    asked = []
    module = import_module(f'aick_ros.cli.commands.{command}')
    monkeypatch.setattr(module, 'open_source', lambda *_: recording)
    monkeypatch.setattr(module, function, stop(asked))
    aick(command, 'desk.bag', '--limit', '5', *['out'] * (command == 'convert'))
    [reading] = [each for each in asked.pop() if hasattr(each, 'ground_truth')]
    assert len(list(reading.frames())) == 5


@pytest.mark.parametrize('command, option', [
    ('replay', '--json'), ('evaluate', '--json'), ('noise', '--json'), ('fleet', '--json'),
    ('view', '--save')])
@pytest.mark.parametrize('name, flags', [
    ('camera.json', ['--camera', 'camera.json']), ('node.yaml', ['--config', 'node.yaml']),
    ('words.npz', ['--set', 'aick.vocabulary=words.npz']), ('desk.bag', [])])
def test_results_replace_no_input(aick, config, tmp_path, command, option, name, flags):
    for each in ('camera.json', 'words.npz', 'desk.bag'):
        (tmp_path / each).touch()
    before = (tmp_path / name).read_bytes()
    outcome = aick(command, 'desk.bag', *flags, option, name)
    assert (outcome.code, outcome.sentence.partition(';')[0]) == (
        2, f'cannot write {name}: it is an input of this command')
    assert (tmp_path / name).read_bytes() == before


@pytest.mark.parametrize('registers', [False, True])
def test_a_fleet_passes_everything_on_to_each_of_its_runs(
        aick, monkeypatch, config, tmp_path, registers):
    asked = []
    monkeypatch.setattr(fleet_module, 'connected', lambda cluster: asked.append(cluster))
    monkeypatch.setattr(fleet_module, '_Fleet', stop(asked))
    (tmp_path / 'desk.bag').touch()
    (tmp_path / 'hall.bag').touch()
    aick('fleet', 'desk.bag', 'hall.bag', *READING, *REGISTERED * registers, *SETTINGS, '--limit',
         '7', '--gaps', '2,3', '--scratch-limit', '3GB', '--vary', 'aick.lambda_e=0.02,0.03')
    expected = OPTIONS | REGISTERED_OPTIONS if registers else OPTIONS
    _, jobs, variants = asked.pop()
    assert [variant.name for variant in variants] == [
        'aick.lambda_e=0.02', 'aick.lambda_e=0.03']
    found = [(Path(job.source).name, job.variant) for job in jobs.values()]
    assert found == [(name, variant.name) for name in ('desk.bag', 'hall.bag')
                     for variant in variants]
    assert list(jobs) == [(job.source, job.variant) for job in jobs.values()]
    for job in jobs.values():
        assert job.options == SourceOptions(**expected | {'camera': tmp_path / 'camera.json'})
        assert (list(job.gaps), job.limit, job.scratch.limit) == ([2, 3], 7, 3 * 10 ** 9)
        assert values(job.settings) == values(with_values(preset('paper-fast'), {
            **EXPECTED, 'aick.lambda_e': float(job.variant.partition('=')[2])}))
    assert len({job.scratch.fleet for job in jobs.values()}) == 1


@pytest.mark.parametrize('flags, expected', [
    ([], (2, 'auto', None, True)), (['--workers', '1'], (1, 'auto', None, True)),
    (['--memory-limit', '2GB', '--no-dashboard'], (2, '2GB', None, False)),
    (['--scheduler', 'tcp://x:1'], (2, 'auto', 'tcp://x:1', True))])
def test_a_fleet_starts_the_cluster_that_is_asked_for(aick, monkeypatch, flags, expected):
    asked = []
    monkeypatch.setattr(fleet_module, 'connected', stop(asked))
    aick('fleet', 'synthetic:1', 'synthetic:2', *(flags if '--workers' in flags else [
        '--workers', '9', *flags]))
    [(cluster,)] = asked
    assert (cluster.workers, cluster.memory_limit, cluster.scheduler,
            cluster.has_dashboard) == expected


@pytest.mark.parametrize('flags, request_, plan, time_limit, workers', [
    ([], {}, {'gaps': [1, 2, 3, 5, 8, 10, 15], 'most_pairs': None}, 300.0, 1),
    (['--limit', '9', '--max-interval', '0.07', '--gaps', '2,4', '--pairs', '6', '--time-limit',
      '2.5', '--jobs', '2', '--mask', 'body.png', *REGISTERED],
     {'limit': 9, 'max_interval': 0.07, 'mask': 'body.png', **REGISTERED_OPTIONS},
     {'gaps': [2, 4], 'most_pairs': 6}, 2.5, 2)])
def test_a_benchmark_registers_what_is_asked_for(
        aick, monkeypatch, recording, flags, request_, plan, time_limit, workers):
    def scan(request, on_progress, on_damaged):
        requests.append(request)
        stamps = tuple(frame.stamp for frame in recording.frames(None))
        return Recording(request.path, request, stamps, recording.ground_truth)

    requests, clusters, asked = [], [], []
    monkeypatch.setattr(benchmark_module.Recording, 'scan', scan)
    monkeypatch.setattr(benchmark_module.Request, 'open', lambda self: recording)
    monkeypatch.setattr(benchmark_module, 'connected', lambda cluster: (
        clusters.append(cluster), nullcontext('client'))[1])
    monkeypatch.setattr(benchmark_module, 'run_plan', stop(asked))
    assert aick('benchmark', 'desk.bag', 'hall.bag', '--methods', 'aick,aick-orb', *flags
                ).sentence == 'enough is known'
    assert requests == [Request(name, **request_) for name in ('desk.bag', 'hall.bag')]
    [(given, journal, scratch, client, limit, *_)] = asked
    assert [method.name for method in given.methods] == ['aick', 'aick-orb']
    assert [each.name for each in given.recordings] == ['desk.bag', 'hall.bag']
    assert {'gaps': list(given.gaps), 'most_pairs': given.most_pairs} == plan
    assert (given.variants, client, limit) == ([], 'client', time_limit)
    assert journal.path.parent == scratch
    assert [cluster.workers for cluster in clusters] == [workers]


def test_a_vocabulary_is_learned_as_it_is_asked_for(aick, monkeypatch, recording, config):
    learned, kept = [], []
    monkeypatch.setattr(vocabulary_module, 'open_source', lambda *_: recording)
    monkeypatch.setattr(vocabulary_module, 'KeypointExtractor', lambda *settings: (
        kept.append(settings), KeypointExtractor(*settings))[1])
    monkeypatch.setattr(vocabulary_module, 'learn_words', stop(learned))
    aick('vocabulary', 'desk.bag', '--out', 'w', '--words', '12', '--every', '3', '--seed', '4',
         '--limit', '7', *SETTINGS)
    [(descriptors, words, seed, *_)] = learned
    [(features, sensor)] = kept
    settings = with_values(preset('paper-fast'), EXPECTED)
    assert (features, sensor) == (settings.features, settings.sensor)
    extractor = KeypointExtractor(features, sensor)
    frames = list(recording.frames(None))[:7:3]
    assert (words, seed) == (12, 4)
    assert len(descriptors) == sum(len(extractor.extract(frame)) for frame in frames)


@pytest.mark.parametrize('flags, storage, encoding', [
    ([], 'mcap', '32FC1'), (['--storage', 'sqlite3', '--depth-encoding', '16UC1'], 'sqlite3',
                            '16UC1')])
def test_a_bag_is_written_as_it_is_asked_for(aick, monkeypatch, recording, flags, storage,
                                             encoding):
    asked = []
    monkeypatch.setattr(convert_module, 'open_source', lambda *_: recording)
    monkeypatch.setattr(convert_module, 'write_bag', stop(asked))
    aick('convert', 'desk.bag', 'out', *flags)
    assert (asked[0][0], *asked[0][2:4]) == (Path('out'), storage, encoding)


@pytest.mark.parametrize('flags, seconds', [([], float('inf')), (['--time-limit', '2.5'], 2.5)])
def test_a_fleet_has_the_time_limit_that_is_asked_for(aick, monkeypatch, flags, seconds):
    limits = []
    monkeypatch.setattr(fleet_module._Fleet, 'run',
                        lambda self, cluster, given, interruption: limits.append(given))
    aick('fleet', 'synthetic:1', *flags)
    assert [limit.seconds for limit in limits] == [seconds]
