# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names in URLs, and which errors of file systems mean that nothing is there."""

import sys

import pytest

from aick_ros.cli.fleet.pace import SilentServerError
from aick_ros.cli.fleet.urls import errors_of, is_url, is_web, name_of, open_url
from aick_ros.errors import InputError, TransferError

WEB, BUCKET = 'https://host/a', 's3://bucket/a'


@pytest.mark.parametrize('source, is_one', [
    ('http://host', True), ('s3://b', True), ('a+b.c-1://x', True), ('folder/a://b', False),
    ('/a', False), ('C:/a', False), ('1a://x', False), ('synthetic', False)])
def test_a_url_begins_with_its_kind(source, is_one):
    assert is_url(source) is is_one


@pytest.mark.parametrize('url, web', [
    (WEB, True), ('http://host', True), (BUCKET, False), ('file:///http', False)])
def test_web_servers_are_http_and_https(url, web):
    assert is_web(url) is web


@pytest.mark.parametrize('url, name', [
    (f'{WEB}/day%201.bag?key=b/c', 'day 1.bag'), (f'{WEB}/x//', 'x'),
    ('s3://bucket/day%201.bag?x', 'day%201.bag?x'), ('https://host', 'recording'),
    ('https://host/..', 'recording'), ('https://host/.', 'recording'),
    ('https://host/a%00b', 'recording'), ('s3://b', 'b')])
def test_escapes_and_queries_are_those_of_web_servers_alone(url, name):
    assert name_of(url) == name


class Answer(Exception):
    """An error of a web server with its status."""

    def __init__(self, status):
        super().__init__(f'status {status}.\nmore')
        self.status = status


def raised(url, error, cause=None):
    with pytest.raises((InputError, TransferError)) as caught:
        with errors_of(url):
            raise error from cause
    return type(caught.value), str(caught.value)


@pytest.mark.parametrize('url, cause', [
    (WEB, None), (WEB, Answer(404)), (WEB, FileNotFoundError()), (BUCKET, None),
    (BUCKET, Answer(503))])
def test_what_is_not_there_is_the_users_to_correct(url, cause):
    assert raised(url, FileNotFoundError(url), cause) == (InputError, f'{url} does not exist')


@pytest.mark.parametrize('name', ['NonHttpUrlRedirectClientError',
                                  'InvalidUrlRedirectClientError'])
@pytest.mark.parametrize('is_cause', [False, True])
def test_a_server_that_leads_elsewhere_is_said_to(name, is_cause):
    """The text of these errors is the URL alone."""
    aiohttp = pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    error = getattr(aiohttp, name)('file:///etc/x')
    sentence = (f'cannot read {WEB}: it redirects to file:///etc/x, which is no URL of a web '
                'server')
    assert raised(WEB, *[FileNotFoundError(WEB), error] if is_cause else [error, None]) == (
        TransferError, sentence)


@pytest.mark.parametrize('status', [403, 500, 503])
def test_an_error_of_a_web_server_is_one_of_the_transfer(status):
    """Its library raises FileNotFoundError for all of them."""
    assert raised(WEB, FileNotFoundError(WEB), Answer(status)) == (
        TransferError, f'cannot read {WEB}: status {status}')


def test_any_other_error_is_one_line():
    assert raised(WEB, RuntimeError('  first.\nsecond')) == (
        TransferError, f'cannot read {WEB}: first')
    assert raised(WEB, RuntimeError('\nsecond\nthird')) == (
        TransferError, f'cannot read {WEB}: second')
    assert raised(WEB, RuntimeError('Invalid:\n\tthe name.\nthird')) == (
        TransferError, f'cannot read {WEB}: Invalid: the name')


@pytest.mark.parametrize('is_cause', [False, True])
@pytest.mark.parametrize('text, reason', [('', 'nothing arrives any more'), ('a wire', 'a wire')])
def test_time_that_ran_out_is_that_of_a_silent_server(is_cause, text, reason):
    error = TimeoutError(text) if text else TimeoutError()
    assert raised(WEB, *[FileNotFoundError(WEB), error] if is_cause else [error]) == (
        SilentServerError,
        f'cannot read {WEB}: {reason}; try later, or copy the recording yourself')


def test_input_errors_come_through():
    error = InputError('own')
    with pytest.raises(InputError) as caught:
        with errors_of(WEB):
            raise error
    assert caught.value is error


def test_a_path_has_no_slash_at_its_end(tmp_path):
    pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
    system, path = open_url(f'file://{tmp_path}/')
    assert path == str(tmp_path) and system.unstrip_protocol(path) == f'file://{tmp_path}'


@pytest.mark.parametrize('url, reason', [
    ('nokind://x', ''), ('dir://x', ''), ('reference://x', ''), ('s3://', 'it names no server'),
    ('file:///', 'it names no server'), ('http:///x.mcap', 'it names no server'),
    ('http://x:0/', 'its port is 0'), ('http://x:65536/', 'Port'), ('http://[::1/', ''),
    ('http://x:y/', 'Port'), ('http://a..b/', ''), ('zip://a::memory://b', 'archives are not')])
def test_what_cannot_be_asked_is_one_sentence(url, reason):
    pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    with pytest.raises(InputError) as caught:
        open_url(url)
    assert str(caught.value).startswith(f'{url} cannot be read: {reason}')
    assert not isinstance(caught.value, TransferError)


@pytest.mark.parametrize('url', ['http://[::1]:1/a::b.mcap', 'https://x/a'])
def test_urls_of_web_servers_are_read_as_they_are(url):
    """With two colons fsspec would read the one through the other."""
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    system, path = open_url(url)
    assert path == url and system.unstrip_protocol(path) == url


@pytest.mark.parametrize('error, sentence', [
    (ImportError('Install s3fs to access S3'), 'needs another package: Install s3fs to access S3'),
    (ValueError('no such kind'), 'cannot be read: no such kind'),
    (TypeError('host'), 'cannot be read: its kind needs more than a URL (host)'),
    (AttributeError('host'), 'cannot be read: its kind needs more than a URL (host)')])
def test_what_a_kind_of_url_lacks_is_said(monkeypatch, error, sentence):
    core = pytest.importorskip('fsspec.core', reason="no URLs: pip install '.[fleet]'")

    def fail(url, **_):
        raise error
    monkeypatch.setattr(core, 'url_to_fs', fail)
    with pytest.raises(InputError) as caught:
        open_url(BUCKET)
    assert str(caught.value) == f'{BUCKET} {sentence}'


def test_without_fsspec_its_installation_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, 'fsspec.core', None)
    with pytest.raises(InputError, match=r"no URLs without fsspec.*: pip install '.\[fleet\]'"):
        open_url(BUCKET)


def test_lists_of_files_are_asked_for_again():
    fsspec = pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
    asked = []

    class Listed(fsspec.AbstractFileSystem):
        protocol = 'listed'

        def invalidate_cache(self, path=None):
            asked.append(path)
    fsspec.register_implementation('listed', Listed, clobber=True)
    assert open_url('listed://a/b//')[1] == 'a/b'
    assert asked == [None]
