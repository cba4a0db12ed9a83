#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Write what is generated: docs/api.md, the tables of docs/parameters.md, config/odom_node.yaml.

The API comes from the docstrings of the public names, the rest from the settings. Run it after a
change of either; a test compares the files with what this prints.
"""

from __future__ import annotations

import ast
import functools
import inspect
import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import FunctionType

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import aick_ros  # noqa: E402
from aick_ros.settings import NodeSettings, Settings  # noqa: E402
from aick_ros.settings.parameter import values  # noqa: E402
from aick_ros.settings.presets import PRESETS  # noqa: E402
from aick_ros.settings.text import parameter_table, scalar_text  # noqa: E402

GROUPS = {
    'Odometry': ['Odometry', 'OdometryUpdate', 'Status', 'Increment', 'PoseWithCovariance'],
    'Frames and recordings': ['RgbdFrame', 'ImuSamples', 'Camera', 'open_source', 'SourceOptions',
                              'RgbdSource', 'Trajectory'],
    'Registration': ['Registrar', 'Preparation', 'PreparedFrame', 'ExpectedPose', 'Aick',
                     'Registration'],
    'Keypoints': ['KeypointExtractor', 'KeypointFrame', 'Detector', 'Features'],
    'Settings and errors': ['Settings', 'preset', 'with_values', 'InputError'],
}
TITLE = """\
<!-- Written by tools/write_docs.py from the docstrings: edit them. -->

# The library

All names are imported from `aick_ros` itself, for example `from aick_ros import Odometry`. Lengths
are in metres, angles in radians, stamps in nanoseconds; `T_target_source` maps points of the frame
`source` into the frame `target`; covariances are ordered (x, y, z, rot x, rot y, rot z).

Examples, each in a page of code:

