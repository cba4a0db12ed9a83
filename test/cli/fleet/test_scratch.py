# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of recordings from servers: whole or not at all, within a limit, removed in order."""

import os

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from aick_ros.cli.fleet import attempts, pace, transfer
from aick_ros.cli.fleet.content import state_of
from aick_ros.cli.fleet.pace import SilentServerError
from aick_ros.cli.fleet.recordings import find_recordings
from aick_ros.cli.fleet.scratch import Scratch
from aick_ros.cli.fleet.urls import name_of
from aick_ros.cli.input.options import bytes_from
from aick_ros.errors import InputError, TransferError


@pytest.fixture(autouse=True)
def without_pauses(monkeypatch):
    monkeypatch.setattr(attempts, '_PAUSE', 0.0)


@pytest.fixture
def scratch(tmp_path):
    return Scratch(tmp_path / 'scratch', 1000)


def write(folder, files):
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def content(folder):
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob('*') if path.is_file()}


def size_of(folder):
    return sum(path.stat().st_size for path in folder.rglob('*') if path.is_file())


TUM = {'rgb.txt': b'1 rgb/1 a.png\n', 'depth.txt': b'', 'rgb/1 a.png': bytes(range(256)),
       'rgb/%41.png': b'escape', 'empty/deep/x': b''}


@pytest.mark.parametrize('scheme', ['http', 'file'])
def test_a_folder_arrives_as_it_is(web, scratch, scheme):
    write(web.folder / 'day 1' / 'tum', TUM)
    root = web.url if scheme == 'http' else f'file://{web.folder}'
    [found] = find_recordings([root], None)
    assert found == f'{root}/{"day%201" if scheme == "http" else "day 1"}/tum'
    with scratch.copy_of(found) as copy:
        assert copy.path.name == 'tum'
        assert content(copy.path) == TUM
        assert copy.bytes_copied == sum(map(len, TUM.values()))
    scratch.remove()
    assert not copy.path.exists()


@pytest.mark.parametrize(('source', 'expected'), [
    ('', ['a/1.mcap', 'a/2.bag', 'b/tum']), ('/a/2.bag?key=a/b', ['a/2.bag?key=a/b']),
    ('/a/*.mcap', ['a/1.mcap']), ('/b/tum/', ['b/tum'])])
def test_recordings_of_a_server_are_found(web, tmp_path, source, expected):
    write(web.folder, {'a/1.mcap': b'', 'a/2.bag': b'', 'a/x.txt': b'', 'b/tum/rgb.txt': b''})
    listed = tmp_path / 'list'
    listed.write_text(f'{web.url}{source}  # of Monday\n')
    assert find_recordings([], listed) == [f'{web.url}/{name}' for name in expected]


def test_what_was_used_least_recently_makes_room(web, scratch):
    for name in 'abc':
        write(web.folder, {f'{name}.bag': name.encode() * 400})

    def copied(name):
        with scratch.copy_of(f'{web.url}/{name}.bag') as copy:
            assert copy.path.read_bytes() == name.encode() * 400
            assert size_of(copy.path.parents[1]) <= 1000
            return copy.bytes_copied
    assert [copied(name) for name in 'abacab'] == [400, 400, 0, 400, 0, 400]
    assert web.requests.count('/a.bag') == 1


def test_a_copy_of_other_content_is_not_used(web, scratch):
    states = []
    for text in (b'first', b'second'):
        write(web.folder, {'a.bag': text})
        os.utime(web.folder / 'a.bag', (1e9 + len(text), 1e9 + len(text)))
        states.append(state_of(f'{web.url}/a.bag'))
        assert state_of(f'{web.url}/a.bag') == states[-1]
        with scratch.copy_of(f'{web.url}/a.bag') as copy:
            assert copy.path.read_bytes() == text
    assert states[0] != states[1]


