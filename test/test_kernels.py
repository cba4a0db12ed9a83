# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Arrays that do not fit are refused before a kernel touches them; results: beside its caller."""

import ast
import subprocess
import sys
import threading
import time
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from aick_ros import _kernels, kernels
from aick_ros.geometry.camera import Camera

ROOT = Path(__file__).parents[1]
POINTS = np.ones((3, 3))
CAMERA = Camera(640, 480, 500.0, 500.0, 320.0, 240.0).model


def project(points=POINTS, camera=CAMERA, pixels=None):
    pixels = np.zeros((len(points), 2)) if pixels is None else pixels
    kernels.project(points, camera, pixels)
    return pixels


def read_only(array):
    array.flags.writeable = False
    return array


@pytest.mark.parametrize('arguments, message', [
    ({'points': np.ones((3, 2))}, 'the points has 6 numbers: 9 are required'),
    ({'camera': np.ones(3)}, 'the camera has 3 numbers: 28 are required'),
    ({'camera': 'fx fy'}, 'the camera: Cannot cast array data'),
    ({'points': np.ones((3, 3), complex)}, 'the points: Cannot cast array data'),
    ({'pixels': np.ones((3, 2), np.float32)}, 'the pixels has numbers of type f: d is required'),
    ({'pixels': np.ones((3, 2), '>f8')}, 'type >d: d is required'),
    ({'pixels': np.ones((2, 2))}, 'the pixels has 4 numbers: 6 are required')])
def test_arrays_of_another_type_or_size_are_refused(arguments, message):
    with pytest.raises((TypeError, ValueError), match=message):
        project(**arguments)


@pytest.mark.parametrize('pixels', [
    np.zeros((3, 4))[:, :2], read_only(np.zeros((3, 2))), [[0.0, 0.0]] * 3])
def test_what_cannot_be_written_to_in_one_piece_is_refused(pixels):
    with pytest.raises((TypeError, ValueError, BufferError)):
        project(pixels=pixels)


@pytest.mark.parametrize('convert', [
    np.float32, np.int64, lambda points: points.astype('>f8'), np.asfortranarray,
    lambda points: np.repeat(points, 2, axis=1)[:, ::2], np.ndarray.tolist],
    ids=['float32', 'int64', 'big-endian', 'by column', 'strided', 'list'])
def test_numbers_that_are_read_alone_may_have_another_type_or_layout(convert):
    points = np.array([[1.0, 2.0, 4.0], [-3.0, 1.0, 2.0], [5.0, 0.0, 1.0]])
    expected = project(points)
    assert np.ptp(expected) > 1.0
    np.testing.assert_array_equal(project(convert(points), pixels=np.zeros((3, 2))), expected)


def test_whole_numbers_and_truth_values_are_not_converted():
    usable, found = np.ones(12, bool), [np.empty(3, np.int64) for _ in range(2)]
    with pytest.raises(TypeError, match=r'the usable cells has .* \? is required'):
        kernels.cells_at(POINTS, usable.astype(np.uint8), 4, 3, CAMERA[:4], *found)
    with pytest.raises(TypeError, match='q is required'):
        kernels.gradient_noise(np.ones((2, 6)), np.ones(2), np.ones(2), np.zeros(2, np.int32),
                               np.zeros((6, 6)))


def test_constants_of_another_kind_are_refused():
    noise, robustness, truncation = np.ones(2), np.ones(3), np.ones(2)
    found = np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.zeros(6, np.int64)
    with pytest.raises(ValueError, match='the robustness has 2 numbers: 3 are required'):
        kernels.reprojection(POINTS, np.ones((3, 2)), np.ones(3), np.eye(4), 1.0, truncation,
                             robustness, *found)
    with pytest.raises(ValueError, match='the noise of depth has 3 numbers: 2 are required'):
        kernels.track_depth(POINTS, np.ones((3, 2)), np.ones(3), np.eye(4), robustness, noise,
                            *(array[:3] for array in found))


def test_no_points_are_no_pixels():
    assert project(np.empty((0, 3))).shape == (0, 2)


@pytest.mark.parametrize('image', [np.ones(4, np.float32), np.ones((0, 4), np.float32),
                                   np.ones((2, 2, 2), np.float32)])
