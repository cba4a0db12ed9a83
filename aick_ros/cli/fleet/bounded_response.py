# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Answers of web servers, which may never begin, never end, or unpack without an end."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

from aiohttp import ClientResponse

from aick_ros.borders.limits import MAX_LIST_BYTES
from aick_ros.cli.fleet.pace import SILENCE_LIMIT, Pace, SilentServerError
from aick_ros.errors import InputError, TransferError

MOST_INTERIM = 100
"""Interim answers (status 1xx) before an answer; chosen: one each 0.1 s of its time."""

LIST_LIMIT = 60.0
"""Longest time for a list of files [s]; chosen."""

AS_IT_IS = {'Accept-Encoding': 'identity'}
"""Header of requests for content that is not packed."""

_SUCCESS = range(200, 300)  # by definition, of HTTP
_TAG = re.compile(r'<[aA](\s[^<>]*)')
_ADDRESS = re.compile(r"""\s(?:href|HREF)=["']([^"']+)""")
_BARE = re.compile(r'https?://[-a-zA-Z0-9@:%_+.~#?&/=]+')


def links_of(page: str) -> str:
    """Return the links of a page alone: fsspec seeks them in a time that grows as the square."""
    addresses = [found[1] for tag in _TAG.finditer(page) if (found := _ADDRESS.search(tag[1]))]
    return '\n'.join([*_BARE.findall(page), *(f'<a href="{each}">' for each in addresses)])


def unanswered(url: str) -> SilentServerError:
    """Return the error of a server that does not begin to answer."""
    return SilentServerError(f'{url} does not answer within {SILENCE_LIMIT:g} s: try later, or '
                             'copy the recording yourself')


@contextmanager
def _interim_counted(protocol: Any, url: object) -> Iterator[None]:
    """Raise TransferError where a protocol of aiohttp, which has no limit, reads more of them."""
    read, count = protocol.read, 0

    async def counted() -> Any:
        nonlocal count
        if count > MOST_INTERIM:
            raise TransferError(f'{url} has sent {count} interim answers and none that is final')
        count += 1
        return await read()

    protocol.read = counted
    try:
        yield
    finally:
        del protocol.read


class BoundedResponse(ClientResponse):  # type: ignore[misc, unused-ignore]  # may be missing
    """An answer of a web server; files, which are read piece by piece, have no limit here."""

    _body: bytes | None

    async def start(self, connection: Any) -> Self:
        """
        Wait for the first lines, which may come byte by byte.

        :raises SilentServerError: where they do not come in time.
        :raises TransferError: after too many interim answers.
        :raises InputError: where the content is packed, which :data:`AS_IT_IS` asks not to do.
        """
        try:
            async with asyncio.timeout(SILENCE_LIMIT):
                with _interim_counted(connection.protocol, self.url):
                    await super().start(connection)
        except TimeoutError:
            raise unanswered(str(self.url)) from None
        self._reject_packed()
        return self

    async def read(self) -> bytes:
        """
        Return the whole content.

        :raises InputError: where it is larger than any list of files.
        :raises SilentServerError: where it does not come in time.
        """
        if self._body is None:
            try:
                async with asyncio.timeout(LIST_LIMIT):
                    self._body = await self._content()
            except TimeoutError:
                self.close()
                raise SilentServerError(f'{self.url} does not send its list of files in time: '
                                        'name a recording') from None
        body: bytes = await super().read()
        return body

    async def text(self, *arguments: Any, **options: Any) -> str:
        """Return the links of a page."""
        return links_of(await super().text(*arguments, **options))

    def _reject_packed(self) -> None:
        """Raise InputError where the content is packed: a few bytes may unpack to any number."""
        packed_by = self.headers.get('Content-Encoding', '').strip().lower()
        if packed_by not in ('', 'identity') and self.status in _SUCCESS:
            raise InputError(f'{self.url} is sent packed ({packed_by}), which was not asked for: '
                             'have the server send it as it is, or copy the recording yourself')

    async def _content(self) -> bytes:
        content, pace = bytearray(), Pace(str(self.url))
        async for piece in self.content.iter_any():
            content += piece
            pace.add(len(piece))
            if len(content) > MAX_LIST_BYTES:
                self.close()
                raise InputError(f'{self.url} sends more than {MAX_LIST_BYTES} bytes as its '
                                 'list of files: name a recording')
        return bytes(content)
