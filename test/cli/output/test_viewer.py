# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Where a view goes: a file, a browser, a window; and what is checked before."""

import os
import socket
import sys
from types import SimpleNamespace

import pytest

from aick_ros.cli.output import viewer as viewer_module
from aick_ros.cli.output.viewer import viewer
from aick_ros.errors import InputError

rerun = pytest.importorskip('rerun', reason='no viewer: pip install rerun-sdk')


@pytest.fixture
def windows(monkeypatch, tmp_path):
    """Return the files that streams of Rerun write in place of opening a window."""
    files = []

    def spawn(stream):
        files.append(tmp_path / f'{len(files)}.rrd')
        stream.save(files[-1])

    monkeypatch.setattr(rerun.RecordingStream, 'spawn', spawn)
    return files


def recording(path):
    """Return application and identity of the recording in a file, and its values by name."""
    from rerun.chunk import RrdReader
    reader = RrdReader(str(path))
    [entry] = reader.recordings()
    batches = [chunk.to_record_batch() for chunk in reader.stream().to_chunks()]
    return entry.application_id, entry.recording_id, {
        name: column.to_pylist() for batch in batches
        for name, column in zip(batch.schema.names, batch.columns)}


@pytest.mark.parametrize('display', ['DISPLAY', 'WAYLAND_DISPLAY'])
def test_a_window_is_opened_on_either_kind_of_display(windows, monkeypatch, display):
    for name in ('DISPLAY', 'WAYLAND_DISPLAY'):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(display, ':7')
    for count in (1, 2):
        with viewer('a\x1bb', None, web=False) as stream:
            assert len(windows) == count
            stream.log('number', rerun.Scalars(7.0))
    (application, first, values), (_, second, _) = map(recording, windows)
    assert application == 'aick_ros' and first != second
    assert values['RecordingInfo:name'] == [[r'a\x1bb']]
    assert values['Scalars:scalars'] == [[7.0]]


def test_a_file_appears_whole_and_rerun_logs_nothing(monkeypatch, tmp_path):
    monkeypatch.delenv('RUST_LOG', raising=False)
    target = tmp_path / 'x.rrd'
    with viewer('x', target, web=False) as stream:
        assert os.environ['RUST_LOG'] == 'off'
        stream.log('number', rerun.Scalars(1.0))
        assert not target.exists()
    assert target.stat().st_size > 100
    monkeypatch.setenv('RUST_LOG', 'info')
    with viewer('x', target, web=False):
        assert os.environ['RUST_LOG'] == 'info'


@pytest.mark.parametrize('free, is_full', [(10 ** 6 - 1, True), (10 ** 6, False)])
def test_a_disk_is_full_below_a_megabyte(monkeypatch, tmp_path, free, is_full):
    asked = []
    monkeypatch.setattr(viewer_module.shutil, 'disk_usage', lambda path: (
        asked.append(path), SimpleNamespace(free=free, used=0, total=10 ** 12))[1])
    assert viewer_module._is_full(tmp_path / 'x.rrd') is is_full
    assert asked == [tmp_path]


def test_a_disk_is_that_of_the_file_a_link_leads_to(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(viewer_module.shutil, 'disk_usage', lambda path: (
        asked.append(path), SimpleNamespace(free=10 ** 9))[1])
    (tmp_path / 'disk').mkdir()
    os.mkfifo(tmp_path / 'disk' / 'pipe')
    for name in ('y.rrd', 'pipe'):  # what /dev/stdout leads to may be a pipe without a folder
        (tmp_path / 'x.rrd').symlink_to(f'disk/{name}')
        viewer_module._is_full(tmp_path / 'x.rrd')
        (tmp_path / 'x.rrd').unlink()
    assert asked == [tmp_path / 'disk', tmp_path]


def test_a_full_disk_is_looked_at_before_the_draft_is_removed(monkeypatch, tmp_path):
    """Removed, it would leave space enough."""
    monkeypatch.setattr(viewer_module.shutil, 'disk_usage', lambda path: SimpleNamespace(
        free=0 if [file for file in tmp_path.iterdir() if file.stat().st_size] else 10 ** 9))
    with pytest.raises(InputError, match='x.rrd: the disk is full; make room there$'):
        with viewer('x', tmp_path / 'x.rrd', web=False) as stream:
            stream.log('number', rerun.Scalars(1.0))
            stream.flush()
            raise RuntimeError('File-writer thread shut down prematurely')
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('save, sentence', [
    (None, 'the viewer ended: it broke'), ('x.rrd', 'cannot write x.rrd: it broke')])
def test_errors_of_rerun_are_a_sentence(monkeypatch, tmp_path, save, sentence):
    monkeypatch.chdir(tmp_path)
    path = save and tmp_path.joinpath(save).relative_to(tmp_path)
    with pytest.raises(InputError) as raised, viewer_module._errors_of(path):
        raise RuntimeError('it broke')
    assert str(raised.value) == sentence


def test_other_errors_are_ours():
    with pytest.raises(NotImplementedError), viewer_module._errors_of(None):
        raise NotImplementedError('a kind of RuntimeError')


def test_a_port_that_was_just_used_is_taken_again():
    """Its last connection waits in the kernel for a minute; a server may have the port then."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        port = server.getsockname()[1]
        with socket.create_connection(('127.0.0.1', port)):
            accepted, _ = server.accept()
            accepted.close()  # first, so that this end waits
    assert viewer_module._free_port(port) == port


def test_rerun_without_one_of_its_own_packages_is_named_too(monkeypatch):
    monkeypatch.setitem(sys.modules, 'rerun', None)
    with pytest.raises(InputError, match=r"no view without rerun: pip install '.\[view\]'"):
        with viewer('x', None, web=False):
            pytest.fail('it goes on')