@pytest.mark.parametrize(('name', 'kind', 'reason', 'requests'), [
    ('none.bag', InputError, 'none.bag does not exist', 1),
    ('none', InputError, 'none does not exist', 1),
    ('large.bag', InputError, 'has more than the 0.001 MB that --scratch-limit allows', 0),
    ('endless.bag', InputError, 'has more than the 0.001 MB that --scratch-limit allows', 1),
    ('broken.bag', TransferError, 'broken.bag: 503', 3),
    ('short.bag', TransferError, 'short.bag ended after 4 of 10 bytes', 3),
    ('cut.bag', TransferError, 'cut.bag: ', 3)])
def test_a_recording_that_does_not_arrive_leaves_nothing(web, scratch, name, kind, reason,
                                                         requests):
    write(web.folder, {'large.bag': bytes(1001), 'good.bag': bytes(900)})
    with scratch.copy_of(f'{web.url}/good.bag') as copy:
        pass
    folder = copy.path.parents[1]
    with pytest.raises(InputError, match=reason) as caught:
        with scratch.copy_of(f'{web.url}/{name}'):
            pytest.fail('it was given')
    assert type(caught.value) is kind
    assert web.requests.count(f'/{name}') == requests
    assert size_of(folder) in (0, 900)


def test_what_is_left_of_a_transfer_is_made_good(web, scratch):
    """The server is gone at first."""
    write(web.folder, {'a.bag': b'content'})
    real, asked = transfer.open_url, []

    def sometimes(url):
        asked.append(url)
        if len(asked) == 1:
            raise ConnectionError('not now')
        return real(url)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(transfer, 'open_url', sometimes)
        with scratch.copy_of(f'{web.url}/a.bag') as copy:
            assert (copy.path.read_bytes(), copy.bytes_copied) == (b'content', 7)
    assert len(asked) == 2


def test_nothing_is_copied_after_the_end(scratch, tmp_path, monkeypatch):
    write(tmp_path, {'a.bag': b'content'})
    real, asked = transfer.open_url, []

    def removed(url):
        asked.append(url)
        if len(asked) == 1:
            scratch.remove()
            raise ConnectionError('not now')
        return real(url)
    monkeypatch.setattr(transfer, 'open_url', removed)
    for _ in range(2):
        with pytest.raises(InputError, match='a.bag: the fleet has ended'):
            with scratch.copy_of(f'file://{tmp_path}/a.bag'):
                pytest.fail('it was given')
    assert len(asked) == 2
    assert not (tmp_path / 'scratch').exists()


@pytest.mark.parametrize('ask', [state_of, lambda url: find_recordings([url], None)])
def test_a_list_of_files_is_asked_for_again(web, monkeypatch, ask):
    """The server is overloaded at first."""
    write(web.folder, {'tum/rgb.txt': b''})
    expected = ask(f'{web.url}/tum')
    web.overloads = 2
    assert ask(f'{web.url}/tum') == expected
    web.overloads = 3
    with pytest.raises(TransferError, match='503'):
        ask(f'{web.url}/tum')


@pytest.mark.parametrize(('link', 'is_taken'), [
    ('../../../x.bag', False), ('a%2F..%2F..%2Fx', False), ('..%2Fx', False), ('%2e%2e', False),
    ('?C=N;O=D', False), ('http://127.0.0.1:9/a.bag', False), ('x%00', False), ('good', True)])
def test_names_that_leave_the_folder_are_ignored(web, scratch, link, is_taken):
    write(web.folder, {'tum/index.html': f'<a href="{link}">l</a><a href="rgb.txt">l</a>'.encode(),
                       'tum/rgb.txt': b'', 'tum/good': b''})
    with scratch.copy_of(f'{web.url}/tum') as copy:
        assert sorted(content(copy.path)) == (['good'] if is_taken else []) + ['rgb.txt']


@pytest.mark.parametrize(('source', 'sentence'), [
    ('nothing://x/y.bag', 'nothing://x/y.bag cannot be read: Protocol not known'),
    ('gs://bucket/y.bag', 'gs://bucket/y.bag needs another package: .*gcsfs'),
    ('http://127.0.0.1:9/folder', 'cannot read http://127.0.0.1:9/folder: Cannot connect'),
    ('file:///nowhere/folder', 'file:///nowhere/folder does not exist')])
