# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables that libraries cannot use are removed; test_run has the libraries."""

import functools
import os
import shutil
import subprocess
import sys

import pytest

from aick_ros.borders.variables import remove_unusable

FC_LIST = shutil.which('fc-list')


def left_of(monkeypatch, name, value):
    """Return what is left of a variable; None where it is removed."""
    monkeypatch.setattr(os, 'environ', {'OTHER': 'x', name: value})
    remove_unusable()
    assert os.environ['OTHER'] == 'x'
    return os.environ.get(name)


@pytest.mark.parametrize('value, expected', [
    ('4,2', '4'), (' 3 , 2,1', '3'), ('4', '4'), ('0,2', None), ('4,', None), (',4', None),
    ('4,x', None)])
def test_of_threads_of_nested_levels_those_of_the_first_are_used(monkeypatch, value, expected):
    assert left_of(monkeypatch, 'OMP_NUM_THREADS', value) == expected


@pytest.mark.parametrize('name, value', [
    ('LC_ALL', ''), ('LC_ALL', 'C'), ('LC_ALL', 'POSIX'), ('LC_ALL', 'C.UTF-8'), ('LANG', 'de'),
    ('LANG', 'en_US.UTF-8'), ('LC_CTYPE', 'sr_RS@latin'), ('LANG', 'tr_TR.ISO-8859-9'),
    ('COLUMNS', '80'), ('LINES', '0'), ('SOURCE_DATE_EPOCH', '1'), ('ARROW_IO_THREADS', '8'),
    ('ARROW_DEFAULT_MEMORY_POOL', 'system'), ('ARROW_USER_SIMD_LEVEL', 'avx2'),
    ('RERUN_STRICT', 'True'), ('TOKIO_WORKER_THREADS', '2'), ('RUST_LOG', 'warn,re_sdk::x=off'),
    ('FONTCONFIG_SYSROOT', '/'), ('MIMALLOC_VERBOSE', '0'), ('MIMALLOC_SHOW_STATS', 'No'),
    ('mimalloc_purge_delay', '10'), ('JE_ARROW_MALLOC_CONF', ''),
    ('JE_ARROW_MALLOC_CONF', 'dirty_decay_ms:-1,muzzy_decay_ms:500')])
def test_what_libraries_can_use_stays(monkeypatch, name, value):
    assert left_of(monkeypatch, name, value) == value


@pytest.mark.parametrize('name, value', [
    ('LC_ALL', '\x1b[31m'), ('LC_CTYPE', 'UTF-8'), ('LANG', 'english'), ('LANG', 'zh_Hans_CN'),
    ('LC_ALL', 'C.x'), ('COLUMNS', '²'), ('COLUMNS', '0'), ('SOURCE_DATE_EPOCH', 'x'),
    ('ARROW_IO_THREADS', '-5'), ('ARROW_IO_THREADS', '0'), ('ARROW_DEFAULT_MEMORY_POOL', 'x'),
    ('ARROW_DEBUG_MEMORY_POOL', 'x'), ('ARROW_USER_SIMD_LEVEL', '\x1b'), ('RERUN_STRICT', 'x'),
    ('TOKIO_WORKER_THREADS', '0'), ('RERUN', 'off'), ('RUST_LOG', '\x1b'), ('RUST_LOG', 'x=y'),
    ('FONTCONFIG_FILE', '/dev/zero'), ('FONTCONFIG_FILE', '/'), ('OPENSSL_CONF', '/dev/zero'),
    ('FONTCONFIG_FILE', __file__), ('FONTCONFIG_FILE', '/none'), ('FONTCONFIG_FILE', '\udcff'),
    ('FONTCONFIG_SYSROOT', '/none'), ('MIMALLOC_VERBOSE', 'x'), ('MIMALLOC_VERBOSE', ''),
    ('mimalloc_verbose', '-1'), ('MIMALLOC_RESERVE_OS_MEMORY', '\x1b'),
    ('JE_ARROW_MALLOC_CONF', 'x'), ('JE_ARROW_MALLOC_CONF', 'x:y'),
    ('JE_ARROW_MALLOC_CONF', 'narenas:x'), ('JE_ARROW_MALLOC_CONF', 'dirty_decay_ms:1,')])
def test_what_they_cannot_use_is_removed(monkeypatch, name, value):
    assert left_of(monkeypatch, name, value) is None


@pytest.mark.parametrize('name, value', [
    *[('JE_ARROW_MALLOC_CONF', value) for value in (
        '', 'x', 'x:y', 'narenas:x', 'narenas:99999999', 'dirty_decay_ms:1,', 'prof:true',
        'dirty_decay_ms:999999999', 'muzzy_decay_ms:-1,dirty_decay_ms:0', 'dirty_decay_ms:1e9')],
    *[(name, value) for name in ('MIMALLOC_VERBOSE', 'mimalloc_verbose')
      for value in ('', '0', 'off', 'x', '-1', '1K', '\x1b[31m')]])
def test_of_allocators_arrow_has_nothing_to_say(monkeypatch, name, value):
    pytest.importorskip('pyarrow', exc_type=ImportError)  # it needs NumPy 2
    left = left_of(monkeypatch, name, value)
    monkeypatch.undo()
    assert arrow(None if left is None else name, left) == (0, b'')


@functools.cache
def arrow(name, value):
    """Return the exit code of a process with one variable, or none, and what Arrow says in it."""
    said = subprocess.run([sys.executable, '-c', 'import pyarrow; pyarrow.array(range(1000))'],
                          env={} if name is None else {name: value}, stderr=subprocess.PIPE)
    return said.returncode, said.stderr


@pytest.mark.skipif(FC_LIST is None, reason='fontconfig is not installed')
@pytest.mark.parametrize('content, stays', [
    (b'', False), (b'fonts', False), (b'<fontconfig>', False), (b'<fonts></fonts>', False),
    (b'<?xml version="1.0" encoding="none"?><fontconfig></fontconfig>', False),
    (b'<fontconfig></fontconfig>', True),
    (b'\xef\xbb\xbf<?xml version="1.0"?>\n<fontconfig></fontconfig>', True)])
def test_of_files_for_fontconfig_it_has_nothing_to_say(monkeypatch, tmp_path, content, stays):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'fonts').write_bytes(content)
    assert left_of(monkeypatch, 'FONTCONFIG_FILE', 'fonts') is None
    left = left_of(monkeypatch, 'FONTCONFIG_FILE', str(tmp_path / 'fonts'))
    assert (left is not None) is stays
    said = subprocess.run([FC_LIST, ':family=none'], stderr=subprocess.PIPE,
                          env={} if left is None else {'FONTCONFIG_FILE': left})
    assert said.stderr == b''


@pytest.mark.skipif(FC_LIST is None, reason='fontconfig is not installed')
@pytest.mark.parametrize('value', [
    '', 'C', 'POSIX', 'C.UTF-8', 'C.utf8', 'de', 'de_DE', 'en_US.UTF-8', 'sr_RS@latin', 'ab_CDE',
    'abc', 'x', 'UTF-8', 'english', 'zh_Hans_CN', 'C.x', 'en_US,x', 'ab_CDEF', '\x1b[31m'])
def test_of_locales_fontconfig_has_nothing_to_say(monkeypatch, value):
    left = left_of(monkeypatch, 'LC_ALL', value)
    said = subprocess.run(
        [FC_LIST, ':family=none'], capture_output=True,
        env={} if left is None else {'LC_ALL': left})
    assert said.stderr == b''
