# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The YAML in bags, of limited size; it is parsed once, rosbags would do so at every reading."""

from __future__ import annotations

from functools import cache, lru_cache, partial
from importlib import import_module
from pathlib import PurePath
from typing import Any

from aick_ros.borders.limits import MAX_METADATA_BYTES, MAX_YAML_DEPTH, MAX_YAML_VALUES
from aick_ros.errors import InputError

_SUFFIXES = {'mcap': '.mcap', 'sqlite3': '.db3'}
_KEPT = 8  # texts whose content is kept; chosen: metadata.yaml, and the QoS of some topics


@cache
def limit_metadata() -> None:
    """Let rosbags, which parses any YAML, use the limits of this module."""
    for name in ('reader', 'metadata'):
        module = import_module(f'rosbags.rosbag2.{name}')
        setattr(module, 'YAML', partial(_Yaml, module.YAML))


def listed_files(metadata: bytes) -> tuple[str, list[str]]:
    """
    Return the usual suffix of the files of a bag, and their names in its folder.

    :param metadata: content of metadata.yaml; of what is damaged, which is left to the reader, no
        names are returned.
    """
    limit_metadata()
    yaml = import_module('rosbags.rosbag2.reader').YAML(typ='safe')
    try:
        content = yaml.load(metadata.decode())['rosbag2_bagfile_information']
        names = [PurePath(path).name for path in content['relative_file_paths']]
        return _SUFFIXES[content['storage_identifier']], names
    except Exception:  # YAML may have anything
        return '', []


class _Yaml:
    """The class YAML of a library, which loads within the limits."""

    def __init__(self, library: Any, typ: str) -> None:
        self._library, self._typ = library, typ

    def __getattr__(self, name: str) -> Any:
        return getattr(self._library(typ=self._typ), name)

    def load(self, text: str) -> Any:
        return _content(self._library, text, self._typ)


@lru_cache(_KEPT)
def _content(library: Any, text: str, kind: str) -> Any:
    if len(text) > MAX_METADATA_BYTES:
        raise InputError(f'its YAML has more than {MAX_METADATA_BYTES} characters')
    depth, count = -2, 0  # of the stream and the document
    for event in library(typ=kind, pure=True).parse(text):
        name = type(event).__name__
        depth += name.endswith('StartEvent') - name.endswith('EndEvent')
        count += 1
        if name == 'AliasEvent':  # with them, few lines may stand for any number of values
            raise InputError('its YAML has aliases, which no bag has')
        if depth > MAX_YAML_DEPTH:
            raise InputError(f'its YAML is nested deeper than {MAX_YAML_DEPTH} levels')
        if count > MAX_YAML_VALUES:
            raise InputError(f'its YAML has more than {MAX_YAML_VALUES} values')
    return library(typ=kind).load(text)
