# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The presets against the numbers of the paper (IV, V-A)."""

import pytest

from aick_ros.errors import InputError
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.settings.presets import PRESETS, preset


def test_presets_are_the_papers():
    full, fast = preset('paper-full'), preset('paper-fast')
    assert (full.aick.alpha, full.aick.iterations, full.features.max_keypoints) == (0.8, 25, 0)
    assert (fast.aick.alpha, fast.aick.iterations, fast.features.max_keypoints) == (0.6, 10, 350)
    for settings in (full, fast):
        assert (settings.aick.lambda_e, settings.aick.lambda_f) == (0.01, 0.2)
        assert settings.features.detector == 'orb'
        assert settings.features.cell_size == 0.0  # the strongest, wherever they are
        assert settings.features.orb == Settings().features.orb


def test_presets_of_surf_are_the_papers():
    full, fast = preset('paper-full-surf'), preset('paper-fast-surf')
    assert (full.aick.alpha, full.aick.iterations, full.features.max_keypoints) == (0.8, 25, 0)
    assert (fast.aick.alpha, fast.aick.iterations, fast.features.max_keypoints) == (0.3, 5, 200)
    for settings in (full, fast):
        assert (settings.aick.lambda_e, settings.aick.lambda_f) == (0.01, 0.2)
        assert settings.features.detector == 'surf'
        assert settings.features.cell_size == 0.0
        surf = settings.features.surf
        assert (surf.octaves, surf.intervals, surf.init_sample, surf.threshold) == (5, 5, 2, 1e-5)


def test_presets_with_words_are_those_without_them_otherwise():
    for name, detector in (('paper-fast', 'orb'), ('paper-fast-surf', 'surf')):
        with_words, without = preset(f'{name}-words'), preset(name)
        assert with_words.aick.vocabulary == f'{detector}-1000'
        assert with_values(with_words, {'aick.vocabulary': '',
                                        'aick.word_radius': without.aick.word_radius}) == without
    assert preset('paper-fast-surf-words').aick.word_radius == 0.26
    assert len(PRESETS) == 6


@pytest.mark.parametrize('name', PRESETS)
def test_a_preset_ends_as_the_paper_does(name):
    assert preset(name).refinement.mode == 'none'
    assert preset(name).odometry.reference == 'previous'


def test_unknown_preset_is_named_with_those_there_are():
    with pytest.raises(InputError, match='paper-full, paper-fast'):
        preset('paper')
