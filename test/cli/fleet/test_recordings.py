# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings found by folder, pattern and list."""

import os

import pytest

from aick_ros.cli.fleet.recordings import find_recordings
from aick_ros.errors import InputError


@pytest.fixture(autouse=True)
def tree(tmp_path, monkeypatch):
    """Make a tree of empty files, named as recordings are, and work in it."""
    for name in ('a/tum/rgb.txt', 'a/tum/inner/rgb.txt', 'a/bag/metadata.yaml', 'a/bag/x.mcap',
                 'a/loose/1.mcap', 'a/loose/2.bag', 'a/loose/notes.txt', 'a/loose/tum/depth.txt',
                 'b/images/frame-000000.color.png', 'empty/notes.txt'):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    monkeypatch.chdir(tmp_path)


def relative(found):
    assert all(os.path.isabs(source) or ':' in source for source in found)
    return [os.path.relpath(source) if ':' not in source else source for source in found]


@pytest.mark.parametrize(('sources', 'expected'), [
    (['a'], ['a/bag', 'a/loose/1.mcap', 'a/loose/2.bag', 'a/loose/tum', 'a/tum']),
    (['a/tum'], ['a/tum']),
    (['a/loose/*.mcap', 'b'], ['a/loose/1.mcap', 'b/images']),
    (['synthetic:1', 'b', 'b/images', 'synthetic:1'], ['synthetic:1', 'b/images'])])
def test_recordings_are_found_once_in_order(sources, expected):
    assert relative(find_recordings(sources, None)) == expected


def test_a_list_has_comments(tmp_path):
    (tmp_path / 'list').write_text('# all of Monday\n\na/tum   # the first\nb\n')
    assert relative(find_recordings(['a/bag'], tmp_path / 'list')) == [
        'a/bag', 'a/tum', 'b/images']


@pytest.mark.parametrize('source', ['empty', 'nowhere', 'a/*.mcap'])
def test_what_is_no_recording_is_rejected(source):
    with pytest.raises(InputError, match='no recording|does not exist'):
        find_recordings([source], None)
