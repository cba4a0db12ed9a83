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
    image: np.ndarray, height: int, width: int, pixels: np.ndarray, depth_jump: float,
    min_depth: float, max_depth: float, depths: np.ndarray) -> None: ...
def track_depth(
    points: np.ndarray, rays: np.ndarray, depths: np.ndarray, pose: np.ndarray, sigma: float,
    exponent: float, values: np.ndarray, jacobian: np.ndarray, blocks: np.ndarray) -> int: ...
