# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Patterns match what glob.glob matches, and end where links lead in circles."""

import glob
import os

import pytest

from aick_ros.cli.fleet.patterns import matches_of

FILES = ('x.mcap', 'a/x.mcap', 'a/b/x.mcap', 'a/b/c/y.bag', 'b/a/b/x.mcap', '.h/x.mcap',
         'a/.h/x.mcap', 'a/[1]/x.mcap', 'b/n\n/x.mcap')


@pytest.fixture
def tree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize('pattern', [
    '*', '**', 'a/**', '**/x.mcap', '**/b/*.mcap', '**/**/x.mcap', 'a/**/x.mcap', '*/**/*.bag',
    '**/b/**/x.*', 'a/**/b/**', '**/[[]1]/*', '**/none', 'x.mcap', 'a/', '**/b/',
    'a/**/', './**/x.mcap', '**/.h/*', '[ab]/**/x.mcap'])
@pytest.mark.parametrize('is_absolute', [False, True])
def test_matches_are_those_of_glob(tree, pattern, is_absolute):
    if is_absolute:
        pattern = f'{tree}/{pattern}'

    def files(paths):
        return {os.path.abspath(path) for path in paths}
    assert files(matches_of(pattern)) - {str(tree)} == files(
        glob.glob(pattern, recursive=True)) - {str(tree)}


@pytest.mark.parametrize('pattern, count', [
    ('**/x.mcap', 6), ('**/**/**/**/**/x.mcap', 6), ('**/a/**/x.mcap', 4), ('**/none', 0)])
def test_links_in_circles_are_not_followed(tree, pattern, count):
    for name in ('l', 'm', 'a/l', 'a/b/m'):
        (tree / name).symlink_to(tree)
    assert len({os.path.abspath(path) for path in matches_of(pattern)}) == count


def test_no_name_matches_nothing(tree):
    assert matches_of('') == set()


def test_a_folder_that_is_not_there_matches_nothing(tree):
    assert matches_of('none/**') == set()


def test_links_that_are_named_are_followed(tree):
    (tree / 'l').symlink_to(tree / 'a')
    assert {os.path.normpath(path) for path in matches_of('l/**/y.bag')} == {'l/b/c/y.bag'}
    assert {os.path.normpath(path) for path in matches_of('**/l/x.mcap')} == {'l/x.mcap'}
