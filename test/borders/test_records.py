# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Records with other values, against dataclasses.replace."""

import dataclasses
from functools import cached_property

import pytest

from aick_ros.borders.records import replaced


@dataclasses.dataclass(frozen=True)
class Box:
    width: int
    height: int = 2
    names: list = dataclasses.field(default_factory=list)

    @cached_property
    def area(self):
        return self.width * self.height


class Crate(Box):
    pass


@pytest.mark.parametrize('kind', [Box, Crate])
@pytest.mark.parametrize('changes', [{}, {'width': 5}, {'height': 7, 'names': ['a']}])
def test_it_is_what_dataclasses_replace_returns(kind, changes):
    before = kind(3)
    after = replaced(before, **changes)
    assert after == dataclasses.replace(before, **changes) and type(after) is kind
    assert after is not before and before == kind(3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        after.width = 1


def test_what_was_computed_of_the_other_values_is_not_kept():
    before = Box(3)
    assert before.area == 6
    assert replaced(before, width=5).area == 10 and before.area == 6