def test_an_image_has_rows_and_columns(image):
    with pytest.raises(ValueError, match='the image has no rows and columns'):
        kernels.sample_depth(image, np.ones((2, 2)), 0.1, 0.1, 10.0, np.zeros(2))


def test_windows_larger_than_the_image_are_refused():
    with pytest.raises(ValueError, match='larger than the image'):
        kernels.gradient_moments(np.zeros((8, 8), np.uint8), np.ones((1, 2)), 7, np.zeros((1, 9)))
    with pytest.raises(ValueError, match='larger than the image'):
        kernels.window_reliefs(np.zeros((8, 9), np.uint8), np.ones((9, 9), np.float32),
                               np.ones((1, 2)), np.ones(1), 7, np.ones(2), 0.1, 1.0,
                               np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 2)))
    with pytest.raises(ValueError, match='larger than the image'):
        kernels.window_reliefs(np.zeros((9, 9), np.uint8), np.ones((8, 9), np.float32),
                               np.ones((1, 2)), np.ones(1), 7, np.ones(2), 0.1, 1.0,
                               np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 2)))


def test_a_filled_image_of_another_size_is_refused():
    with pytest.raises(ValueError, match='not of the same size'):
        kernels.filled_depth(np.ones((4, 6), np.float32), np.ones((6, 4), np.float32))


@pytest.mark.parametrize('block', [-1, 1 << 20, np.iinfo(np.int64).max])
def test_blocks_out_of_range_are_refused(block):
    good, bad = ((np.ones((2, 6)), np.ones(2), np.ones(2), np.array([0, last]))
                 for last in (1, block))
    found = [np.zeros(6), *np.zeros((4, 6, 6)), np.zeros(6), np.zeros((6, 6))]
    with pytest.raises(ValueError, match='a block has a number out of range'):
        kernels.gradient_noise(*bad, np.zeros((6, 6)))
    for kinds in ((*bad, *good), (*good, *bad)):
        with pytest.raises(ValueError, match='a block has a number out of range'):
            kernels.estimate(*kinds, np.eye(6), 1.0, np.eye(6), np.eye(6), 0.5, *found)


def test_arrays_that_are_not_aligned_are_refused():
    points = memoryview(bytearray(9 * 8 + 1))[1:].cast('d', (3, 3))
    with pytest.raises(ValueError, match='the points is not aligned'):
        project(points=points)


@pytest.mark.parametrize('overlap', [1, 3, 6])
def test_an_array_that_is_written_shares_memory_with_no_other(overlap):
    memory = np.ones(36)
    with pytest.raises(ValueError, match='the twist and the result share memory'):
        kernels.exp_pose(memory[:6], memory[6 - overlap:22 - overlap])
    kernels.exp_pose(memory[:6], memory[6:22])
    project(points=memory[:9].reshape(3, 3), camera=memory[8:])  # both are read


class Liar(np.ndarray):
    """An array with a length of its own."""

    length = 2 ** 62

    def __len__(self):
        return self.length


@pytest.mark.parametrize('length', [2 ** 62, 2 ** 61 + 3, 2 ** 31])
def test_lengths_whose_products_overflow_are_refused(length):
    points = np.ones((3, 3)).view(Liar)
    points.length = length
    with pytest.raises(ValueError, match=f'{length} rows is too long'):
        project(points=points, pixels=np.zeros((3, 2)))


@pytest.mark.parametrize('width, height', [
    (2 ** 62, 4), (2 ** 32, 2 ** 32), (-4, -3), (2 ** 33 - 1, 2 ** 31), (-2 ** 31, 1)])
def test_grids_whose_product_overflows_are_refused(width, height):
    """The last two products are -2^31, which stands for any size."""
    shape = max(width * height % 2 ** 64, 0) % 2 ** 31
    with pytest.raises(ValueError, match='not the size of a grid'):
        kernels.cells_at(POINTS, np.ones((shape, 1), bool), width, height, CAMERA[:4],
                         np.zeros(3, np.int64), np.zeros(3, np.int64))


