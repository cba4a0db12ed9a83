# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings in a bucket of an S3 server on this machine."""

import socket

import pytest

from aick_ros.cli.fleet import urls
from aick_ros.cli.fleet.content import state_of
from aick_ros.cli.fleet.pace import SilentServerError
from aick_ros.cli.fleet.recordings import find_recordings
from aick_ros.cli.fleet.scratch import Scratch
from aick_ros.errors import InputError

pytest.importorskip('s3fs', reason="no S3: pip install '.[test]'")
moto_server = pytest.importorskip('moto.server', reason="no S3 server: pip install '.[test]'")

FILES = {'day 1/tum/rgb.txt': b'1 rgb/a#%41.png', 'day 1/tum/rgb/a#%41.png': bytes(100),
         'day 1/loose/1.mcap': b'one', 'day 2/2.bag': b'two',
         'day 3/3.bag/metadata.yaml': b'3', 'day 3/3.bag/3.mcap': b'three'}


@pytest.fixture(scope='module')
def bucket():
    """Return the URL of a bucket with files in it."""
    import s3fs
    server = moto_server.ThreadedMotoServer('127.0.0.1', port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (('AWS_ENDPOINT_URL', f'http://{host}:{port}'),
                            ('AWS_ACCESS_KEY_ID', 'key'), ('AWS_SECRET_ACCESS_KEY', 'secret'),
                            ('AWS_DEFAULT_REGION', 'us-east-1')):
            patch.setenv(name, value)
        system = s3fs.S3FileSystem()
        system.mkdir('robot')
        system.pipe({f'robot/{name}': content for name, content in FILES.items()})
        yield 's3://robot'
    server.stop()


def test_recordings_of_a_bucket_are_found(bucket):
    assert find_recordings([bucket], None) == [
        f'{bucket}/day 1/loose/1.mcap', f'{bucket}/day 1/tum', f'{bucket}/day 2/2.bag',
        f'{bucket}/day 3/3.bag']
    assert find_recordings([f'{bucket}/day*/loose/*.mcap'], None) == [
        f'{bucket}/day 1/loose/1.mcap']


def test_recordings_of_a_bucket_arrive(bucket, tmp_path):
    scratch = Scratch(tmp_path / 'scratch', 1000)
    with scratch.copy_of(f'{bucket}/day 1/tum') as copy:
        assert copy.path.name == 'tum'
        assert {path.name: path.read_bytes() for path in copy.path.rglob('*')
                if path.is_file()} == {'rgb.txt': b'1 rgb/a#%41.png', 'a#%41.png': bytes(100)}
        assert copy.bytes_copied == 115
    with scratch.copy_of(f'{bucket}/day 2/2.bag') as copy:
        assert (copy.path.name, copy.path.read_bytes()) == ('2.bag', b'two')


def test_a_folder_may_have_the_name_of_a_file(bucket, tmp_path):
    with Scratch(tmp_path / 'scratch', 1000).copy_of(f'{bucket}/day 3/3.bag') as copy:
        assert {path.name: path.read_bytes() for path in copy.path.iterdir()} == {
            'metadata.yaml': b'3', '3.mcap': b'three'}


def test_the_state_changes_with_the_content(bucket):
    import s3fs
    before = state_of(f'{bucket}/day 2/2.bag')
    assert state_of(f'{bucket}/day 2/2.bag') == before
    s3fs.S3FileSystem().pipe({'robot/day 2/2.bag': b'222'})
    assert state_of(f'{bucket}/day 2/2.bag') != before
    s3fs.S3FileSystem().pipe({'robot/day 2/2.bag': b'two'})


@pytest.mark.parametrize('source', ['/none', '/none.bag', '-other/x.bag'])
def test_what_a_bucket_has_not_is_named(bucket, source):
    with pytest.raises(InputError, match=f'{source} does not exist'):
        [found] = find_recordings([bucket + source], None)
        state_of(found)


@pytest.fixture
def silent(monkeypatch):
    """Return a server that accepts connections and never answers."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        monkeypatch.setenv('AWS_ENDPOINT_URL', f'http://127.0.0.1:{server.getsockname()[1]}')
        for name in ('ACCESS_KEY_ID', 'SECRET_ACCESS_KEY'):
            monkeypatch.setenv(f'AWS_{name}', 'x')
        yield server


def connections(server):
    """Return how often a server was connected to."""
    server.setblocking(False)
    count = 0
    while True:
        try:
            server.accept()[0].close()
        except BlockingIOError:
            return count
        count += 1


def test_a_server_that_is_silent_is_asked_twice(silent, monkeypatch):
    monkeypatch.setattr(urls, 'SILENCE_LIMIT', 0.2)
    with pytest.raises(SilentServerError, match='s3://silent/a.bag: .*; try later, or copy'):
        state_of('s3://silent/a.bag')
    assert connections(silent) == 2


def test_limits_of_the_user_go_first(silent, monkeypatch):
    from fsspec.config import conf
    own = {'read_timeout': 0.1, 'retries': {'total_max_attempts': 3}}
    monkeypatch.setitem(conf, 's3', {'config_kwargs': own})
    system, _ = urls.open_url('s3://silent/b.bag')
    assert (system.config_kwargs, system.retries) == (own, type(system).retries)
