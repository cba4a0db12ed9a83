# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How long a web server is waited for."""

import pytest

pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
from aick_ros.cli.fleet.bounded_response import BoundedResponse  # noqa: E402
from aick_ros.cli.fleet.pace import SILENCE_LIMIT  # noqa: E402
from aick_ros.cli.fleet.web_files import WebFiles  # noqa: E402


def test_a_web_server_has_time_for_a_file_but_not_to_be_silent():
    given = WebFiles().client_kwargs
    assert given['response_class'] is BoundedResponse
    assert (given['timeout'].total, given['timeout'].sock_connect, given['timeout'].sock_read) == (
        None, SILENCE_LIMIT, SILENCE_LIMIT)


def test_facts_of_a_file_are_those_of_its_server(web):
    (web.folder / 'a.bag').write_bytes(bytes(70))
    assert (WebFiles().info(f'{web.url}/a.bag')['size'], web.requests) == (70, [])


def test_a_server_that_does_not_know_one_way_is_asked_in_the_other(web):
    web.knows_head = False
    (web.folder / 'a.bag').write_bytes(bytes(70))
    assert WebFiles().info(f'{web.url}/a.bag')['size'] == 70
    assert (web.heads, web.requests) == (['/a.bag'], ['/a.bag'])
