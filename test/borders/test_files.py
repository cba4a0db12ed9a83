# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files are read whole where they are regular files of limited size."""

import os
import stat
import tracemalloc
from pathlib import Path

import pytest

from aick_ros.borders import files
from aick_ros.borders.files import read_bytes, read_text
from aick_ros.errors import InputError


def test_a_file_up_to_the_limit_is_read(tmp_path):
    (tmp_path / 'file').write_bytes(b'12345678')
    assert read_bytes(tmp_path / 'file', 'the file', 8) == b'12345678'
    with pytest.raises(InputError, match='the file .*: it is larger than 7 bytes'):
        read_bytes(tmp_path / 'file', 'the file', 7)


def test_a_small_file_takes_little_memory_whatever_the_limit_is(tmp_path):
    (tmp_path / 'file').write_bytes(b'12345678')
    tracemalloc.start()
    try:
        assert read_bytes(tmp_path / 'file', 'the file', 2 ** 30) == b'12345678'
        assert tracemalloc.get_traced_memory()[1] < 2 ** 22
    finally:
        tracemalloc.stop()


def test_a_file_that_tells_no_size_is_read():
    assert b'VmPeak' in read_bytes(Path('/proc/self/status'), 'the file', 2 ** 30)


def test_a_file_that_grows_while_it_is_read_is_rejected(tmp_path, monkeypatch):
    path = tmp_path / 'file'
    path.write_bytes(b'12')
    monkeypatch.setattr(files, '_GROWTH', 3)
    stat_of = os.fstat

    def grow(descriptor):
        status = stat_of(descriptor)
        with path.open('ab') as file:
            file.write(growth)
        return status
    monkeypatch.setattr(files.os, 'fstat', grow)
    growth = b'345'
    assert read_bytes(path, 'the file', 100) == b'12345'
    growth = b'6789'
    with pytest.raises(InputError, match='file: it is larger than 8 bytes'):
        read_bytes(path, 'the file', 100)


def test_pipes_are_rejected_without_waiting_for_a_writer(tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(InputError, match='pipe: it is not a regular file'):
        read_bytes(tmp_path / 'pipe', 'the file', 8)


@pytest.mark.parametrize('device', ['/dev/zero', '/dev/null'])
def test_devices_and_links_to_them_are_rejected(tmp_path, device):
    (tmp_path / 'link').symlink_to(device)
    with pytest.raises(InputError, match='link: it is not a regular file'):
        read_bytes(tmp_path / 'link', 'the file', 8)


@pytest.mark.parametrize('name, reason', [
    ('nowhere', 'No such file'), ('.', 'directory'), ('a' * 300, 'name too long'),
    ('a\0b', 'null')])
def test_names_that_cannot_be_opened_are_reported(tmp_path, name, reason):
    with pytest.raises(InputError, match=f'cannot read the file .*{reason}'):
        read_bytes(tmp_path / name, 'the file', 8)


def test_text_is_utf_8(tmp_path):
    (tmp_path / 'file').write_bytes('größe'.encode())
    assert read_text(tmp_path / 'file', 'the file', 8) == 'größe'
    (tmp_path / 'file').write_bytes(b'\xef\xbb\xbf# gr')  # with the mark of Windows' editors
    assert read_text(tmp_path / 'file', 'the file', 8) == '# gr'
    (tmp_path / 'file').write_bytes(b'gr\xf6')
    with pytest.raises(InputError, match='file: byte 2 is not UTF-8 text'):
        read_text(tmp_path / 'file', 'the file', 8)


def test_a_file_that_waits_for_content_is_rejected(tmp_path, monkeypatch):
    path = tmp_path / 'messages'  # like /proc/kmsg, a regular file by its own account
    os.mkfifo(path)
    monkeypatch.setattr(files.stat, 'S_ISREG', lambda mode: True)
    writer = os.open(path, os.O_RDWR)
    try:
        with pytest.raises(InputError, match='cannot read the list .*messages: its content never'):
            read_bytes(path, 'the list', 10)
    finally:
        os.close(writer)


def test_a_large_file_is_rejected_before_it_is_read(tmp_path):
    os.truncate(os.open(tmp_path / 'sparse', os.O_CREAT | os.O_WRONLY), 2 ** 43)
    with pytest.raises(InputError, match='larger than 4398046511104 bytes'):
        read_bytes(tmp_path / 'sparse', 'the list', 2 ** 42)


def test_an_empty_file_is_read_and_a_growing_one_up_to_the_limit(tmp_path, monkeypatch):
    (tmp_path / 'file').write_bytes(b'')
    assert read_bytes(tmp_path / 'file', 'the file', 0) == b''
    (tmp_path / 'file').write_bytes(b'123456789')
    status = os.stat_result([stat.S_IFREG] + [0] * 9)  # as it was before it grew
    monkeypatch.setattr(files.os, 'fstat', lambda number: status)
    assert read_bytes(tmp_path / 'file', 'the file', 9) == b'123456789'
    with pytest.raises(InputError, match='larger than 8 bytes'):
        read_bytes(tmp_path / 'file', 'the file', 8)


def test_a_file_that_is_larger_than_it_says_is_rejected():
    """Those of /proc say 0 bytes."""
    with pytest.raises(InputError, match='the status /proc/self/status: it is larger than 10 by'):
        read_bytes('/proc/self/status', 'the status', 10)
