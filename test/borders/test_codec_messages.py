# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Of damaged images the codecs print nothing, and everything else is printed."""

import subprocess
import sys

import pytest

PREPARED = """
import sys
import cv2
import numpy as np
from aick_ros.borders.codec_messages import codecs_silenced
from aick_ros.borders.encoded_image import decode

image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
content = cv2.imencode('.jpg', image)[1].tobytes()
damaged = content[:len(content) // 2] + bytes([255, 217])

def codec():
    cv2.imdecode(np.frombuffer(damaged, np.uint8), cv2.IMREAD_UNCHANGED)

def say(text):
    print(text, file=sys.stderr, flush=True)
"""
CODEC = 'Corrupt JPEG data'


def printed(program):
    """Return what a process of its own prints, as the stream is that of the whole process."""
    run = subprocess.run([sys.executable, '-c', PREPARED + program], capture_output=True,
                         text=True, check=True)
    return [CODEC if CODEC in line else line for line in run.stderr.splitlines()]


def test_only_the_block_is_silent():
    assert printed("""
codec()  # what must be silenced
for _ in range(2):
    with codecs_silenced():
        codec()
        say('a sentence')
    codec()
""") == [CODEC, 'a sentence', CODEC, 'a sentence', CODEC]


def test_blocks_overlap():
    """As those of two threads do: the first to begin is the first to end."""
    assert printed("""
first, second = codecs_silenced(), codecs_silenced()
first.__enter__()
second.__enter__()
first.__exit__(None, None, None)
codec()
say('within the second')
second.__exit__(None, None, None)
codec()
""") == ['within the second', CODEC]


def test_decoding_is_silent():
    assert printed("""
assert decode(damaged).shape == image.shape
codec()
""") == [CODEC]


def test_the_log_of_ros_is_not_silenced():
    pytest.importorskip('rclpy')
    [line] = printed("""
from rclpy.logging import get_logger
get_logger('name').info('before')
with codecs_silenced():
    get_logger('name').warning('within')
    codec()
""")[1:]
    assert 'within' in line
