# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables of the environment that libraries do without where they cannot use the value."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from fnmatch import filter as matching
from pathlib import Path

from aick_ros.borders.files import read_bytes
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES

_OPENMP, _LEVELS = 'OMP_NUM_THREADS', re.compile(r'\s*([0-9]+)\s*(,\s*[0-9]+\s*)+')
"""Numbers of threads of levels that are nested; numexpr accepts the first alone."""


def _is(pattern: str) -> Callable[[str], object]:
    return re.compile(pattern, re.ASCII).fullmatch


_LOCALE = _is(r'|C|POSIX|C\.(UTF-8|utf8)|[A-Za-z]{2,3}(_[A-Za-z0-9]{2,3})?([.@][\w.@-]+)?')

_DECAY = r'(dirty|muzzy)_decay_ms:(-1|[0-9]{1,9})'

_DIRECTIVE = r'[\w:-]+(=(?i:off|error|warn|info|debug|trace|[0-5]))?'


def _is_fontconfig(path: str) -> bool:
    """Return whether a path is that of a file for Fontconfig; one that is relative is not."""
    from xml.etree import ElementTree
    try:
        content = read_bytes(Path(path), 'the fonts', MAX_CONFIGURATION_BYTES)
        is_fontconfig = ElementTree.fromstring(content).tag == 'fontconfig'
    except (ElementTree.ParseError, ValueError, LookupError):  # the last of unknown encodings
        return False
    return is_fontconfig and os.path.isabs(path)  # it seeks others in folders of its own


_USABLE: dict[str, Callable[[str], object]] = {
    'SOURCE_DATE_EPOCH': _is('[0-9]{1,11}'),  # seconds, up to the year 5138
    'COLUMNS': _is('[1-9][0-9]{1,3}'),  # at 0, rich prints nothing
    'LINES': _is('[0-9]{1,4}'),
    # numexpr, behind pandas, raises ValueError
    **dict.fromkeys((_OPENMP, 'NUMEXPR_NUM_THREADS', 'NUMEXPR_MAX_THREADS'),
                    _is('[1-9][0-9]{0,2}')),
    # Arrow prints lines
    'ARROW_DEFAULT_MEMORY_POOL': _is('|system|jemalloc|mimalloc'),
    'ARROW_DEBUG_MEMORY_POOL': _is('|none|warn|trap|abort'),
    'ARROW_USER_SIMD_LEVEL': _is('(?i:|NONE|SSE4_2|AVX|AVX2|AVX512|MAX)'),
    'ARROW_REGISTER_ATFORK': _is('|0|1'),
    'ARROW_IO_THREADS': _is('[1-9][0-9]{0,3}'),
    'JE_ARROW_MALLOC_CONF': _is(f'|{_DECAY}(,{_DECAY})*'),  # all others depend on the build
    **dict.fromkeys(('MIMALLOC_*', 'mimalloc_*'),
                    _is('(?i:0|1|true|yes|on|false|no|off|[0-9]{1,9})')),
    # Rerun is disabled, raises NameError, ends the process, or prints lines
    'RERUN': _is('(?i:1|on|true|yes)'),
    'RERUN_STRICT': _is('(?i:0|1|false|true|off|on|no|yes)'),
    'TOKIO_WORKER_THREADS': _is('[1-9][0-9]{0,2}'),
    'RUST_LOG': _is(f'|{_DIRECTIVE}(,{_DIRECTIVE})*'),
    # Fontconfig, asked for fonts by matplotlib, prints lines, or reads without end
    **dict.fromkeys(('LC_ALL', 'LC_CTYPE', 'LANG', 'FC_LANG'), _LOCALE),
    'FONTCONFIG_FILE': _is_fontconfig, 'FONTCONFIG_SYSROOT': os.path.isdir,
    'OPENSSL_CONF': os.path.isfile,  # read to its end
}
"""Name of a variable, or pattern of names -> whether a library can use its value."""


def remove_unusable() -> None:
    """Remove variables whose values libraries cannot use, before these are imported."""
    if levels := _LEVELS.fullmatch(os.environ.get(_OPENMP, '')):
        os.environ[_OPENMP] = levels[1]
    for pattern, is_usable in _USABLE.items():
        for name in matching(os.environ, pattern):
            if not is_usable(os.environ[name]):
                del os.environ[name]
