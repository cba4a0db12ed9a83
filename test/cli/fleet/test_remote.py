# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files and folders of a file system in memory, as a server lists them."""

import os
from types import SimpleNamespace

import pytest

fsspec = pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
from aick_ros.cli.fleet import remote  # noqa: E402
from aick_ros.cli.fleet.folders import Entry  # noqa: E402
from aick_ros.cli.fleet.remote import (  # noqa: E402
    RemoteFile, files_of, is_one_file, recordings_at)
from aick_ros.errors import InputError  # noqa: E402


@pytest.fixture
def server():
    """Return a function that makes files of some sizes, and their URL."""
    system = fsspec.filesystem('memory')
    system.rm('/top', recursive=True) if system.exists('/top') else None

    def make(**sizes):
        for name, size in sizes.items():
            system.pipe(f'/top/{name.replace("__", "/")}', bytes(size))
        return 'memory://top'
    yield make
    system.rm('/top', recursive=True)


def test_files_are_those_below_with_their_sizes(server):
    url = server(a=1, day__b=2, day__deep__c=0)
    files = {file.name: (file.path, file.size) for file in files_of(url)}
    assert files == {'top/a': ('/top/a', 1), 'top/day/b': ('/top/day/b', 2),
                     'top/day/deep/c': ('/top/day/deep/c', 0)}


def test_one_file_is_a_recording_with_its_name_and_a_folder_may_have_such_a_name(server):
    server(**{'x.mcap': 3, 'y.mcap__metadata.yaml': 4})
    (one,), (inside,) = files_of('memory://top/x.mcap'), files_of('memory://top/y.mcap')
    assert (one.name, one.size) == ('x.mcap', 3)
    assert (inside.name, inside.size) == ('y.mcap/metadata.yaml', 4)


@pytest.mark.parametrize('count, is_too_many', [(3, False), (4, True)])
def test_more_files_than_the_limit_are_no_recording(server, monkeypatch, count, is_too_many):
    monkeypatch.setattr(remote, 'MAX_REMOTE_FILES', 3)
    url = server(**{f'f{i}': 1 for i in range(count)})
    if is_too_many:
        with pytest.raises(InputError, match='has more than 3 files: name a recording'):
            files_of(url)
    else:
        assert len(files_of(url)) == 3


@pytest.mark.parametrize('depth, is_too_deep', [(2, False), (1, True)])
def test_folders_in_each_other_have_a_limit(server, monkeypatch, depth, is_too_deep):
    monkeypatch.setattr(remote, 'MAX_REMOTE_DEPTH', depth)
    url = server(**{'a__b__rgb.txt': 1, 'a__b__depth.txt': 1})
    if is_too_deep:
        for ask in (files_of, lambda each: list(recordings_at(each))):
            with pytest.raises(InputError, match='deeper than 1: name a recording'):
                ask(url)
    else:
        assert len(files_of(url)) == 2
        assert list(recordings_at(url)) == ['memory://top/a/b']


def test_recordings_are_found_by_folder_and_by_pattern(server):
    url = server(**{'a__x.mcap': 1, 'a__y.bag': 1, 'b__z.db3': 1, 'c__notes.txt': 1})
    assert list(recordings_at(url)) == [f'{url}/{name}' for name in (
        'a/x.mcap', 'a/y.bag', 'b/z.db3')]
    assert [each.rpartition('/')[2] for each in recordings_at(f'{url}/*/*.[bd]*')] == [
        'y.bag', 'z.db3']
    assert list(recordings_at(f'{url}/a/x.mcap')) == [f'{url}/a/x.mcap']


def test_brackets_of_a_server_are_no_pattern():
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    assert list(recordings_at('http://[::1]:1/a.mcap')) == ['http://[::1]:1/a.mcap']


@pytest.mark.parametrize('name', ['x.mcap', 'folder/x.mcap'])
def test_pipes_and_devices_are_not_copied(tmp_path, name):
    """They may never end."""
    (tmp_path / 'folder').mkdir()
    given, reason = tmp_path / name.partition('/')[0], f'{name} is not a regular file'
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=f'cannot be copied: .*{reason}'):
        files_of(f'file://{given}')
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to('/dev/zero')
    with pytest.raises(InputError, match=f'cannot be copied: .*{reason}'):
        files_of(f'file://{given}')


