# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np

def cells_at(
    points: np.ndarray, usable: np.ndarray, width: int, height: int, intrinsics: np.ndarray,
    indices: np.ndarray, cells: np.ndarray) -> int: ...
def gradient_noise(
    jacobian: np.ndarray, values: np.ndarray, weights: np.ndarray, blocks: np.ndarray,
    error: np.ndarray, noise: np.ndarray) -> None: ...
def moved_by_rows(
    points: np.ndarray, twist: np.ndarray, twist_by_row: np.ndarray, height: float,
    moved: np.ndarray) -> None: ...
def normal_equations(
    jacobian: np.ndarray, values: np.ndarray, weights: np.ndarray, information: np.ndarray,
    gradient: np.ndarray) -> None: ...
def point_to_plane(
    moved: np.ndarray, arms: np.ndarray, chosen: np.ndarray, normals: np.ndarray,
    roughness: np.ndarray, rotation: np.ndarray, target_points: np.ndarray,
    target_normals: np.ndarray, target_usable: np.ndarray, target_roughness: np.ndarray,
    width: int, height: int, intrinsics: np.ndarray, sigma: float, exponent: float, reach: float,
    smallest_cosine: float, values: np.ndarray, jacobian: np.ndarray, other: np.ndarray,
    points: np.ndarray, blocks: np.ndarray) -> int: ...
def project(
    points: np.ndarray, intrinsics: np.ndarray, distortion: np.ndarray,
    pixels: np.ndarray) -> None: ...
def reprojection(
    points: np.ndarray, rays: np.ndarray, sigmas: np.ndarray, pose: np.ndarray,
    ray_sigma: float, values: np.ndarray, jacobian: np.ndarray, squares: np.ndarray,
    blocks: np.ndarray) -> None: ...
def sample_depth(
    image: np.ndarray, pixels: np.ndarray, depth_jump: float,
    min_depth: float, max_depth: float, depths: np.ndarray) -> None: ...
def track_depth(
    points: np.ndarray, rays: np.ndarray, depths: np.ndarray, pose: np.ndarray, sigma: float,
    exponent: float, values: np.ndarray, jacobian: np.ndarray, blocks: np.ndarray) -> int: ...
def edges_beside(
    image: np.ndarray, pixels: np.ndarray, depths: np.ndarray,
    reach: int, least_rise: float, least_step: float, nearer: np.ndarray,
    edges: np.ndarray) -> None: ...
def gradient_moments(
    image: np.ndarray, pixels: np.ndarray, side: int,
    moments: np.ndarray) -> None: ...
def inverse_depth_slopes(
    image: np.ndarray, pixels: np.ndarray, depths: np.ndarray, side: int,
    slopes: np.ndarray) -> None: ...
def plane_jacobians(
    normals: np.ndarray, points: np.ndarray, pose: np.ndarray, ratio: float,
    jacobians: np.ndarray) -> None: ...
def window_shifts(
    moved: np.ndarray, turns: np.ndarray, moments: np.ndarray, limit: float, smallest: float,
    shifts: np.ndarray) -> None: ...
def depth_rows(
    points: np.ndarray, directions: np.ndarray, jacobian: np.ndarray, pose: np.ndarray,
    twists: np.ndarray, heights: np.ndarray, rows: np.ndarray) -> None: ...
def distortion_rows(
    points: np.ndarray, directions: np.ndarray, nodes: np.ndarray, weights: np.ndarray,
    sign: float, distortion: np.ndarray, rows: np.ndarray, applied: np.ndarray) -> None: ...
def keypoint_rows(
    points: np.ndarray, indices: np.ndarray, cells: np.ndarray, normals: np.ndarray,
    jacobian: np.ndarray, pose: np.ndarray, twists: np.ndarray, heights: np.ndarray,
    smallest_cosine: float, rows: np.ndarray) -> None: ...
def nodes_around(
    places: np.ndarray, rows: int, columns: int, nodes: np.ndarray,
    weights: np.ndarray) -> None: ...
def robust_weights(
    squares: np.ndarray, width: float, typical: float, largest_scale: float,
    weights: np.ndarray) -> None: ...
