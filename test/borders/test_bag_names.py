# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SQLite opens the file whose name it is given, whatever characters are in it."""

import os
import sqlite3
from contextlib import closing

import pytest

from aick_ros.borders.bag_names import escaped

NAMES = ['plain', 'a#b', 'a?b', 'a%41b', 'a%00', 'a?immutable=1.db3', 'é ü', 'a\udcffb']


@pytest.mark.parametrize('name', NAMES)
def test_the_file_of_that_name_is_opened(tmp_path, name):
    with closing(sqlite3.connect(escaped(f'file:{tmp_path}/{name}'), uri=True)) as database:
        database.execute('CREATE TABLE messages (id)')
    assert os.listdir(tmp_path) == [name]
    with closing(sqlite3.connect(escaped(f'file:{tmp_path}/{name}?immutable=1'),
                                 uri=True)) as database:
        assert database.execute('SELECT name FROM sqlite_master').fetchall() == [('messages',)]
