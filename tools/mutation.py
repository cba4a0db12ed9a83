#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Count how many defects, put into the core one at a time, its tests notice.

Each defect (a mutant) is one operator, comparison, number or statement changed by Cosmic Ray,
drawn at random from a folder. Only the tests of its file are run: the one of the same name, and
those of the same folder that import it. A mutant that makes them last longer than a limit counts
as noticed.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.provider import OperatorProvider

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ('geometry', 'frames', 'registration', 'odometry', 'messages')
NOT_DRAWN = re.compile('Variable|_(BitAnd|BitOr|BitXor|LShift|RShift|Mod|Pow|FloorDiv|MatMul)$|'
                       '_Invert|_Is$|_IsNot$')
"""Operators that need arguments, and those whose defects nobody makes, which all tests notice."""
LIMIT = 300  # seconds for the tests of a mutant


class Mutant(NamedTuple):
    """A defect: the n-th place of a file where an operator of Cosmic Ray changes it."""

    path: Path
    operator: str
    occurrence: int
    line: int


def main() -> None:
    """Print each mutant with the score so far, and what no test noticed."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--mutants', type=int, default=30, help='per folder; default 30')
    parser.add_argument('--seed', default='0', help='of the draw')
    parser.add_argument('--folder', action='append', choices=FOLDERS, help='default: all')
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix='aick-mutation-') as folder:
        tree = _copy(Path(folder))
        for name in arguments.folder or FOLDERS:
            drawn = _draw(name, arguments.mutants, f'{arguments.seed} {name}')
            noticed = 0
            for number, mutant in enumerate(drawn, 1):
                before = mutant.path.read_text()
                after = _mutated(mutant, before)
                is_noticed = _is_noticed(tree, mutant, after)
                noticed += is_noticed
                print(f'{name} {noticed} of {number}: {noticed / number:.2f}', end=' ')
                print('noticed' if is_noticed else 'not noticed',
                      f'{mutant.path.relative_to(ROOT)}:{mutant.line} ({mutant.operator})\n'
                      + ('' if is_noticed else _difference(before, after)), end='', flush=True)


def _copy(folder: Path) -> Path:
    """Return a copy of what the tests need; the mutants are made there."""
    for name in ('aick_ros', 'test', 'examples', 'config', 'docs', 'tools', 'setup.cfg'):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns('__pycache__'))
        else:
            shutil.copy(source, folder / name)
    return folder


def _draw(name: str, count: int, seed: str) -> list[Mutant]:
    """Return mutants of a folder at random, each place once."""
    mutants = [mutant for path in sorted((ROOT / 'aick_ros' / name).rglob('*.py'))
               for mutant in _mutants_of(path)]
    random.Random(seed).shuffle(mutants)
    drawn: dict[tuple[Path, int], Mutant] = {}
    for mutant in mutants:  # a line with many operators would be drawn again and again
        drawn.setdefault((mutant.path, mutant.line), mutant)
    return list(drawn.values())[:count]


def _mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield the mutants of a file, but for those of annotations, which change nothing."""
    text, provider = path.read_text(), OperatorProvider()
    annotations = _lines_of_annotations(text)
    nodes = list(ast_nodes(get_ast(text)))
    for name in provider:
        if NOT_DRAWN.search(name):
            continue
        operator = provider[name]()
        places = [start for node in nodes for start, _ in operator.mutation_positions(node)]
        for occurrence, place in enumerate(places):
            if not any(start <= place < end for start, end in annotations):
                yield Mutant(path, name, occurrence, place[0])


def _lines_of_annotations(text: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the first and the last position of each annotation."""
    found = []
    for node in ast.walk(ast.parse(text)):
        for part in (getattr(node, 'annotation', None), getattr(node, 'returns', None)):
            if isinstance(part, ast.expr):
                found.append(((part.lineno, part.col_offset),
                              (part.end_lineno or 0, part.end_col_offset or 0)))
    return found


def _mutated(mutant: Mutant, text: str) -> str:
    return str(mutate_code(text, OperatorProvider()[mutant.operator](), mutant.occurrence))


def _is_noticed(tree: Path, mutant: Mutant, text: str) -> bool:
    """Return whether a test of the file fails."""
    file = tree / mutant.path.relative_to(ROOT)
    original = file.read_text()
    file.write_text(text)
    try:
        return subprocess.run(
            [sys.executable, '-m', 'pytest', '-x', '-q', '--import-mode=importlib',
             '-p', 'no:cacheprovider', *_tests_of(mutant.path)], cwd=tree, timeout=LIMIT,
            env={**os.environ, 'PYTHONDONTWRITEBYTECODE': '1',
                 'PYTHONPATH': f'{tree}{os.pathsep}{os.environ.get("PYTHONPATH", "")}'},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        file.write_text(original)


def _tests_of(path: Path) -> list[str]:
    """Return the tests of a file, from the root; where there are none, the tests of the folder."""
    place = path.relative_to(ROOT / 'aick_ros')
    mirror = ROOT / 'test' / place.parent / f'test_{path.name}'
    module = '.'.join(('aick_ros', *place.with_suffix('').parts))
    imports = re.compile(rf'{re.escape(module)}\b|from {re.escape(module.rpartition(".")[0])} '
                         rf'import .*\b{path.stem}\b')
    folder = ROOT / 'test' / place.parts[0]
    tests = {test for test in folder.rglob('test_*.py') if imports.search(test.read_text())}
    tests |= {mirror} & {*folder.rglob('test_*.py')}
    return sorted(str(test.relative_to(ROOT)) for test in tests or {folder})


def _difference(before: str, after: str) -> str:
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm='')
    return ''.join(f'    {line}\n' for line in lines if not line.startswith(('---', '+++', '@@')))


if __name__ == '__main__':
    main()
