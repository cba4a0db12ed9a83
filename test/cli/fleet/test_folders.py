# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings in trees that are given as dictionaries."""

import pytest

from aick_ros.cli.fleet.folders import Entry, recordings_below

TUM = {'rgb.txt': 0, 'depth.txt': 0, 'rgb': {'1.png': 0}, 'depth': {}}
BAG = {'metadata.yaml': 0, 'a.mcap': 0, 'b.mcap': 0}


def found(tree):
    """Return the recordings below a folder, an entry of which is a folder where it has some."""
    def entries_of(path):
        inside = tree
        for name in path.split('/')[1:]:
            inside = inside[name]
        return [Entry(name, isinstance(part, dict)) for name, part in inside.items()]
    return list(recordings_below('top', entries_of))


@pytest.mark.parametrize('tree, expected', [
    (TUM, ['top']), (BAG, ['top']), ({}, []), ({'x': {'y': {}}}, []),
    ({'b.mcap': 0, 'a.bag': 0, 'c.db3': 0, 'notes.txt': 0},
     ['top/a.bag', 'top/b.mcap', 'top/c.db3']),
    ({'x': TUM, 'y': {'z': BAG}}, ['top/x', 'top/y/z']),
    ({'a.mcap': 0, 'x': TUM}, ['top/a.mcap', 'top/x']),
    ({**TUM, 'x': TUM}, ['top']), ({'a.mcap': BAG, 'b': TUM}, ['top/a.mcap', 'top/b']),
    ({'a.bag': {}, 'b.bag': 0}, ['top/b.bag'])])
def test_one_does_not_contain_others_and_files_come_first(tree, expected):
    assert found(tree) == expected