def test_an_impossible_url_is_rejected(source, sentence):
    pytest.importorskip('aiohttp')
    with pytest.raises(InputError, match=sentence):
        find_recordings([source], None)


def test_folders_without_an_end_are_rejected(web, scratch):
    with pytest.raises(InputError, match='folders in each other deeper than 16: name a recording'):
        find_recordings([f'{web.url}/nested'], None)
    with pytest.raises(InputError, match='folders in each other deeper than 16: name a recording'):
        with scratch.copy_of(f'{web.url}/nested'):
            pass


def test_a_pattern_ends_at_the_same_depth(web):
    with pytest.raises(InputError, match='has no recording'):
        find_recordings([f'{web.url}/nested/**/x.mcap'], None)
    assert 16 <= max(path.count('nested') for path in web.requests) <= 18


@pytest.mark.parametrize(('url', 'name'), [
    ('https://h/a/..', 'recording'), ('https://h/a/%2e%2E/', 'recording'),
    ('s3://h/a/.', 'recording'), ('https://h?x', 'recording'), ('https://h/a%00', 'recording'),
    ('https://h/a%20b?x', 'a b'), ('s3://h/a/..b', '..b')])
def test_the_name_of_a_url_is_one_of_a_file(url, name):
    assert name_of(url) == name


class StrictFileSystem(MemoryFileSystem):
    """Takes no options, as that of sftp, and keeps lists of files."""

    protocol, store, lists = 'strict', {}, {}

    def __init__(self):
        super().__init__()

    @classmethod
    def _strip_protocol(cls, path):
        return super()._strip_protocol(path.removeprefix('strict://'))

    def ls(self, path, detail=True, **_):
        if path not in self.lists:
            self.lists[path] = super().ls(path, detail)
        return self.lists[path]

    def invalidate_cache(self, path=None):
        self.lists.clear()


def test_file_systems_without_options_are_read_and_their_lists_are_new():
    fsspec.register_implementation('strict', StrictFileSystem, clobber=True)
    for name in '12':
        StrictFileSystem().pipe(f'/a/{name}.bag', b'')
        assert len(find_recordings(['strict:///a'], None)) == int(name)


def test_a_server_without_recordings_is_named(web):
    write(web.folder, {'notes.txt': b''})
    with pytest.raises(InputError, match='has no recording: at a URL it is a .mcap'):
        find_recordings([web.url], None)


def test_an_endless_list_of_files_is_rejected(web, monkeypatch):
    from aick_ros.cli.fleet import bounded_response
    monkeypatch.setattr(bounded_response, 'MAX_LIST_BYTES', 10_000)
    with pytest.raises(InputError, match='endless sends more than 10000 bytes as its list'):
        find_recordings([f'{web.url}/endless/'], None)


@pytest.mark.parametrize('page', [
    '', 'text', '<a href="a.bag">a</a> <A HREF=\'b/\'>b</A>', 'see http://x/c.bag or https://y/d',
    '<a class="x" href="e" title="f">', '<a\n  class=x\n  href="g">', '<a hrefs="h"><b href="i">',
    '<a href=j>', '<a data-href="k" href="l&amp;m">', '<a href="n"><link href="p">'])
def test_links_are_those_that_fsspec_finds_in_the_page(page):
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    from fsspec.implementations.http import ex, ex2

    from aick_ros.cli.fleet.bounded_response import links_of

    def found(text):
        return {*ex2.findall(text), *(groups[2] for groups in ex.findall(text))}
    assert found(links_of(page)) == found(page)


@pytest.mark.parametrize('page', ['<a ' * 100_000, '<a href="' * 100_000, '<a' + ' ' * 100_000])
def test_tags_without_an_end_are_no_links(page):
    """For each of them fsspec would read all that follows."""
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    from aick_ros.cli.fleet.bounded_response import links_of
    assert links_of(page).count('<a ') <= 1


