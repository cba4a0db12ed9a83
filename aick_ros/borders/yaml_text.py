# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""YAML of limited depth and size, in which no key is given twice."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import yaml

from aick_ros.borders.limits import MAX_YAML_DEPTH, MAX_YAML_VALUES
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError

_UNNAMED = ' in "<unicode string>", '
"""Name that PyYAML gives to a text in its errors; the sentences around them name the file."""


class _ParameterLoader(yaml.SafeLoader):
    """Loader to which plain words are text that are so to rcl: null, ~ and dates."""

    yaml_implicit_resolvers = {
        first: [(tag, words) for tag, words in resolvers
                if not first or tag.rpartition(':')[2] not in ('null', 'timestamp')]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()}


def parse_yaml(text: str) -> Any:
    """
    Return the first document of YAML text, None where there is none.

    :raises InputError: where the text is not YAML, or nested too deep, or its aliases expand to
        too many values, or a mapping has a key twice; the message starts with 'it'.
    """
    return _parsed(text, yaml.SafeLoader)


def parse_parameters(text: str) -> Any:
    """
    Return the only document of a ROS parameter file, in which ``null`` is a word as any other.

    Values that are not given, which rcl rejects, are None.

    :raises InputError: see :func:`parse_yaml`, and where there is a second document.
    """
    return _parsed(text, _ParameterLoader)


def _parsed(text: str, loader_class: type[yaml.SafeLoader]) -> Any:
    try:
        _require_shallow(text)
        loader = loader_class(text)
        try:
            if not loader.check_node():
                return None
            node = loader.get_node()
            _count(node, {})
            if loader_class is _ParameterLoader and loader.check_node():
                second: Any = loader.peek_event()  # type: ignore[no-untyped-call]
                raise InputError('it has a second document, which begins in line '
                                 f'{second.start_mark.line + 1}: write all parameters into the '
                                 'first one')
            return loader.construct_document(node)
        finally:
            loader.dispose()
    except InputError:
        raise
    except yaml.YAMLError as error:
        reason = ' '.join(str(error).split()).replace(_UNNAMED, ' in ')
        raise InputError(f'it is not YAML: {reason}') from None
    except (ValueError, TypeError, OverflowError, AttributeError, LookupError) as error:
        # dates that do not exist, integers of thousands of digits, !!bool maybe
        raise InputError(f'it is not YAML: a value is not of its type ({error})') from None


def _require_shallow(text: str) -> None:
    """Check the depth of the first document; the parser is iterative, the composer recursive."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.DocumentEndEvent):
            return
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > MAX_YAML_DEPTH:
            raise InputError(f'it is nested deeper than {MAX_YAML_DEPTH} levels')


def _count(node: Any, counts: dict[int, int]) -> int:
    """Return the number of values below a node with aliases expanded, each node visited once."""
    if id(node) in counts:
        if not counts[id(node)]:
            raise InputError('it has an alias to itself')
        return counts[id(node)]
    counts[id(node)] = 0
    children = node.value if not isinstance(node.value, str) else ()
    if isinstance(node, yaml.MappingNode):
        _require_different(key for key, _ in children)
    count = 1
    for child in children:
        for part in child if isinstance(child, tuple) else (child,):
            count += _count(part, counts)
    if count > MAX_YAML_VALUES:
        raise InputError(f'it has more than {MAX_YAML_VALUES} values')
    counts[id(node)] = count
    return count


def _require_different(keys: Iterable[yaml.Node]) -> None:
    """Raise InputError where a key repeats; PyYAML would keep the last of its values."""
    lines: dict[tuple[str, str], int] = {}
    for key in keys:
        if not isinstance(key, yaml.ScalarNode):
            continue
        line, name = key.start_mark.line + 1, (key.tag, key.value)
        if name in lines:
            raise InputError(f'it has {quoted(key.value)} twice, in lines {lines[name]} and '
                             f'{line}: remove one')
        lines[name] = line
