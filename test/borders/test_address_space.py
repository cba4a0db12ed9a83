# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Memory that is limited too far is told before libraries abort."""

import re
import resource

import pytest

from aick_ros.borders.address_space import check_address_space
from aick_ros.errors import InputError


@pytest.mark.parametrize('limited, allowed, sentence', [
    *((kind, resource.RLIM_INFINITY, '') for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)),
    (resource.RLIMIT_AS, 10 ** 9, ''), (resource.RLIMIT_DATA, 5 * 10 ** 8, ''),
    (resource.RLIMIT_AS, 999_999_999,
     'limited to 999 MB (ulimit -v), libraries require 1000 MB: raise the limit'),
    (resource.RLIMIT_DATA, 499_999_999,
     'limited to 499 MB (ulimit -d), libraries require 500 MB: raise the limit')])
def test_too_little_is_rejected_with_both_numbers(monkeypatch, limited, allowed, sentence):
    others = {resource.RLIMIT_AS: resource.RLIM_INFINITY, resource.RLIMIT_DATA: 10 ** 9}
    monkeypatch.setattr(resource, 'getrlimit', lambda kind: (
        allowed if kind == limited else others.get(kind, 64), resource.RLIM_INFINITY))
    if not sentence:
        check_address_space(10 ** 9, 'libraries')
    else:
        with pytest.raises(InputError, match=re.escape(sentence) + '$'):
            check_address_space(10 ** 9, 'libraries')