"""
BLOCK = r'(<!-- parameters of the {} -->\n).*?(<!-- end -->)'


def api_page() -> str:
    """Return docs/api.md."""
    parts = [TITLE, *map(_example, sorted((ROOT / 'examples').glob('*.py')))]
    for title, names in GROUPS.items():
        parts.append(f'\n## {title}\n')
        for name in names:
            parts.append('\n' + '\n'.join(_entry(name, getattr(aick_ros, name))) + '\n')
    return re.sub(r'\n{3,}', '\n\n', ''.join(parts))


def parameters_page() -> str:
    """Return docs/parameters.md with its tables renewed."""
    text = (ROOT / 'docs' / 'parameters.md').read_text()
    tables = {'algorithm': parameter_table(Settings()), 'node': parameter_table(NodeSettings()),
              'presets': preset_table()}
    for name, table in tables.items():
        text = re.sub(BLOCK.format(name), lambda found: f'{found[1]}\n{table}\n{found[2]}', text,
                      flags=re.DOTALL)
    return text


def preset_table() -> str:
    """Return what the presets change as a Markdown table, a column for each."""
    rows = [['parameter', 'default', *(f'`{name}`' for name in PRESETS)],
            ['---'] * (2 + len(PRESETS))]
    for name, default in values(Settings()).items():
        cells = [f'`{scalar_text(changes[name])}`' if name in changes else ''
                 for changes in PRESETS.values()]
        if any(cells):
            rows.append([f'`{name}`', f'`{scalar_text(default)}`', *cells])
    return ''.join(f'| {" | ".join(row)} |\n' for row in rows)


def node_file() -> str:
    """Return config/odom_node.yaml, as the command prints it."""
    return subprocess.run([sys.executable, '-m', 'aick_ros', 'parameters', '--format', 'yaml'],
                          cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout


def _example(file: Path) -> str:
    first, *_ = (ast.get_docstring(ast.parse(file.read_text())) or '').splitlines()
    return f'- [{file.name}](../examples/{file.name}): {first}\n'


def _entry(name: str, thing: object) -> Iterator[str]:
    """Yield the lines of one public name."""
    yield f'### `{name}`\n'
    definition = _definition(thing)
    if isinstance(definition, ast.FunctionDef):
        yield _call(name, _arguments(definition), definition.returns)
        yield from _text(inspect.getdoc(thing))
        return
    arguments = _constructor(definition)
    if arguments is not None:
        yield _call(name, arguments)
    yield from _text(inspect.getdoc(thing))
    if isinstance(thing, type) and issubclass(thing, Enum):
        yield from (f'- `{member.name}`: {member.value}' for member in thing)
        yield ''
    for method in _methods(definition):
        yield f'#### `{name}.{method.name}`\n'
        if not isinstance(vars(thing)[method.name], property | functools.cached_property):
            yield _call(method.name, _arguments(method), method.returns)
        yield from _text(ast.get_docstring(method))


def _definition(thing: object) -> ast.ClassDef | ast.FunctionDef:
    assert isinstance(thing, type | FunctionType)
    source = textwrap.dedent(inspect.getsource(thing))
    definition = ast.parse(source).body[0]
    assert isinstance(definition, ast.ClassDef | ast.FunctionDef)
    return definition


def _methods(definition: ast.ClassDef) -> list[ast.FunctionDef]:
    return [node for node in definition.body if isinstance(node, ast.FunctionDef)
            and (not node.name.startswith('_') or node.name in ('__len__', '__matmul__'))]


def _constructor(definition: ast.ClassDef) -> list[str] | None:
    """Return the arguments of a class: those of ``__init__``, or the fields of a dataclass."""
    for node in definition.body:
        if isinstance(node, ast.FunctionDef) and node.name == '__init__':
            return _arguments(node)
    if 'dataclass' not in ' '.join(map(ast.unparse, definition.decorator_list)):
        return None
    return [_argument(node.target, node.annotation, node.value) for node in definition.body
            if isinstance(node, ast.AnnAssign)]


def _arguments(function: ast.FunctionDef) -> list[str]:
    names = [argument for argument in function.args.args if argument.arg not in ('self', 'cls')]
    defaults = function.args.defaults
    padded = [*[None] * (len(names) - len(defaults)), *defaults]
    return [_argument(ast.Name(argument.arg), argument.annotation, default)
            for argument, default in zip(names, padded)]


def _argument(name: ast.expr, annotation: ast.expr | None, default: ast.expr | None) -> str:
    declared = ast.unparse(name) + (f': {ast.unparse(annotation)}' if annotation else '')
    if default is None:
        return declared
    text = ast.unparse(default)
    return f'{declared} = {"..." if text.startswith(("field(", "lambda")) else text}'


def _call(name: str, arguments: list[str], returned: ast.expr | None = None) -> str:
    """Return a call as a block of code, one argument per line where it is long."""
    end = f' -> {ast.unparse(returned)}' if returned else ''
    line = f'{name}({", ".join(arguments)}){end}'
    if len(line) > 99:
        line = f'{name}(\n' + ''.join(f'    {part},\n' for part in arguments) + f'){end}'
    return f'```python\n{line}\n```\n'


def _text(docstring: str | None) -> Iterator[str]:
    """Yield a docstring as Markdown: its text, then a list of its fields."""
    text, *fields = re.split(r'^:', _plain(docstring or ''), flags=re.MULTILINE)
    yield text.strip() + '\n'
    for field in fields:
        head, _, meaning = field.partition(':')
        kind, _, name = head.partition(' ')
        label = {'param': f'`{name}`', 'returns': 'Returns', 'raises': f'Raises `{name}`'}[kind]
        yield f'- {label}: {" ".join(meaning.split())}'
    if fields:
        yield ''


def _plain(docstring: str) -> str:
    """Return a docstring with the roles of reStructuredText as plain code."""
    docstring = re.sub(r':\w+:`~?(?:aick_ros\.[\w.]*\.)?([^`]+)`', r'`\1`', docstring)
    return docstring.replace('``', '`')


def main() -> None:
    """Write the files."""
    (ROOT / 'docs' / 'api.md').write_text(api_page())
    (ROOT / 'docs' / 'parameters.md').write_text(parameters_page())
    (ROOT / 'config' / 'odom_node.yaml').write_text(node_file())


if __name__ == '__main__':
    main()
