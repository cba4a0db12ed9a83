# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files of web servers, which are not waited for without an end."""

from __future__ import annotations

import asyncio
from typing import Any

from aiohttp import ClientTimeout
from fsspec.implementations.http import HTTPFileSystem

from aick_ros.cli.fleet.bounded_response import AS_IT_IS, BoundedResponse, unanswered
from aick_ros.cli.fleet.pace import SILENCE_LIMIT


class WebFiles(HTTPFileSystem):  # type: ignore[misc, unused-ignore]  # may be missing
    """File system of all web servers; without a limit to the time of a whole file."""

    def __init__(self) -> None:
        super().__init__(client_kwargs={
            'response_class': BoundedResponse, 'headers': AS_IT_IS, 'auto_decompress': False,
            'timeout': ClientTimeout(total=None, sock_connect=SILENCE_LIMIT,
                                     sock_read=SILENCE_LIMIT)})

    async def _info(self, url: str, **options: Any) -> dict[str, object]:
        """
        Return the facts of a file, for which the server is asked in two ways.

        :raises SilentServerError: where both take longer than one may.
        """
        try:
            async with asyncio.timeout(SILENCE_LIMIT):
                facts: dict[str, object] = await super()._info(url, **options)
                return facts
        except TimeoutError:
            raise unanswered(url) from None
