# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files of measured lines that cannot be resumed."""

import dataclasses
import json
import os
from dataclasses import asdict

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark import journal as journal_module
from aick_ros.evaluation.benchmark.journal import FrameLine, PairLine, begin, reserved
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.frames.mask import ImageMask


@pytest.mark.parametrize(('lines', 'message'), [
    ('{"recordings": {}}\n', 'other recordings'),
    ('HEADER\nnonsense\n', 'line 2 is not a result'),
    ('HEADER\n{"method": "a"}\n', 'line 2 is not a result'),
    ('HEADER\n{"method": "a", "recording": "r", "frame": 0, "milliseconds": "2"}\n', 'line 2'),
    ('HEADER\n{"method": "a", "recording": "r", "frame": 0, "milliseconds": 1' + 400 * '0'
     + '}\n', 'line 2'),
    ('HEADER\n{"method": ["a"], "recording": "r", "frame": 0, "milliseconds": 2}\n', 'line 2'),
    ('HEADER\n{"method": "a", "recording": "r", "frame": 0.5, "milliseconds": 2}\n', 'line 2'),
    ('HEADER\n{"method": "a", "recording": "r", "frame": 0, "milliseconds": 1e999}\n', 'line 2'),
    ('HEADER\n' + 100_000 * '[' + '\n', 'line 2'),
    ('HEADER\n\x85\n', 'line 2')])
def test_a_file_of_another_run_is_rejected(recording, tmp_path, lines, message):
    path = tmp_path / 'x.partial'
    begin(path, [recording])
    path.write_text(lines.replace('HEADER', path.read_text().strip()))
    with pytest.raises(InputError, match=message):
        begin(path, [recording])


def test_a_file_that_is_no_text_is_rejected(recording, tmp_path):
    path = tmp_path / 'x.partial'
    begin(path, [recording])
    path.write_bytes(path.read_bytes() + b'\xff\n')
    with pytest.raises(InputError, match='x.partial: byte .* is not UTF-8 text'):
        begin(path, [recording])


def test_what_was_written_is_read(recording, tmp_path):
    lines = [FrameLine('aick', 'r', 3, 2.5),
             PairLine('aick', 'r', FramePair(0, 1), None, None, None, 'lost'),
             PairLine('aick', 'r', FramePair(1, 2), 0.5, 0, 3.0, '')]
    path = tmp_path / 'x.partial'
    first, second = begin(path, [recording]), begin(path, [recording])
    for line in lines:
        first.add(line)
    with path.open('a') as file:
        file.write('{"method"')  # another process is writing
        file.flush()
        second.refresh()
        assert (second.registrations, second.frames) == (2, {('aick', 'r'): {3: 2.5}})
        file.write(': "aick", "recording": "r", "frame": 4, "milliseconds": 1.0}\n')
    second.refresh()
    assert second.frames == {('aick', 'r'): {3: 2.5, 4: 1.0}}
    assert second.pairs == {('aick', 'r'): {line.pair: line for line in lines[1:]}}
    third = begin(path, [recording])
    assert (third.pairs, third.frames) == (second.pairs, second.frames)


def test_an_incomplete_line_is_removed(recording, tmp_path):
    path = tmp_path / 'x.partial'
    begin(path, [recording])
    whole = path.read_text()
    path.write_text(whole + '{"method": "cut o')  # as after a power failure
    begin(path, [recording])
    assert path.read_text() == whole


def test_one_command_at_a_time_writes_a_file(recording, tmp_path):
    path = tmp_path / 'x.partial'
    with reserved(path):
        begin(path, [recording])
        with pytest.raises(InputError, match='x.partial is written by another benchmark: wait'):
            with reserved(path):
                pytest.fail('it is written by two')
    with reserved(path):
        begin(path, [recording])


@pytest.mark.parametrize('make', [os.mkdir, os.mkfifo])
def test_a_place_that_is_no_file_is_named(tmp_path, make):
    make(tmp_path / 'x.partial')
    with pytest.raises(InputError, match='cannot write .*x.partial: '), reserved(
            tmp_path / 'x.partial'):
        pytest.fail('it is no file')


def test_a_file_that_is_removed_meanwhile_is_named(recording, tmp_path):
    journal = begin(tmp_path / 'x.partial', [recording])
    journal.path.unlink()
    with pytest.raises(InputError, match='x.partial is gone: another benchmark'):
        journal.refresh()


def test_a_run_on_another_machine_or_other_frames_is_another_run(recording, tmp_path, monkeypatch):
    path = tmp_path / 'x.partial'
    begin(path, [recording])
    sentence = ('x.partial belongs to a run on other recordings or another machine, with another '
                'mask or other versions: delete it to start anew, or give another --json file$')
    for others in ([], [recording, dataclasses.replace(recording, name='again')],
                   [dataclasses.replace(recording, stamps=recording.stamps[1:])],
                   [dataclasses.replace(recording, mask=ImageMask(None, (0.1, 0, 0, 0)))],
                   [dataclasses.replace(recording, request=dataclasses.replace(
                       recording.request, register_depth=True))]):
        with pytest.raises(InputError, match=sentence):
            begin(path, others)
    assert begin(path, [recording]).registrations == 0
    monkeypatch.setattr(journal_module, 'machine_facts', lambda: {'numpy': '0.9'})
    with pytest.raises(InputError, match=sentence):
        begin(path, [recording])


@pytest.mark.parametrize('field, value', [
    ('translation', 'x'), ('rotation', True), ('milliseconds', float('nan')), ('failure', None),
    ('recording', 1), ('pair', [0, 1, 2]), ('pair', [0.0, 1]), ('pair', [-1, 1]),
    ('pair', [True, 1]), ('other', 1)])
def test_a_pair_with_a_field_of_another_type_is_no_result(recording, tmp_path, field, value):
    line = asdict(PairLine('aick', 'r', FramePair(0, 1), 0.5, 0.25, 3.0, ''))
    path = tmp_path / 'x.partial'
    begin(path, [recording])
    with path.open('a') as file:
        file.write(json.dumps(line) + '\n' + json.dumps({**line, field: value}) + '\n')
    with pytest.raises(InputError, match='x.partial, line 3 is not a result: delete the file to '
                       'start anew$'):
        begin(path, [recording])
