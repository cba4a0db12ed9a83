# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The scripts in benchmarks/, which are no package, as modules."""

import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope='session')
def load():
    """Return a function from the path of a script to its module."""
    def load_script(path: Path):
        before = set(sys.modules)
        sys.path.insert(0, str(path.parent))
        try:
            spec = importlib.util.spec_from_file_location(path.stem, path)
            module = importlib.util.module_from_spec(spec)
            sys.modules[path.stem] = module  # dataclasses look their module up
            spec.loader.exec_module(module)
        finally:
            sys.path.remove(str(path.parent))
            for name in set(sys.modules) - before:  # other scripts have neighbours of these names
                if getattr(sys.modules[name], '__file__', None) == str(path.parent / f'{name}.py'):
                    del sys.modules[name]
        return module
    return load_script