@pytest.mark.parametrize('index', [-1, 2, 2 ** 62])
def test_indices_out_of_range_are_refused(index):
    indices, inside = np.array([0, index]), np.zeros(2, np.int64)
    normals, pose, twists = np.ones((2, 3), np.float32), np.eye(4), np.ones((2, 6))
    for indices_and_cells in ((indices, inside), (inside, indices)):
        with pytest.raises(ValueError, match='not that of a point or of a cell'):
            kernels.keypoint_equations(
                np.ones((2, 3)), *indices_and_cells, normals, np.ones((2, 2, 6)), np.ones((2, 2)),
                np.ones((2, 2)), 1.0, pose, twists, CAMERA, CAMERA, 0.1, np.zeros((18, 18)),
                np.zeros(18))
    with pytest.raises(ValueError, match='not one of the source'):
        kernels.point_to_plane(
            np.ones((2, 3), np.float32), indices, normals, np.ones(2, np.float32),
            np.zeros((3, 6)), 1.0, pose, 1.0, np.zeros((3, 6)), 1.0, 1.0,
            *2 * [np.ones((4, 3), np.float32)], np.ones(4, bool), np.ones(4, np.float32), 2, 2,
            np.ones(4), np.ones(2), np.ones(3), 1.0, 0.5, 0.2, 0.1, np.zeros(2), np.zeros((2, 6)),
            np.zeros(2), *np.zeros((2, 2, 3)), np.zeros(2, np.int64), np.zeros((2, 6, 6)))


@pytest.mark.parametrize('side', [0, -1, -3, 2 ** 63 - 1])
def test_windows_have_a_side(side):
    with pytest.raises(ValueError, match='are none, or larger than the image'):
        kernels.gradient_moments(np.zeros((8, 8), np.uint8), np.ones((1, 2)), side,
                                 np.zeros((1, 9)))


@pytest.mark.parametrize('reach', [-1, 2 ** 62])
def test_edges_are_not_sought_without_end(reach):
    with pytest.raises(ValueError, match=f'a reach of {reach} pixels: 0 to 32768 are required'):
        kernels.nearer_beside(np.ones((8, 8), np.float32), np.ones((1, 2)), np.ones(1), reach,
                              0.1, 0.5, np.zeros(1))


@pytest.mark.parametrize('size', [0, 17, 18 + 2 ** 10 + 1])
def test_equations_have_unknowns_that_each_residual_has_and_not_too_many_others(size):
    message = f'{size} are not the unknowns of equations of 18 and nodes'
    with pytest.raises(ValueError, match=message):
        kernels.keypoint_equations(
            np.ones((2, 3)), np.zeros(2, int), np.zeros(2, int), np.ones((2, 3), np.float32),
            np.ones((2, 2, 6)), np.ones((2, 2)), np.ones((2, 2)), 1.0, np.eye(4), np.ones((2, 6)),
            CAMERA, CAMERA, 0.1, np.zeros((size, size)), np.zeros(size))


@pytest.mark.parametrize('every, rows, columns, message', [
    (1, 1, 6, '1 rows and 6 columns of nodes'), (1, 2 ** 30, 2 ** 30, 'are not the unknowns'),
    (0, 2, 2, 'one of 0 residuals'), (2 ** 40, 2, 2, f'one of {2 ** 40} residuals')])
def test_equations_have_a_grid_of_nodes_and_some_residuals(every, rows, columns, message):
    with pytest.raises(ValueError, match=message):
        kernels.depth_equations(
            *2 * [np.ones((2, 3))], np.ones((2, 6)), np.ones(2), np.ones(2), every, np.eye(4),
            np.ones((2, 6)), CAMERA, CAMERA, rows, columns, np.ones(4), np.ones(4),
            np.zeros((20, 20)), np.zeros((2, 20)))


def test_nodes_are_counted_in_64_bits():
    nodes, weights = np.zeros((1, 4), np.int64), np.zeros((1, 4))
    kernels.nodes_around([[1e30, 1e30, 1.0]], CAMERA, 2 ** 30, 2 ** 30, nodes, weights)
    assert nodes.max() == 2 ** 60 - 1
    with pytest.raises(ValueError, match='columns of nodes'):
        kernels.nodes_around(np.ones((1, 3)), CAMERA, 2, 2 ** 62, nodes, weights)


