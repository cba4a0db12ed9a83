# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The table of methods: what it says of each is what the method is made with."""

import re

import cv2
import pytest

from aick_ros.evaluation.baselines import registry
from aick_ros.evaluation.baselines.registry import METHODS, Method, Need, aick, make
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import preset


def settings_of(method):
    name, changes = method.options['preset_name'], method.options['changes']
    return with_values(preset(name) if name else Settings(), changes)


@pytest.mark.parametrize('name', [name for name in METHODS if name.startswith('aick-')])
def test_words_and_settings_of_the_papers_variants_agree(name):
    """The fast ones are those above them in the table, with a vocabulary."""
    method = METHODS[name]
    words = method.settings
    base = METHODS[name.replace('-fast', '-350' if 'orb' in name else '-200')]
    settings = settings_of(method)
    assert settings.refinement.mode == 'none'
    assert settings.features.detector == ('orb' if 'orb' in name else 'surf')
    assert settings.features.detector.upper() in method.title
    found = re.search(r'alpha (\S+), (\d+) iterations', base.settings)
    assert (settings.aick.alpha, settings.aick.iterations) == (float(found[1]), int(found[2]))
    limit = re.search(r'at most (\d+)', base.settings)
    assert settings.features.max_keypoints == (int(limit[1]) if limit else 0)
    assert bool(settings.aick.vocabulary) == ('vocabulary' in words) == name.endswith('fast')
    if name.endswith('fast'):
        assert settings.aick.word_radius == float(re.search(r'R_w (\S+)', words)[1])
        assert settings.aick.vocabulary == f'{settings.features.detector}-1000'
        assert '1,000 words' in words


@pytest.mark.parametrize('name', ['gicp', 'ndt', 'gicp-tuned', 'ndt-tuned'])
def test_words_and_arguments_of_the_point_cloud_library_agree(name):
    method = METHODS[name]
    kind, *arguments = method.options['arguments']
    assert kind == name.partition('-')[0]
    assert kind.upper() in method.title
    numbers = re.findall(r'\d+\.?\d*', method.settings.replace('3D', ''))
    depth = method.options['max_depth']
    assert depth == (4.0 if 'tuned' in name else 10.0)
    if 'tuned' in name:
        assert float(numbers.pop()) == depth
    said = sorted(map(float, numbers))
    given = sorted(float(argument) for argument in arguments[:-1] if float(argument) > 0)
    assert said == given


@pytest.mark.parametrize('name, phrases', [
    ('pnp', {'reprojection': r'within (\S+) px'}),
    ('small-gicp', {'voxel': r'voxels of (\S+) m', 'neighbours': r'(\d+) neighbours',
                    'max_distance': r'pairs within (\S+) m', 'max_depth': r'depth to (\S+) m'})])
def test_words_and_options_agree(name, phrases):
    method = METHODS[name]
    for option, phrase in phrases.items():
        assert method.options[option] == float(re.search(phrase, method.settings)[1])


@pytest.mark.parametrize('name, module', [
    ('ransac3', 'scipy'), ('ransac3-orb', 'scipy'), ('small-gicp', 'small_gicp'),
    ('open3d-hybrid', 'open3d'), ('open3d-plane', 'open3d')])
def test_what_a_method_needs_is_what_it_imports(monkeypatch, name, module):
    asked = []
    monkeypatch.setattr(registry.importlib.util, 'find_spec', lambda each: asked.append(each))
    assert METHODS[name].missing == "pip install '.[baselines]' in the folder of aick_ros"
    assert asked == [module]


def test_what_is_missing_is_installed_in_one_command():
    method = Method('x', 'X', '', '', needs=(
        Need(lambda: False, 'pip install a'), Need(lambda: True, 'pip install b'),
        Need(lambda: False, 'make c')))
    assert method.missing == 'pip install a && make c'
    assert Method('x', 'X', '', '').missing == ''


def test_opencv_5_is_needed_where_there_is_no_odometry(monkeypatch):
    names = 'opencv-depth', 'opencv-rgbd'
    if hasattr(cv2, 'Odometry'):
        assert [METHODS[name].missing for name in names] == ['', '']
    monkeypatch.delattr(cv2, 'Odometry', raising=False)
    assert [METHODS[name].missing for name in names] == 2 * [
        "pip install 'opencv-python-headless>=5'"]


def test_a_method_is_called_by_its_name_in_the_table():
    assert all(name == method.name for name, method in METHODS.items())
    assert len({method.title for method in METHODS.values()}) == len(METHODS)


def test_the_identity_is_that_of_the_options_in_any_order():
    one, other = (Method('x', title, '', 'm:C', options) for title, options in (
        ('X', {'a': 1, 'b': [2]}), ('Y', {'b': [2], 'a': 1})))
    assert one.identity == other.identity
    assert Method('x', 'X', '', 'm:D', one.options).identity != one.identity
    assert Method('x', 'X', '', 'm:C', {'a': 1, 'b': [3]}).identity != one.identity


def test_changes_have_dots_for_underscores_and_factories_get_the_options():
    method = aick('x', 'X', 'words', 'paper-fast', features__orb__levels=3, aick__alpha=0.5)
    assert method.options == {'preset_name': 'paper-fast',
                              'changes': {'features.orb.levels': 3, 'aick.alpha': 0.5}}
    assert str(make('fractions:Fraction', {'numerator': 1, 'denominator': 3})) == '1/3'
