# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Of damaged images the codecs print nothing, and everything else is printed."""

import sys

import cv2
import numpy as np
import pytest

from aick_ros.cli.input.codec_messages import codecs_silenced
from aick_ros.cli.input.read_ahead import read_ahead
from aick_ros.errors import InputError
from aick_ros.messages.png_jpeg import decode


@pytest.fixture(scope='module')
def damaged():
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    content = cv2.imencode('.jpg', image)[1].tobytes()
    return content[:len(content) // 2] + b'\xff\xd9'


class Source:
    def __init__(self, content):
        self._content = content

    def frames(self, on_damaged):
        decode(self._content)
        on_damaged(InputError('damaged'))
        return iter(())


def test_only_the_block_is_silent(damaged, capfd):
    decode(damaged)
    assert 'Corrupt JPEG data' in capfd.readouterr().err  # what must be silenced
    for _ in range(2):
        with codecs_silenced():
            decode(damaged)
            print('a sentence', file=sys.stderr)
        assert capfd.readouterr().err == 'a sentence\n'
        decode(damaged)
        assert 'Corrupt JPEG data' in capfd.readouterr().err


def test_blocks_overlap(damaged, capfd):
    """As those of two threads do: the first to begin is the first to end."""
    first, second = codecs_silenced(), codecs_silenced()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    decode(damaged)
    assert capfd.readouterr().err == ''
    second.__exit__(None, None, None)
    decode(damaged)
    assert 'Corrupt JPEG data' in capfd.readouterr().err


def test_reading_is_silent(damaged, capfd):
    errors = []
    assert list(read_ahead(Source(damaged), errors.append)) == []
    assert [str(error) for error in errors] == ['damaged']
    assert capfd.readouterr().err == ''
