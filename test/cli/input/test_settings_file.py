# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Any parameter file gives settings or one sentence."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import parameters, values

KNOWN = {**values(Settings), **values(NodeSettings)}
RANGES = {parameter.name: parameter for parameter in parameters(Settings)}
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.dates(),
    st.binary(max_size=5), st.sampled_from([str(value) for value in KNOWN.values()]))
ANY = st.recursive(SCALARS, lambda parts: st.one_of(
    st.lists(parts, max_size=4), st.dictionaries(SCALARS, parts, max_size=4)), max_leaves=10)
NAMES = st.one_of(st.sampled_from([*KNOWN, *(name.split('.')[0] for name in KNOWN), 'preset']),
                  SCALARS)
VALUES = st.one_of(ANY, st.sampled_from(['x', '1e400', 'nan', '-1', '0x10', math.nan, math.inf,
                                         -1, 1e9]))
SECTIONS = st.one_of(st.dictionaries(NAMES, ANY, max_size=3),
                     st.dictionaries(st.sampled_from(sorted(KNOWN)), VALUES, min_size=1,
                                     max_size=2))


def outcome(path):
    try:
        return read_settings_file(path).applied_to(Settings())
    except InputError as error:
        return error


@given(st.one_of(ANY, *2 * [st.fixed_dictionaries({'/**': st.fixed_dictionaries(
    {'ros__parameters': SECTIONS})})]))
def test_any_yaml(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / 'any.yaml'
    path.write_text(yaml.safe_dump(content, allow_unicode=True))
    result = outcome(path)
    if isinstance(result, InputError):
        assert str(path) in str(result)
        return
    for name, value in values(result).items():
        limits = RANGES[name]
        assert type(value) is limits.type
        if limits.minimum is not None and limits.maximum is not None:
            assert limits.minimum <= value <= limits.maximum
        assert not isinstance(value, float) or math.isfinite(value)


@given(st.sampled_from(sorted(values(Settings))), st.data())
def test_values_of_the_right_kind_are_kept(tmp_path_factory, name, data):
    kind = RANGES[name].type
    drawn = data.draw({bool: st.booleans(), int: st.integers(), float: st.floats(),
                       str: st.sampled_from(RANGES[name].choices or ('',)),
                       tuple: st.lists(st.floats(-0.1, 0.6), max_size=5)}[kind])
    path = tmp_path_factory.getbasetemp() / 'one.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': {name: drawn}}}))
    result = outcome(path)
    low, high = RANGES[name].minimum, RANGES[name].maximum
    fits = not isinstance(drawn, float) or math.isfinite(drawn)
    if kind in (int, float):
        fits = fits and (low is None or low <= drawn) and (high is None or drawn <= high)
    if kind is tuple:  # sensor.roi_ratios, which leave a part of the image
        fits = (len(drawn) == 4 and min(drawn) >= 0.0
                and drawn[0] + drawn[1] < 1.0 and drawn[2] + drawn[3] < 1.0)
        drawn = tuple(drawn)
    if fits:
        assert values(result)[name] == drawn
    else:
        assert isinstance(result, InputError)


def test_a_preset_that_does_not_exist_is_named_with_its_file(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('odom_node: {ros__parameters: {preset: fast}}')
    assert str(outcome(path)).startswith(f"{path}: unknown preset 'fast': the presets are ")


@pytest.mark.parametrize('policy', ['null', "'null'", 'hold'])
def test_a_value_that_is_the_word_null(tmp_path, policy):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'/**:\n  ros__parameters:\n    lost_policy: {policy}\n    aick.alpha: 0.3\n')
    assert read_settings_file(path).changes['lost_policy'] == policy.strip("'")
    assert outcome(path).aick.alpha == 0.3


@pytest.mark.parametrize('name', ['lost_policy', 'aick.alpha', 'preset'])
def test_a_value_that_is_missing_is_named(tmp_path, name):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'/**:\n  ros__parameters:\n    {name}:\n')
    assert str(outcome(path)) == (
        f'{path}: {name} has no value, which ROS rejects, too: give one, or remove the line; an '
        "empty text is ''")


def test_a_second_document_is_not_ignored(tmp_path):
    path = tmp_path / 'a.yaml'
    path.write_text('/**:\n  ros__parameters: {features.max_keypoints: 500}\n---\n'
                    '/**:\n  ros__parameters: {features.max_keypoints: 600}\n')
    with pytest.raises(InputError, match=r'a\.yaml: it has a second document, .* in line 3: '):
        read_settings_file(path)