def test_the_sums_of_a_disc_fit_their_integers():
    """Sums of sums of a column: 255 (1 + 2 + ... + (2 r + 1)) below 2^31."""
    def direction(radius):
        border = radius + 8
        image, found = np.full((2 * border + 1,) * 2, 255, np.uint8), np.ones(1)
        kernels.disc_directions(image, border, np.full(radius + 1, radius),
                                np.zeros((1, 2), np.float32), found)
        return found

    np.testing.assert_array_equal(direction(1024), 0.0)  # none, by symmetry
    with pytest.raises(ValueError, match='a disc is not within'):
        direction(1025)


def test_the_counts_of_buckets_do_not_depend_on_what_was_there():
    normals, usable = np.zeros((2, 3), np.float32), np.ones(2, bool)
    sizes = np.full(49, np.iinfo(np.int64).max)
    kernels.normal_buckets(normals, usable, 7, np.zeros(2, np.uint8), sizes)
    assert sizes.sum() == 2


def test_refused_arrays_are_let_go():
    pixels = np.zeros((3, 2))
    before = sys.getrefcount(pixels)
    for _ in range(10):
        with pytest.raises(ValueError, match='the camera'):
            project(camera=np.ones(3), pixels=pixels)
        project(pixels=pixels)
    assert sys.getrefcount(pixels) == before
    pixels.resize((6, 2), refcheck=False)  # fails while a buffer is held


def longest_pause_beside_a_kernel():
    """Return it, of the thread that does not run the kernel, as a share of the kernel's time."""
    points, pixels, times = np.ones((3_000_000, 3)), np.empty((3_000_000, 2)), []

    def work():
        times.append(time.perf_counter())
        kernels.project(points, CAMERA, pixels)
        times.append(time.perf_counter())

    thread = threading.Thread(target=work)
    turns = [time.perf_counter()]
    thread.start()
    while thread.is_alive():
        turns.append(time.perf_counter())
    return np.diff(turns).max() / (times[1] - times[0])


def test_other_threads_run_beside_a_kernel():
    """One that held Python's lock would let none run until it ends."""
    assert min(longest_pause_beside_a_kernel() for _ in range(5)) < 0.5


def test_every_kernel_is_exported_typed_and_has_a_caller():
    names = {name for name in dir(_kernels) if not name.startswith('_')} - {'DIGEST'}
    assert set(kernels.__all__) == names | {'DIGEST'}
    stub = ast.parse((ROOT / 'aick_ros' / '_kernels.pyi').read_text())
    assert {node.name for node in stub.body if isinstance(node, ast.FunctionDef)} == names
    calls = ' '.join(path.read_text() for path in (ROOT / 'aick_ros').rglob('*.py'))
    assert not {name for name in names if f'kernels.{name}(' not in calls}


def test_the_kernels_are_made_of_the_files_that_are_here():
    files = sorted((ROOT / 'src' / 'kernels').iterdir())
    digest = sha256(b''.join(file.read_bytes() for file in files)).hexdigest()
    assert kernels.DIGEST == digest, 'make setup compiles them'


def test_arrays_without_a_length_are_refused():
    with pytest.raises(TypeError, match='unsized'):
        kernels.normal_equations(np.ones((1, 6)), np.array(1.0), np.ones(1), np.zeros((6, 6)),
                                 np.zeros(6))


@pytest.mark.parametrize('program', ['aick', 'odom_node'])
def test_a_copy_of_the_sources_that_is_not_compiled_says_so(program):
    start = ('from aick_ros.cli import main; main(["replay", "synthetic:1", "--frames", "1"])'
             if program == 'aick' else
             'from aick_ros.ros.process.entry_points import odom_node; odom_node()')
    missing = 'import sys; sys.modules["aick_ros._kernels"] = None'  # an import fails
    done = subprocess.run([sys.executable, '-c', f'{missing}; {start}'], capture_output=True,
                          text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr.startswith(f'{program}: aick_ros is not compiled: install it (pip install')
    assert done.stderr.count('\n') == 1
