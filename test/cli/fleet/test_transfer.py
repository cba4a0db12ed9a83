# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Copies of files from a file system in memory."""

import pytest

fsspec = pytest.importorskip('fsspec', reason="no URLs: pip install '.[fleet]'")
from aick_ros.cli.fleet import attempts  # noqa: E402
from aick_ros.cli.fleet.remote import RemoteFile  # noqa: E402
from aick_ros.cli.fleet.transfer import copy  # noqa: E402
from aick_ros.errors import InputError, TransferError  # noqa: E402

URL = 'memory://made'
CONTENT = {'a': b'one', 'deep/b': bytes(70_000), 'empty': b''}


@pytest.fixture
def server(monkeypatch):
    monkeypatch.setattr(attempts, '_PAUSE', 0.0)
    system = fsspec.filesystem('memory')
    for name, content in CONTENT.items():
        system.pipe(f'/made/{name}', content)
    yield system
    system.rm('/made', recursive=True)


class Counter:
    """Counts the bytes of each attempt."""

    def __init__(self):
        self.attempts = []

    def __call__(self):
        self.attempts.append(0)
        return self._count

    def _count(self, count):
        self.attempts[-1] += count


def listed(size_of=lambda name: len(CONTENT[name])):
    return [RemoteFile(f'/made/{name}', f'made/{name}', size_of(name), '') for name in CONTENT]


@pytest.mark.parametrize('size_of', [lambda name: len(CONTENT[name]), lambda name: None])
def test_files_arrive_whole_below_the_folder_and_their_bytes_are_counted(server, tmp_path,
                                                                         size_of):
    counter = Counter()
    copy(URL, listed(size_of), tmp_path, counter)
    assert {str(path.relative_to(tmp_path / 'made')): path.read_bytes()
            for path in tmp_path.rglob('*') if path.is_file()} == CONTENT
    assert counter.attempts == [sum(map(len, CONTENT.values()))]


@pytest.mark.parametrize('extra', [1, -1])
def test_a_file_of_another_size_is_copied_again_and_then_named(server, tmp_path, extra):
    counter = Counter()
    with pytest.raises(TransferError, match=f'{URL}: made/a ended after 3 of {3 + extra} bytes'):
        copy(URL, listed(lambda name: len(CONTENT[name]) + extra * (name == 'a')), tmp_path,
             counter)
    assert len(counter.attempts) == 3


def test_what_the_counter_raises_ends_the_copy(server, tmp_path):
    def stop(count):
        raise InputError('too large')
    with pytest.raises(InputError, match='too large'):
        copy(URL, listed(), tmp_path, lambda: stop)


def test_a_file_that_is_gone_is_said(server, tmp_path):
    server.rm('/made/a')
    with pytest.raises(InputError, match=f'{URL} does not exist'):
        copy(URL, listed(), tmp_path, Counter())
