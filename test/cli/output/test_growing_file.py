# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Lines are in a file whole, or not at all."""

import resource

import pytest

from aick_ros.cli.output.growing_file import GrowingFile
from aick_ros.errors import InputError


def test_a_line_that_does_not_fit_is_not_begun(tmp_path):
    path = tmp_path / 'lines'
    file = GrowingFile(path)
    file.append('one\ntwo\n')
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, hard))  # Python ignores SIGXFSZ
    try:
        with pytest.raises(InputError, match=f'^cannot write {path}: File too large; '):
            file.append('three\n')
        assert path.read_text() == 'one\ntwo\n'
        file.append('3\n')
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    file.append('fo\udce4r\n')
    assert file.size == path.stat().st_size
    file.close()
    assert path.read_text() == 'one\ntwo\n3\nfo\\udce4r\n'


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match='cannot write .*none/lines: No such file'):
        GrowingFile(tmp_path / 'none' / 'lines')
