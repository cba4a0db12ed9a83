# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Lists of files that a web server sends, up to the limit and above it."""

import asyncio

import pytest

aiohttp = pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
from aick_ros.cli.fleet import bounded_response, pace  # noqa: E402
from aick_ros.cli.fleet.bounded_response import BoundedResponse  # noqa: E402
from aick_ros.cli.fleet.pace import SilentServerError  # noqa: E402
from aick_ros.errors import InputError, TransferError  # noqa: E402

CONTENT = bytes(range(256)) * 20


def text_at(url, times=1):
    """Return what each of some readings of one answer gives."""
    async def ask():
        async with aiohttp.ClientSession(response_class=BoundedResponse) as session:
            async with session.get(url) as response:
                return [await response.read() for _ in range(times)]
    return asyncio.run(ask())


@pytest.mark.parametrize('limit, is_too_large', [
    (len(CONTENT), False), (len(CONTENT) - 1, True)])
def test_a_list_has_at_most_the_limit(web, monkeypatch, limit, is_too_large):
    (web.folder / 'list').write_bytes(CONTENT)
    monkeypatch.setattr(bounded_response, 'MAX_LIST_BYTES', limit)
    if is_too_large:
        with pytest.raises(InputError, match=f'{web.url}/list sends more than {limit} bytes as'):
            text_at(f'{web.url}/list')
    else:
        assert text_at(f'{web.url}/list', times=2) == [CONTENT, CONTENT]


def test_a_list_that_never_ends_is_rejected(web, monkeypatch):
    monkeypatch.setattr(bounded_response, 'MAX_LIST_BYTES', 2 ** 20)
    with pytest.raises(InputError, match='/endless sends more than 1048576 bytes'):
        text_at(f'{web.url}/endless')


@pytest.mark.parametrize('page, links', [
    ('<a href="x/1.bag">1</a><A class="y" HREF=\'2.bag\'>',
     '<a href="x/1.bag">\n<a href="2.bag">'),
    ('see https://h/a.mcap, or <b>http://h:8/b</b>', 'https://h/a.mcap\nhttp://h:8/b'),
    ('<abbr href="no"><a name="no"><a>', ''), ('', ''),
    ('<a\nhref="b"> <a data-href="no">', '<a href="b">')])
def test_of_a_page_its_links_are_left(page, links):
    assert bounded_response.links_of(page).replace(',', '') == links


@pytest.mark.parametrize('limit, path, sentence', [
    ('SILENCE_LIMIT', 'silent',
     'does not answer within 0.05 s: try later, or copy the recording yourself'),
    ('LIST_LIMIT', 'slow', 'does not send its list of files in time: name a recording')])
def test_a_server_that_is_too_slow_is_named(web, monkeypatch, limit, path, sentence):
    monkeypatch.setattr(bounded_response, limit, 0.05)
    with pytest.raises(SilentServerError) as caught:
        text_at(f'{web.url}/{path}')
    assert str(caught.value) == f'{web.url}/{path} {sentence}'


def test_a_list_that_hardly_comes_is_rejected(web, monkeypatch):
    monkeypatch.setattr(pace, 'SILENCE_LIMIT', 0.1)
    monkeypatch.setattr(pace, 'SLOWEST', 10_000)
    with pytest.raises(SilentServerError, match=r'/slow hardly sends: \d+ bytes arrived in 0 s;'):
        text_at(f'{web.url}/slow')


@pytest.mark.parametrize('count', [0, 1, 100])
def test_some_interim_answers_come_before_an_answer(web, count):
    assert text_at(f'{web.url}/interim-{count}') == [b'']


@pytest.mark.parametrize('count', [101, 5000])
def test_many_interim_answers_are_none(web, count):
    with pytest.raises(TransferError) as caught:
        text_at(f'{web.url}/interim-{count}')
    assert str(caught.value) == (f'{web.url}/interim-{count} has sent 101 interim answers and '
                                 'none that is final')


def test_interim_answers_are_counted_for_each_answer(web):
    async def ask():
        connector = aiohttp.TCPConnector(limit=1)  # the connection is used again
        async with aiohttp.ClientSession(response_class=BoundedResponse,
                                         connector=connector) as session:
            for _ in range(3):
                async with session.get(f'{web.url}/interim-60') as response:
                    assert await response.read() == b''
    asyncio.run(ask())


def test_the_text_of_a_page_is_its_links_alone(web):
    (web.folder / 'page').write_text('<p>words <a href="1.bag">one</a>')

    async def ask():
        async with aiohttp.ClientSession(response_class=BoundedResponse) as session:
            async with session.get(f'{web.url}/page') as response:
                return await response.text()
    assert asyncio.run(ask()) == '<a href="1.bag">'
