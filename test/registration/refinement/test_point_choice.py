# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which points are taken, by residuals whose variances are known."""

import dataclasses

import numpy as np
import pytest

from aick_ros.registration.refinement.point_choice import PointChoice, log_ratio
from aick_ros.registration.refinement.residuals import PlaneResiduals

RARE, COMMON, BETWEEN = (0.6, 0.0, 0.8), (0.0, 0.0, 1.0), (0.0, 0.6, 0.8)


class Target:
    """A surface whose cells face three ways, a few of them the first way."""

    def __init__(self):
        self.given = []

    def shares_facing(self, normals):
        self.given.append(normals)
        return np.select([normals @ way > 0.99 for way in (RARE, COMMON, BETWEEN)],
                         [0.039, 0.061, 0.05])


def residuals(rare, common, noise=0.5, blocks=30, in_block=20, seed=0):
    """Return residuals with standard deviations between blocks, and of single ones beside."""
    rng = np.random.default_rng(seed)
    values, numbers, directions = [], [], []
    for sigma, way in ((rare, RARE), (common, COMMON), (9.0, BETWEEN)):
        errors = sigma * rng.standard_normal(blocks)
        values.append(np.repeat(errors, in_block) + noise * rng.standard_normal(blocks * in_block))
        numbers.append(np.repeat(3 * np.arange(blocks), in_block))
        directions.append(np.outer(rng.uniform(1.0, 300.0, blocks * in_block), way))
    values, numbers, directions = map(np.concatenate, (values, numbers, directions))
    return PlaneResiduals(values, np.zeros((len(values), 6)), np.ones(len(values)), numbers,
                          np.zeros((len(values), 3)), directions)


def shown(*sigmas, **values):
    """Return the mean of the logarithms that some registrations show."""
    found = [log_ratio(residuals(*sigmas, **values, seed=seed), Target()) for seed in range(20)]
    return np.mean(found)


@pytest.mark.parametrize('rare, common', [(0.4, 0.2), (0.3, 0.3), (0.2, 0.4)])
@pytest.mark.parametrize('noise', [0.02, 0.5])
def test_it_is_the_ratio_of_the_variances_between_blocks_whatever_single_points_have(
        rare, common, noise):
    assert shown(rare, common, noise=noise) == pytest.approx(2 * np.log(rare / common), abs=0.25)


def test_the_planes_are_looked_up_by_their_normals():
    target = Target()
    log_ratio(residuals(0.1, 0.1), target)
    normals, = target.given
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_a_few_blocks_far_off_hide_nothing():
    """As those of an object that moves."""
    seen = residuals(0.2, 0.2)
    values = seen.values.copy()
    values[:3 * 20] += 20.0  # three blocks of the rare planes
    found = log_ratio(dataclasses.replace(seen, values=values), Target())
    assert found == pytest.approx(log_ratio(seen, Target()), abs=0.7)


@pytest.mark.parametrize('rare, common, expected', [(9.0, 1e-3, 3.0), (1e-3, 9.0, -3.0)])
def test_one_registration_shows_no_more_than_a_bound(rare, common, expected):
    assert log_ratio(residuals(rare, common, noise=0.1), Target()) == expected


@pytest.mark.parametrize('rare, common, expected', [
    (1.0, 0.0, 3.0), (0.0, 1.0, -3.0), (0.0, 0.0, 0.0)])
def test_single_points_may_explain_all_there_is(rare, common, expected):
    """Blocks whose means are all the same differ by less than the noise lets expect."""
    seen = residuals(rare, common, noise=0.0)
    apart = np.tile([0.1, -0.1], len(seen.values) // 2)
    values = seen.values + apart
    assert log_ratio(dataclasses.replace(seen, values=values), Target()) == expected


@pytest.mark.parametrize('values', [
    {'blocks': 3}, {'blocks': 4, 'in_block': 4}, {'in_block': 4}])
def test_few_points_or_blocks_show_nothing(values):
    assert log_ratio(residuals(0.3, 0.1, **values), Target()) is None
    assert log_ratio(residuals(0.3, 0.1, blocks=4, in_block=5), Target()) is not None


def test_planes_of_one_kind_alone_show_nothing():
    seen = residuals(0.3, 0.1)
    for way in (RARE, COMMON):
        kept = seen.directions @ way / np.linalg.norm(seen.directions, axis=1) < 0.99
        part = dataclasses.replace(seen, **{
            name: getattr(seen, name)[kept]
            for name in ('values', 'jacobian', 'weights', 'blocks', 'points', 'directions')})
        assert log_ratio(part, Target()) is None


@dataclasses.dataclass
class Surface:
    even: str = 'points all over it'


@pytest.mark.parametrize('logarithm, count', [(3.0, 4), (1.6, 9), (1.0, 31)])
def test_points_are_spread_evenly_once_small_surfaces_have_erred_more(logarithm, count):
    """The mean is that of ten more registrations, which show no difference."""
    points, surface = PointChoice(), Surface()
    for _ in range(count - 1):
        points.learn(logarithm)
    assert not points.is_even and points.of(surface) is surface
    points.learn(logarithm)
    assert points.is_even and points.of(surface) is surface.even


def test_registrations_are_looked_at_until_much_is_known_and_then_one_of_four():
    points, seen, target = PointChoice(), residuals(0.3, 0.1), Target()
    shown = [points.shown_by(seen, target) for _ in range(60)]
    expected = log_ratio(seen, target)
    assert shown[:40] == [expected] * 40
    assert shown[40:] == 5 * [None, None, None, expected]
    for _ in range(4):  # points are spread now: all is looked at again
        points.learn(3.0)
    assert [points.shown_by(seen, target) for _ in range(40)] == [expected] * 40


def test_points_are_balanced_again_once_large_surfaces_have_erred_more():
    points = PointChoice()
    for _ in range(4):
        points.learn(3.0)
    for _ in range(10):
        points.learn(-1.0)
    assert points.is_even
    points.learn(-1.0)
    assert not points.is_even
    for _ in range(3):  # what was learned before the change counts no more
        points.learn(3.0)
    assert not points.is_even


@pytest.mark.parametrize('logarithm', [0.74, -3.0])
def test_points_stay_balanced_where_small_surfaces_err_little_more_or_less(logarithm):
    points = PointChoice()
    for _ in range(300):
        points.learn(logarithm)
    assert not points.is_even


def test_points_stay_spread_where_both_err_alike():
    points = PointChoice()
    for shown in [3.0] * 4 + [-0.49] * 300:
        points.learn(shown)
    assert points.is_even


def test_what_was_long_ago_is_forgotten():
    points = PointChoice()
    for shown in [-3.0] * 300 + [2.0] * 80:
        points.learn(shown)
    assert not points.is_even
    for _ in range(30):
        points.learn(2.0)
    assert points.is_even
