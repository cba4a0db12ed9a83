# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How often servers are asked again, and after which pauses."""

import pytest

from aick_ros.cli.fleet import attempts
from aick_ros.cli.fleet.attempts import asked_again
from aick_ros.cli.fleet.pace import SilentServerError
from aick_ros.errors import InputError, TransferError


@pytest.fixture
def pauses(monkeypatch):
    pauses = []
    monkeypatch.setattr(attempts.time, 'sleep', pauses.append)
    return pauses


def failing(*errors):
    """Return a function that raises these, one at a call, and then returns what it is given."""
    rest = iter(errors)

    @asked_again
    def ask(*args, **kwargs):
        for error in rest:
            raise error
        return args, kwargs
    return ask


@pytest.mark.parametrize('failures, waited', [(0, []), (1, [1.0]), (2, [1.0, 2.0])])
def test_an_answer_at_last_is_returned(pauses, failures, waited):
    assert failing(*failures * [TransferError('x')])(1, two=2) == ((1,), {'two': 2})
    assert pauses == waited


def test_the_third_error_is_raised(pauses):
    with pytest.raises(TransferError, match='third'):
        failing(*map(TransferError, ('first', 'second', 'third')))()
    assert pauses == [1.0, 2.0]


def test_what_is_wrong_for_good_is_not_asked_again(pauses):
    with pytest.raises(InputError, match='wrong'):
        failing(TransferError('x'), InputError('wrong'))()
    assert pauses == [1.0]


def test_a_server_that_was_waited_for_is_not_asked_again(pauses):
    with pytest.raises(SilentServerError, match='second'):
        failing(TransferError('first'), SilentServerError('second'), TransferError('third'))()
    assert pauses == [1.0]
