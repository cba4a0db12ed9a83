# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Calls of the compiled kernels, with arguments that fit or not, from bytes.

A kernel reads and writes its arrays and nothing else: each lies beside a page that must not be
touched, and those that are read are compared with what they were.
"""

from __future__ import annotations

import ctypes
import mmap
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from aick_ros import kernels
from aick_ros.errors import InputError

# An array is TYPE:SIZES, TYPE>SIZES where it is written; %NAME is a size as an integer, %i any
# integer, %f any number.
_CALLS = """
agreeing_tracks d:n,3 d:n,2 d:4,4 %f
align_windows B:x,y B:x,y %z %w %f %f f:n,2 d:n,4 f>n,2 ?>n
bias_since d:6 d:6,6 d:6,6 d:6 d:6,6 d:3 %f d:3,3 d>6 d>6,6 d>6,6
biased_increment d:6 d:6,6 d:6,6 d:6 %f d:6,6 %f %f %f %f d>6,6
bit_distances B:n,w B:m,w %w f>n,m
bit_distances_of_pairs B:n,w B:m,w %w q:k q:k f>k
cells_at d:n,3 ?:h,v %v %h d:4 q>n q>n
choose_cells q:n B:n q:k %i ?>n
closest_pairs f:n,4 f:m,4 q:2,k f:k %f %f %f q>n,2
composed_poses d:4,4 d:6,6 d:4,4 d:6,6 d>4,4 d>6,6
corners B:h,v %b %i %i %i
corrected_tracks f:h,v %f %f %f d:28 d:3,6 %f d:3,6 %f %f %f %f d:4,4 d:n,3 d:n,2 d>n,3 d>n,2
depth_equations d:n,3 d:n,3 d:n,6 d:n d:n %z d:4,4 d:2,6 d:28 d:28 %a %e d:a,e d:a,e \
 d>u,u d>2,u
derivative_squares B:h,v
describe_points B>x,y %z f:4,256 %i f:n,2 d:n B>n,32
disc_directions B:h,v %b q:r f:n,2 d>n
edge_distances d:n,3 d:n,2 d:4,4 d:4 q:h,v q:m,2 d:m d:m,2 %f %f %f d>n d>n,6 q>n
eliminate d:u,u d:k,u d:6,6 d>l,l d>k,l
estimate d:n,6 d:n d:n q:n d:m,6 d:m d:m q:m d:6,6 %f d:6,6 d:6,6 %f d>6 d>6,6 \
 d>6,6 d>6,6 d>6,6 d>6 d>6,6
exp_pose d:6 d>4,4
exp_rotation d:3 d>3,3
fit_moments d:4,4 %f %f d>4,4
fit_planes f:h,v d:4 f>c,3 f>c,3 f>c f>c
gradient_moments B:h,v d:n,2 %i d>n,3,3
gradient_noise d:n,6 d:n d:n q:n d>6,6
halve B:x,y %z B>i,j
integrate_forces q:n d:n,3 %i %i d:3,3 d:3,3 d>2,12
integrate_turns q:n d:n,3 d>n,3,3 d>n,3,3 d>n,3,3,3
interpolate f:h,v f:n f:n f>n
inverse_pose d:4,4 d>4,4
inverted_warps d:n,2,2 d>n,2,2
is_rigid d:4,4
jackknife d:2,u,u d:2,u d:u,u d:u q:k d>u d>2,u
joint_estimate d:6,6 d:6 d:6,6 %f d:6,6 d:6 d:6,6 %f d:6,6 %f d:6,6 d:4,4 d>4,4 d>6,6 d>6,6
kalman_measurement d:n d:n,n d:k,n d:k,k d:k %f d>n d>n,n
kalman_update d:n,n d:k,n d:k,k d>k,k d>n,k d>n,n d>n,n
is_valid_depth f:h,v %f %f
keypoint_equations d:n,3 q:k q:k f:m,3 d:2,n,6 d:2,n d:2,n %f d:4,4 d:2,6 d:28 d:28 %f \
 d>u,u d>u
