# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Answers of web servers that are read as a whole: lists of files, which may never end."""

from __future__ import annotations

from aiohttp import ClientResponse

from aick_ros.borders.limits import MAX_LIST_BYTES
from aick_ros.errors import InputError


class BoundedResponse(ClientResponse):  # type: ignore[misc, unused-ignore]  # may be missing
    """An answer of a web server; files, which are read piece by piece, have no limit here."""

    _body: bytes | None

    async def read(self) -> bytes:
        """
        Return the whole content.

        :raises InputError: where it is larger than any list of files.
        """
        if self._body is None:
            content = bytearray()
            async for piece in self.content.iter_any():
                content += piece
                if len(content) > MAX_LIST_BYTES:
                    self.close()
                    raise InputError(f'{self.url} sends more than {MAX_LIST_BYTES} bytes as its '
                                     'list of files: name a recording')
            self._body = bytes(content)
        body: bytes = await super().read()
        return body