def test_links_to_files_are_copied_with_the_facts_of_the_files(tmp_path):
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'there').write_bytes(bytes(5000))
    os.utime(tmp_path / 'there', (1, 1))
    link = tmp_path / 'folder/x.mcap'
    link.symlink_to('../there')
    for given, name in ((tmp_path / 'folder', 'folder/x.mcap'), (link, 'x.mcap')):
        assert files_of(f'file://{given}') == [RemoteFile(str(link), name, 5000, '1.0')]


def test_links_to_nothing_are_not_copied(tmp_path):
    (tmp_path / 'x.png').symlink_to('nowhere')
    with pytest.raises(InputError, match='cannot be copied: .*x.png is not a regular file'):
        files_of(f'file://{tmp_path}')


def test_nothing_to_read_is_said(server):
    url = server(notes=1)
    with pytest.raises(InputError, match='has no recording: at a URL it is a .mcap, .db3, .bag'):
        list(recordings_at(url))


@pytest.mark.parametrize('url, is_one', [
    ('http://x/a.mcap', True), ('http://x/a.bag?b', True), ('s3://x/a.db3', True),
    ('s3://x/a.txt', False), ('s3://x/a.mcap/b', False)])
def test_the_name_says_what_may_be_one_file(url, is_one):
    assert is_one_file(url) is is_one


@pytest.mark.parametrize('url, path, name', [
    ('s3://b/f', 'b/f/a%20b', 'a%20b'), ('http://h/f', 'http://h/f/a%20b', 'a b'),
    ('http://h/f', 'http://h/f/a?C=N', ''), ('http://h/f', 'http://h/f/a#x', ''),
    ('http://h/f', 'http://h/f/%2e%2e', ''), ('http://h/f', 'http://h/f/a%2Fb', ''),
    ('http://h/f', 'http://h/other', ''), ('http://h/f', 'http://h/f/sub/', 'sub'),
    ('s3://b/f', 'b/f/..', ''), ('s3://b/f', 'b/f/.', ''), ('s3://b/f', 'b/f', '')])
def test_a_name_stays_in_its_folder(url, path, name):
    folder = url if url.startswith('http') else url.removeprefix('s3://')
    assert remote._name_in(url, folder, {'name': path}) == name


def test_the_version_is_all_that_changes_with_the_content():
    info = {'size': 5, 'ETag': 'x', 'mtime': None, 'LastModified': 7, 'other': 1}
    assert remote._file('n', 'p', info) == RemoteFile('p', 'n', 5, 'x 7')
    assert remote._file('n', 'p', {'size': None}) == RemoteFile('p', 'n', None, '')


def test_a_sentence_says_what_a_recording_at_a_url_is(server):
    with pytest.raises(InputError) as caught:
        list(recordings_at(server(a=1, day__b=2)))
    assert str(caught.value) == (
        'memory://top has no recording: at a URL it is a .mcap, .db3, .bag file, or a folder '
        'whose server lists its files')
    fsspec.filesystem('memory').mkdir('/top/empty')
    with pytest.raises(InputError, match='^memory://top/empty has no files$'):
        files_of('memory://top/empty')


def test_names_of_a_web_server_keep_their_escapes_in_urls(web):
    """Those of other servers have none."""
    folder = web.folder / 'mon day' / 'a#b'
    folder.mkdir(parents=True)
    for name in ('rgb.txt', 'depth.txt'):
        (folder / name).touch()
    assert list(recordings_at(f'{web.url}/')) == [f'{web.url}/mon%20day/a%23b']
    assert sorted(file.name for file in files_of(f'{web.url}/mon%20day/a%23b')) == [
        'a#b/depth.txt', 'a#b/rgb.txt']


def test_slashes_at_the_end_of_names_are_no_part_of_them(monkeypatch):
    """Some servers end the names of folders with one."""
    lists = {'/top': [{'name': '/top/day/', 'type': 'directory', 'size': 0}],
             '/top/day': [{'name': '/top/day/a', 'type': 'file', 'size': 3}]}

    def ls(path, detail):
        assert detail is True
        return lists[path]
    monkeypatch.setattr(remote, 'open_url', lambda url: (SimpleNamespace(ls=ls), '/top'))
    (found,) = files_of('some://top')
    assert (found.path, found.name, found.size) == ('/top/day/a', 'top/day/a', 3)
    assert remote._entries_of('some://top', 9) == [Entry('day', True)]
