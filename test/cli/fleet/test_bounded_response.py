# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Lists of files that a web server sends, up to the limit and above it."""

import asyncio

import pytest

aiohttp = pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
from aick_ros.cli.fleet import bounded_response  # noqa: E402
from aick_ros.cli.fleet.bounded_response import BoundedResponse  # noqa: E402
from aick_ros.errors import InputError  # noqa: E402

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
