# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings found by folder, pattern and list."""

import os

import pytest

from aick_ros.cli.fleet import recordings
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


@pytest.mark.parametrize(('source', 'sentence'), [
    ('empty', 'empty has no recording, nor has a folder in it'),
    ('nowhere', 'nowhere does not exist, nor does a file that it is a pattern of: name a '
                'recording, or a folder with recordings in it')])
def test_a_sentence_says_what_is_missing(source, sentence):
    with pytest.raises(InputError) as caught:
        find_recordings([source], None)
    assert str(caught.value) == sentence


def test_without_a_source_one_is_asked_for(tmp_path):
    (tmp_path / 'list').write_text('# none yet\n')
    for listed in (None, tmp_path / 'list'):
        with pytest.raises(InputError, match='^no recording is given: .* in a file .--list.$'):
            find_recordings([], listed)


def test_a_pattern_may_lead_through_folders_and_names_are_in_order():
    assert relative(find_recordings(['**/*.mcap'], None)) == ['a/bag/x.mcap', 'a/loose/1.mcap']
    assert relative(find_recordings(['a/*/tum', 'a/t*'], None)) == ['a/loose/tum', 'a/tum']


def test_a_number_sign_within_a_word_is_part_of_it(tmp_path, monkeypatch):
    monkeypatch.setattr(recordings, 'recordings_at', lambda url: [url])
    (tmp_path / 'list').write_text('s3://a/b#c # note\n  synthetic:1\t#note\n#s3://d\n')
    assert find_recordings([], tmp_path / 'list') == ['s3://a/b#c', 'synthetic:1']


@pytest.mark.parametrize('source, is_one', [
    ('a/tum', True), ('./synthetic', True), ('synthetics', True), ('synthetic', False),
    ('synthetic:1', False), ('s3://a', False)])
def test_a_path_is_no_url_and_not_rendered(source, is_one):
    assert recordings.is_path(source) is is_one


def test_a_match_of_a_pattern_is_a_folder_whatever_its_name(tmp_path):
    (tmp_path / 'a' / 'tum').rename(tmp_path / 'synthetic')
    assert relative(find_recordings(['synth*'], None)) == ['synthetic']


def test_links_are_followed_where_they_are_named_alone(tmp_path):
    (tmp_path / 'c').mkdir()
    (tmp_path / 'c' / 'link').symlink_to(tmp_path / 'a', target_is_directory=True)
    with pytest.raises(InputError, match='c has no recording'):
        find_recordings(['c'], None)
    assert len(find_recordings(['c/link'], None)) == 5


def test_a_folder_that_cannot_be_read_is_named(monkeypatch):
    def fail(folder):
        raise PermissionError(13, 'Permission denied', folder)
    monkeypatch.setattr(recordings.os, 'scandir', fail)
    with pytest.raises(InputError, match='^cannot read a: Permission denied$'):
        find_recordings(['a'], None)


def test_a_list_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=f'^cannot read the list of recordings {tmp_path}/none: '):
        find_recordings([], tmp_path / 'none')


@pytest.mark.parametrize('count, is_too_many', [(3, False), (4, True)])
@pytest.mark.parametrize('is_listed', [False, True])
def test_a_fleet_has_a_limit(tmp_path, monkeypatch, count, is_too_many, is_listed):
    """However often each is named."""
    monkeypatch.setattr(recordings, 'MAX_RECORDINGS', 3)
    sources = [f'synthetic:{i % count}' for i in range(50)]
    (tmp_path / 'list').write_text('\n'.join(sources))
    given = ([], tmp_path / 'list') if is_listed else (sources, None)
    if is_too_many:
        with pytest.raises(InputError, match='^more than 3 recordings are given: name fewer, in'):
            find_recordings(*given)
    else:
        assert find_recordings(*given) == sources[:3]


def test_a_folder_with_too_many_recordings_is_not_searched_to_its_end(tmp_path, monkeypatch):
    monkeypatch.setattr(recordings, 'MAX_RECORDINGS', 3)
    for number in range(4):
        (tmp_path / f'{number}.mcap').touch()
    with pytest.raises(InputError, match='more than 3 recordings are given'):
        find_recordings([str(tmp_path)], None)


def test_a_source_is_searched_once(tmp_path, monkeypatch):
    searched = []
    monkeypatch.setattr(recordings, '_found', lambda source: searched.append(source) or [source])
    (tmp_path / 'list').write_text('a\nb # x\na\n' * 1000)
    find_recordings(['b'], tmp_path / 'list')
    assert searched == ['b', 'a']
