# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""JSON for people and for ``diff``: short values on one line, long lists of numbers wrapped."""

from __future__ import annotations

import json
import textwrap
from typing import Any

_WIDTH = 99
_STEP = '  '


def json_text(content: Any, indent: str = '', before: int = 0) -> str:
    """
    Return content as JSON.

    :param content: as for ``json.dumps``, with strings as keys.
    :param indent: indentation of the lines after the first.
    :param before: number of characters before the text on its first line.
    :raises ValueError: for NaN or an infinite number.
    """
    line = json.dumps(content, allow_nan=False)
    if not isinstance(content, (dict, list, tuple)) or before + len(line) < _WIDTH:
        return line
    inner = indent + _STEP
    if isinstance(content, dict):
        keys = [f'{inner}{json.dumps(key)}: ' for key in content]
        parts = [key + json_text(value, inner, len(key))
                 for key, value in zip(keys, content.values())]
        return '{\n' + ',\n'.join(parts) + f'\n{indent}}}'
    if all(isinstance(entry, (int, float)) for entry in content):
        rows = textwrap.wrap(line[1:-1], _WIDTH, initial_indent=inner, subsequent_indent=inner)
        return '[\n' + '\n'.join(rows) + f'\n{indent}]'
    parts = [inner + json_text(entry, inner, len(inner)) for entry in content]
    return '[\n' + ',\n'.join(parts) + f'\n{indent}]'