@pytest.mark.parametrize('limit, name, reason', [
    ('SILENCE_LIMIT', 'silent', 'does not answer within 0.05 s'),
    ('LIST_LIMIT', 'slow', 'does not send its list of files in time')])
def test_a_list_of_files_that_never_comes_is_not_waited_for(web, monkeypatch, limit, name, reason):
    from aick_ros.cli.fleet import bounded_response
    monkeypatch.setattr(bounded_response, limit, 0.05)
    with pytest.raises(SilentServerError, match=f'/{name} {reason}'):
        find_recordings([f'{web.url}/{name}/'], None)
    assert len(web.requests) == 1


def test_a_recording_that_hardly_comes_is_not_waited_for(web, scratch, monkeypatch):
    monkeypatch.setattr(pace, 'SILENCE_LIMIT', 0.1)
    with pytest.raises(SilentServerError, match=r'slow.bag hardly sends: \d+ bytes arrived'):
        with scratch.copy_of(f'{web.url}/slow.bag'):
            pytest.fail('it was given')
    assert web.requests == ['/slow.bag']


def test_a_server_that_is_silent_is_waited_for_once(web, scratch, monkeypatch):
    """It is asked for the facts of a file in two ways."""
    from aick_ros.cli.fleet import web_files
    monkeypatch.setattr(web_files, 'SILENCE_LIMIT', 0.3)
    with pytest.raises(SilentServerError, match='silent.bag does not answer within'):
        with scratch.copy_of(f'{web.url}/silent.bag'):
            pytest.fail('it was given')
    assert web.heads == ['/silent.bag'] and web.requests == []


@pytest.mark.parametrize('kept, requests', [(99, 3), (101, 1)])
def test_a_server_that_falls_silent_later_is_asked_again(web, scratch, monkeypatch, kept,
                                                         requests):
    """It sends 100 bytes before."""
    monkeypatch.setattr(pace, 'SLOWEST', kept)
    monkeypatch.setattr(pace, 'SILENCE_LIMIT', 1.0)
    from aick_ros.cli.fleet import web_files
    web_files.WebFiles.clear_instance_cache()
    monkeypatch.setattr(web_files, 'SILENCE_LIMIT', 0.3)
    with pytest.raises(TransferError, match='stops.bag: .*; try later, or copy') as caught:
        with scratch.copy_of(f'{web.url}/stops.bag'):
            pytest.fail('it was given')
    web_files.WebFiles.clear_instance_cache()
    assert isinstance(caught.value, SilentServerError) is (requests == 1)
    assert web.requests == requests * ['/stops.bag']


@pytest.mark.parametrize('name', ['packed.bag', 'packed', 'of/packed.bag'])
def test_what_is_sent_packed_is_rejected(web, scratch, name):
    """Some megabytes may unpack to terabytes."""
    with pytest.raises(InputError) as caught:
        with scratch.copy_of(f'{web.url}/{name}'):
            pytest.fail('it was given')
    assert type(caught.value) is InputError  # asked for again it would be the same
    assert str(caught.value) == (
        f'{web.url}/{name} is sent packed (gzip), which was not asked for: have the server send '
        'it as it is, or copy the recording yourself')


def test_a_list_of_files_that_is_sent_packed_is_rejected(web):
    with pytest.raises(InputError, match=r'/packed is sent packed \(gzip\), which was not'):
        find_recordings([f'{web.url}/packed/'], None)


def test_content_is_asked_for_as_it_is(web, scratch):
    write(web.folder, {'tum/rgb.txt': b'', 'tum/depth.txt': b''})
    [found] = find_recordings([f'{web.url}/'], None)
    with scratch.copy_of(found):
        assert web.encodings == {'identity'}


def test_bytes_are_read():
    assert bytes_from('--scratch-limit', '2.5GB') == 2_500_000_000
    for text in ('much', '-1GB', '1,2', 'inf', 'nan'):
        with pytest.raises(InputError, match=f'--scratch-limit {text} is no number of bytes'):
            bytes_from('--scratch-limit', text)