log_pose d:4,4 d>6
log_rotation d:3,3 d>3
mean_displacement d:n,3 d:n,2
mean_inverse_depths f:h,v %w %f %f f>a,e
moments f:n,3 f:m,3 q:k,2 d>4,4
nearer_beside f:h,v d:n,2 d:n %i %f %f d>n
nodes_around d:n,3 d:28 %a %e q>n,4 d>n,4
normal_buckets f:n,3 ?:n %w B>n q>s
normal_equations d:n,6 d:n d:n d>6,6 d>6
normalize d:n,2 d:28 d>n,2
pairs_of_near_points f:n,4 f:m,4 %f
pairs_of_similar_bits B:n,w B:m,w %w %f
perturbed_pose d:4,4 d:6 d>4,4
point_to_plane f:m,3 q:n f:m,3 f:m d:3,6 %f d:4,4 %f d:3,6 %f %f f:h,v,3 f:h,v,3 ?:h,v f:h,v \
 %v %h d:4 d:2 d:3 %f %f %f %f d>n d>n,6 d>n d>n,3 d>n,3 q>n d>2,6,6
pose_difference d:4,4 d:4,4 d>6
predict_gravity d:16 d:16,16 %f d:3 d:3 d:3,3 d:3,3 d:3 d:3 d:3,3 %f %f d>16 d>16,16
project d:n,3 d:28 d>n,2
propagated_covariance d:n,n d:n,n d:n,k d:k,k d>n,n
relative_pose d:4,4 d:6,6 d:4,4 d:6,6 %f d>4,4 d>6,6
reprojection d:n,3 d:n,2 d:n d:4,4 %f d:3 d:2 d>2,n d>2,n,6 d>2,n q>2,n
reversed_tracks q:n d:n,3 d:n,2 d:n d:n d:2 q>n d>n,3 d>n,2 d>n d>n
sample_depth f:h,v d:n,2 %f %f %f d>n
shrink B:h,v B>h,v
smooth_cells f:c,3 f:h,v f:c d:2 %f %f %f %f %f ?>c
solve_definite d:n,n d>n,k %k
spread d:n,2 %f q>k
stamp_errors d:4,4 d:6 d:6 d:2 %f %f %f d>6,6
to_quaternion d:3,3 d>4
track_depth d:n,3 d:n,2 d:n d:4,4 d:2 d:3 d>n d>n,6 d>n q>n
track_steps d:n,3 d:n,2 d:n d:n d:4,4 %f d:2 d:k d:3 d:3 d:2 %f d:6,6 d:6 d>6 d>4,4
transform d:4,4 d:n,3 d>n,3
undistort_depth f:h,v d:n,k %f f>h,v
valid_depth f:h,v %f %f f>h,v
visible d:n,3 d:4,4 d:28 %f q>n f>n,2
window_reliefs B:h,v f:h,v d:n,2 d:n %i d:2 %f %f d>n,3 d>n,3 d>n,2
window_shifts d:n,3 d:4,4 %f %f d:n,2,2 d:n,3,3 d:n,3 %f %f d>n,2
window_warps d:n,3 d:4,4 %f %f d:n,2 %f d>n,2,2
""".replace('\\\n', '')
CALLS: dict[str, list[str]] = {line.split()[0]: line.split()[1:]
                               for line in _CALLS.strip().split('\n')}
"""Name of a kernel -> its arguments."""

_SIZES = {'n': (3, 0, 1, 2, 8, 17, 33), 'm': (4, 0, 1, 5, 16), 'k': (5, 0, 1, 2, 40),
          'w': (4, 1, 3, 8, 32, 33), 'h': (40, 1, 2, 7, 11, 24), 'v': (47, 1, 2, 5, 12, 32),
          'a': (3, 1, 2, 6), 'e': (2, 1, 4, 8), 'r': (3, 1, 2, 9), 'b': (12, 5, 6, 8),
          'x': (50, 49, 55, 98, 120), 'y': (51, 49, 60, 99, 160), 'z': (24, 17, 19, 48)}
_INTEGERS = (3, 0, 1, 2, 7, 12, 100, -1, -2, 255, 256, 2 ** 16, 2 ** 31 - 1, 2 ** 31, -2 ** 31,
             2 ** 32, 2 ** 33 - 1, 2 ** 61, 2 ** 62, 2 ** 63 - 1, -2 ** 63, 2 ** 64)
_NUMBERS = (1.0, 0.5, 0.0, -1.0, 2.0, 1e-3, 100.0, 1e9, -1e19, 1e38, 1e300, -1e300, 5e-324,
            float('inf'), float('-inf'), float('nan'))
_AREA = 2 ** 16  # bytes between two guard pages
_REFUSED = TypeError, ValueError, BufferError, OverflowError


class _Choices:
    """Choices that bytes stand for; the first of each where they are used up."""

    def __init__(self, data: bytes) -> None:
        self._data, self._next = data, 0

    def among(self, count: int) -> int:
        """Return a number below a count, up to 256."""
        self._next += 1
        return self._data[self._next - 1] % count if self._next <= len(self._data) else 0

    def one(self, values: Any) -> Any:
        """Return one of some values."""
        return values[self.among(len(values))]


def call_kernel(data: bytes, _: Path) -> None:
    """Call a kernel with arguments, one or two of them odd or none."""
    choices = _Choices(data)
    name = choices.one(list(CALLS))
    specs, sizes = CALLS[name], {key: choices.one(values) for key, values in _SIZES.items()}
    sizes |= {'c': sizes['h'] * sizes['v'], 's': sizes['w'] ** 2,
              'u': 14 + sizes['a'] * sizes['e'], 'l': 8 + sizes['a'] * sizes['e'],
              **{half: max((sizes[side] + 2 * sizes['z'] + 1) // 2, 1)
                 for side, half in zip('xy', 'ij')}}
    arguments = [_argument(spec, sizes, choices, area) for area, spec in enumerate(specs)]
    for _ in range(choices.among(3)):
        place = choices.among(len(arguments))
        odd = choices.one(_ODD if _is_array(arguments[place]) else _ODD_NUMBERS)
        arguments[place] = odd(arguments, place, choices)
    kept = [argument.tobytes() if _is_read(spec, argument) and not _is_shared(arguments, place)
            else None for place, (spec, argument) in enumerate(zip(specs, arguments))]
    try:
        getattr(kernels, name)(*arguments)
    except _REFUSED as error:
        raise InputError(str(error)) from error
    for spec, argument, before in zip(specs, arguments, kept):
        if before is not None and argument.tobytes() != before:
            raise AssertionError(f'{name} changed {spec}, which it is to read')


def _is_array(argument: Any) -> bool:
    return isinstance(argument, np.ndarray) and argument.dtype.kind in 'fibu'


def _is_read(spec: str, argument: Any) -> bool:
    return ':' in spec and isinstance(argument, np.ndarray)


def _is_shared(arguments: list[Any], place: int) -> bool:
    return any(isinstance(other, np.ndarray) and np.may_share_memory(arguments[place], other)
               for i, other in enumerate(arguments) if i != place)


def _argument(spec: str, sizes: dict[str, int], choices: _Choices, area: int) -> Any:
    """Return what a specification asks for."""
    if spec == '%f':
        return choices.one(_NUMBERS)
    if spec == '%i':
        return choices.one(_INTEGERS)
    if spec[0] == '%':
        return sizes[spec[1]]
    shape = [int(size) if size.isdigit() else sizes[size] for size in spec[2:].split(',')]
    return _fenced(_filled(np.dtype(spec[0]), shape, choices), area, choices.among(2) == 1)


def _filled(kind: np.dtype, shape: list[int], choices: _Choices) -> np.ndarray:
    """Return an array of ordinary or odd numbers."""
    rng = np.random.default_rng(choices.among(256))
    is_odd = choices.among(4) == 3
    if kind.kind == 'f':
        array = rng.normal(0.5, 1.0, shape) * choices.one((1.0, 20.0, 1e-3))
        array = abs(array) if choices.among(2) else array
        odd = np.array(_NUMBERS)
    else:
        array = rng.integers(0, choices.one((2, 3, 16, 256)), shape)
        odd = np.array([number for number in _INTEGERS if abs(number) < 2 ** 63])
    if is_odd:
        array = np.where(rng.random(shape) < 0.3, rng.choice(odd, shape), array)
    with np.errstate(all='ignore'):
        return array.astype(kind)


def _fenced(array: np.ndarray, area: int, is_first: bool) -> np.ndarray:
    """Return a copy between pages that must not be touched, beside one of them."""
    memory = _areas()[area]
    start = 0 if is_first else _AREA - array.nbytes
    place = memory[start:start + array.nbytes].view(array.dtype).reshape(array.shape)
    place[...] = array
    return place


@cache
def _areas() -> list[np.ndarray]:
    """Return memory for each argument, between guard pages."""
    libc, page, areas = ctypes.CDLL(None, use_errno=True), mmap.PAGESIZE, []
    for _ in range(max(map(len, CALLS.values()))):
        memory = np.frombuffer(mmap.mmap(-1, _AREA + 2 * page), np.uint8)
        for start in (0, _AREA + page):
            address = ctypes.c_void_p(memory.ctypes.data + start)
            if libc.mprotect(address, ctypes.c_size_t(page), 0):
                raise OSError(ctypes.get_errno(), 'no guard page')
        areas.append(memory[page:_AREA + page])
    return areas


# Odd arguments: functions of all arguments, the place of one, and choices.

def _another_type(arguments: list[Any], place: int, choices: _Choices) -> Any:
    kind = choices.one(('f4', 'f8', '>f8', 'i8', 'u8', 'i4', 'u1', 'i1', '?', 'c16', 'O', 'f2'))
    with np.errstate(all='ignore'), warnings.catch_warnings():
        warnings.simplefilter('ignore')
        return arguments[place].astype(kind)


def _another_size(arguments: list[Any], place: int, choices: _Choices) -> Any:
    flat = arguments[place].ravel()
    shapes = ((0,), (0, 4), (0, 2 ** 28), (2 ** 29, 0), (2 ** 60 // flat.itemsize, 0), (2, 2, 2))
    return choices.one((flat, flat[1:], flat[:-1], flat[None], flat[:, None],
                        *(np.resize(flat, shape) if all(shape) else np.empty(shape, flat.dtype)
                          for shape in shapes)))


def _not_contiguous(arguments: list[Any], place: int, _: _Choices) -> Any:
    return np.repeat(arguments[place][None], 2, 0).T


def _read_only(arguments: list[Any], place: int, _: _Choices) -> Any:
    array = arguments[place].copy()
    array.flags.writeable = False
    return array


def _not_aligned(arguments: list[Any], place: int, _: _Choices) -> Any:
    array = arguments[place]
    kind = array.dtype.char if array.dtype.char in 'fdlB?' else 'd'
    return memoryview(bytearray(array.nbytes // 8 * 8 + 1))[1:].cast(kind)


def _of_another(arguments: list[Any], place: int, choices: _Choices) -> Any:
    return choices.one(arguments)


def _overlapping(arguments: list[Any], place: int, choices: _Choices) -> Any:
    array, other = arguments[place], choices.one(arguments)
    if not isinstance(other, np.ndarray):
        return other
    address = max(other.ctypes.data - 8, 0) // 8 * 8
    for memory in _areas():
        start = address - memory.ctypes.data
        if 0 <= start <= _AREA - array.nbytes:
            return memory[start:start + array.nbytes].view(array.dtype).reshape(array.shape)
    return other


class _Liar(np.ndarray):
    """An array that reports another length."""

    def __len__(self) -> int:
        return 2 ** 60 + self.size


def _lying(arguments: list[Any], place: int, _: _Choices) -> Any:
    return arguments[place].view(_Liar)


def _odd_number(arguments: list[Any], place: int, choices: _Choices) -> Any:
    return choices.one((*_INTEGERS, *_NUMBERS))


def _something_else(arguments: list[Any], place: int, choices: _Choices) -> Any:
    return choices.one((None, [], [1.0, 2.0], 'text', b'bytes', b'', {}, object(), np.float64(1),
                        np.array(1.0), np.array(None), range(3), bytearray(24), 1j))


_ODD: tuple[Callable[[list[Any], int, _Choices], Any], ...] = (
    _another_size, _another_type, _not_contiguous, _read_only, _not_aligned, _of_another,
    _overlapping, _lying, _something_else)
_ODD_NUMBERS = _odd_number, _odd_number, _something_else, _of_another
