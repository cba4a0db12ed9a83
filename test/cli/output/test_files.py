# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Files appear whole; links and pipes stay what they are."""

import os
import threading
from pathlib import Path

import pytest

from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.target import check_target
from aick_ros.errors import InputError


def test_a_link_is_followed(tmp_path):
    target, link = tmp_path / 'target.json', tmp_path / 'link.json'
    target.write_text('old')
    link.symlink_to(target)
    write_json(link, {'a': 1})
    assert link.is_symlink()
    assert '"a": 1' in target.read_text()


def test_a_pipe_is_written_to(tmp_path):
    pipe, read = tmp_path / 'pipe', []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    with open(pipe, 'w'):  # waits for the reader
        write_whole(pipe, 'content')
    reader.join(60)
    assert read == ['content']
    assert pipe.is_fifo()


def test_of_names_bytes_that_are_not_utf_8_are_escaped(tmp_path):
    write_whole(tmp_path / 'file', 'größe a\udcffb')
    assert (tmp_path / 'file').read_text(encoding='utf-8') == r'größe a\udcffb'


def test_standard_output_may_be_named_by_its_device():
    reader, writer = os.pipe()
    write_whole(Path(f'/dev/fd/{writer}'), 'content')
    os.close(writer)
    with open(reader) as stream:
        assert stream.read() == 'content'


def test_what_cannot_be_written_is_named_and_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match='cannot write .*nowhere'):
        write_whole(tmp_path / 'nowhere' / 'file', 'content')
    with pytest.raises(InputError, match='cannot write'):
        write_whole(tmp_path, 'content')
    assert list(tmp_path.iterdir()) == []


def test_a_link_to_itself_is_no_file(tmp_path):
    link = tmp_path / 'link'
    link.symlink_to(link)
    for write in (lambda: write_whole(link, 'content'), lambda: check_target(str(link))):
        with pytest.raises(InputError, match='cannot write .*link'):
            write()


def test_a_name_may_be_as_long_as_the_system_allows(tmp_path):
    name = (os.pathconf(tmp_path, 'PC_NAME_MAX') - 5) * 'n' + '.json'
    check_target(str(tmp_path / name))
    write_whole(tmp_path / name, 'content')
    assert (tmp_path / name).read_text() == 'content'
    with pytest.raises(InputError, match='File name too long'):
        write_whole(tmp_path / f'n{name}', 'content')
    assert os.listdir(tmp_path) == [name]


def test_json_ends_with_a_line_in_a_file_and_on_standard_output(tmp_path, capsys):
    write_json(str(tmp_path / 'a.json'), {'a': 1})
    write_json('-', {'a': 1})
    assert (tmp_path / 'a.json').read_text() == capsys.readouterr().out == '{"a": 1}\n'
