# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Variables of the environment that libraries do without where they cannot use the value."""

from __future__ import annotations

import os
import re
from collections.abc import Callable

_OPENMP, _LEVELS = 'OMP_NUM_THREADS', re.compile(r'\s*([0-9]+)\s*(,\s*[0-9]+\s*)+')
"""Numbers of threads of levels that are nested; numexpr accepts the first alone."""


def _is(pattern: str) -> Callable[[str], object]:
    return re.compile(pattern, re.ASCII).fullmatch


_LOCALE = _is(r'|C|POSIX|C\.(UTF-8|utf8)|[A-Za-z]{2,3}(_[A-Za-z0-9]{2,3})?([.@][\w.@-]+)?')

_DIRECTIVE = r'[\w:-]+(=(?i:off|error|warn|info|debug|trace|[0-5]))?'

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
    # Rerun is disabled, raises NameError, ends the process, or prints lines
    'RERUN': _is('(?i:1|on|true|yes)'),
    'RERUN_STRICT': _is('(?i:0|1|false|true|off|on|no|yes)'),
    'TOKIO_WORKER_THREADS': _is('[1-9][0-9]{0,2}'),
    'RUST_LOG': _is(f'|{_DIRECTIVE}(,{_DIRECTIVE})*'),
    # Fontconfig, asked for fonts by matplotlib, prints lines, or reads without end
    **dict.fromkeys(('LC_ALL', 'LC_CTYPE', 'LANG', 'FC_LANG'), _LOCALE),
    'FONTCONFIG_FILE': os.path.isfile, 'FONTCONFIG_SYSROOT': os.path.isdir,
    'OPENSSL_CONF': os.path.isfile,  # read to its end
}
"""Whether a library can use the value of a variable."""


def remove_unusable() -> None:
    """Remove variables whose values libraries cannot use, before these are imported."""
    if levels := _LEVELS.fullmatch(os.environ.get(_OPENMP, '')):
        os.environ[_OPENMP] = levels[1]
    for name, is_usable in _USABLE.items():
        if name in os.environ and not is_usable(os.environ[name]):
            del os.environ[name]
