# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Damage of inputs at random, repeatable by its seed."""

from __future__ import annotations

import random
import re
import struct
from collections.abc import Sequence

_NUMBERS = (0, 1, -1, 2, 3, 7, 8, 64, 127, 128, 255, 256, 999_999_999, 10 ** 9, 2 ** 15 - 1,
            2 ** 15, 2 ** 16 - 1, 2 ** 16, 2 ** 24, 2 ** 31 - 1, -2 ** 31, 2 ** 32 - 1,
            2 ** 63 - 1, -2 ** 63, 2 ** 64 - 1)
_FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-300, 5e-324, 1e9, 1e38, 1e150, 1e300, float('inf'),
           float('-inf'), float('nan'))
_WORDS = (b'nan', b'inf', b'-inf', b'1e300', b'1e-300', b'-1', b'0', b'.', b'1e400', b'0x10',
          b'9' * 30, b'9' * 400, b'null', b'~', b'true', b'[]', b'{}', b'""', b'*a', b'&a',
          b'!!python/object:os.system', b'2001-99-99', b'1:60:60', b'\xff\xfe', b'\x00',
          b'\xe2\x80\xae', b'\x1b[31m', b'\n', b'- ', b': ', b'#', b'%', b'---\n', b'!!binary ')
_NUMBER_IN_TEXT = re.compile(rb'[-+.0-9][-+.0-9e]*')
_LONGEST = 300_000  # bytes of a damaged input


class Mutator:
    """Draws damaged versions of inputs."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._ways = (self._bit, self._byte, self._integer, self._float, self._delete,
                      self._repeat, self._insert, self._cut, self._move, self._word,
                      self._text_number)

    def mutate(self, data: bytes, others: Sequence[bytes]) -> bytes:
        """Return data with one to eight kinds of damage, or joined with a part of another."""
        damaged = bytearray(data)
        if self._rng.random() < 0.1:
            other = self._rng.choice(others)
            damaged[self._place(damaged):] = other[self._place(other):]
        while True:
            self._rng.choice(self._ways)(damaged)
            if self._rng.random() < 0.4:
                return bytes(damaged[:_LONGEST])

    def _place(self, data: bytes | bytearray) -> int:
        """Return a position; the beginning, where headers are, is the likeliest."""
        limit = len(data) if self._rng.random() < 0.6 else min(len(data), 64)
        return self._rng.randint(0, limit)

    def _bit(self, data: bytearray) -> None:
        place = self._place(data)
        if place < len(data):
            data[place] ^= 1 << self._rng.randrange(8)

    def _byte(self, data: bytearray) -> None:
        place = self._place(data)
        data[place:place + 1] = bytes([self._rng.randrange(256)])

    def _integer(self, data: bytearray) -> None:
        size, order = self._rng.choice((1, 2, 4, 8)), self._rng.choice(('little', 'big'))
        number = self._rng.choice(_NUMBERS) % 256 ** size
        self._overwrite(data, number.to_bytes(size, order))

    def _float(self, data: bytearray) -> None:
        number = self._rng.choice(_FLOATS)
        kind = self._rng.choice('fd' if abs(number) < 1e38 or number in _FLOATS[-3:-1] else 'd')
        self._overwrite(data, struct.pack(f'<{kind}', number))

    def _overwrite(self, data: bytearray, value: bytes) -> None:
        place = self._place(data)
        if self._rng.random() < 0.7:
            place -= place % len(value)
        data[place:place + len(value)] = value

    def _delete(self, data: bytearray) -> None:
        place = self._place(data)
        del data[place:place + self._length()]

    def _repeat(self, data: bytearray) -> None:
        place = self._place(data)
        data[place:place] = data[place:place + self._length()] * self._rng.choice((1, 1, 2, 50))

    def _insert(self, data: bytearray) -> None:
        place = self._place(data)
        data[place:place] = self._rng.randbytes(self._length())

    def _cut(self, data: bytearray) -> None:
        del data[self._place(data):]

    def _move(self, data: bytearray) -> None:
        place, length = self._place(data), self._length()
        part = data[place:place + length]
        del data[place:place + length]
        place = self._place(data)
        data[place:place] = part

    def _word(self, data: bytearray) -> None:
        place = self._place(data)
        data[place:place + self._rng.choice((0, 1, 4))] = self._rng.choice(_WORDS)

    def _text_number(self, data: bytearray) -> None:
        numbers = list(_NUMBER_IN_TEXT.finditer(data[:4000]))
        if numbers:
            start, end = self._rng.choice(numbers).span()
            data[start:end] = self._rng.choice(
                (*_WORDS, str(self._rng.choice(_NUMBERS)).encode()))

    def _length(self) -> int:
        return self._rng.choice((1, 1, 2, 4, 8, 16, 64, 512))
