# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Combinations of settings against their product."""

import itertools

import pytest

from aick_ros.cli.fleet.sweep import variants
from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values, with_values


def test_each_combination_is_a_variant_with_its_values():
    base = with_values(Settings(), {'sensor.min_depth': 0.3})
    found = variants(base, [' aick.iterations = 5, 25,5', 'sensor.max_depth=4,4.50',
                            'imu.gravity=false,true'])
    product = itertools.product((5, 25), (4.0, 4.5), (False, True))
    before = values(base)
    for variant, (iterations, depth, gravity) in zip(found, product, strict=True):
        varied = {'aick.iterations': iterations, 'sensor.max_depth': depth,
                  'imu.gravity': gravity}
        assert variant.varied == varied  # as numbers, to be plotted by
        assert [type(value) for value in variant.varied.values()] == [int, float, bool]
        assert values(variant.settings) == {**before, **varied}
    assert [variant.name for variant in found[:2]] == [
        'aick.iterations=5,sensor.max_depth=4,imu.gravity=false',
        'aick.iterations=5,sensor.max_depth=4,imu.gravity=true']


def test_without_anything_to_vary_the_settings_are_the_only_variant():
    only, = variants(Settings(), [])
    assert (only.name, only.settings, only.varied) == ('settings', Settings(), {})


def test_files_are_named_by_their_absolute_paths(tmp_path, monkeypatch):
    """Those of the command, as workers may work in other folders."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('HOME', '/home/robot')
    base = with_values(Settings(), {'sensor.mask': 'body.png', 'aick.vocabulary': 'orb-1000'})
    one, other = variants(base, ['aick.vocabulary=~/words.npz,orb-1000'])
    assert one.settings.files == ('/home/robot/words.npz', f'{tmp_path}/body.png')
    assert other.settings.files == ('orb-1000', f'{tmp_path}/body.png')
    assert one.name == 'aick.vocabulary=~/words.npz'
    assert one.varied == {'aick.vocabulary': '~/words.npz'}
    masked, plain = variants(Settings(), ['sensor.mask=arm.png,/body.png'])
    assert masked.settings.files == ('', f'{tmp_path}/arm.png')
    assert plain.settings.files == ('', '/body.png')


@pytest.mark.parametrize('vary, sentence', [
    (['aick.iterations'], 'NAME=VALUE,VALUE is required'),
    (['aick.iterations=5,,6'], 'NAME=VALUE,VALUE is required'),
    (['frame_id=a,b'], '^--vary frame_id: this is a parameter of the node alone'),
    (['aick.iterations=5', 'aick.iterations=6'], 'twice'),
    (['aick.iterations=' + ','.join(map(str, range(1, 1002)))], 'more than 1000 combinations')])
def test_what_is_no_sweep_is_rejected(vary, sentence):
    with pytest.raises(InputError, match=sentence):
        variants(Settings(), vary)
