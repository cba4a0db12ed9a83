# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parameters of the keypoint detectors and of the selection of keypoints."""

from __future__ import annotations

from dataclasses import dataclass

from aick_ros.settings.parameter import Checked, parameter

_PIXEL_SIGMA = 'Standard deviation of the keypoint position at the finest scale (pixel noise).'
_PIXEL_EXPONENT = 'Exponent p of the keypoint noise: sigma = pixel_sigma * scale^p.'


@dataclass(frozen=True)
class OrbSettings(Checked):
    """ORB detector; the defaults are those of the paper (IV-B)."""

    nfeatures: int = parameter(
        1100, 'Maximum number of keypoints detected per image.', minimum=10, maximum=20000)
    scale_factor: float = parameter(
        1.2, 'Scale ratio between consecutive pyramid levels.', minimum=1.01, maximum=2.0)
    levels: int = parameter(8, 'Number of pyramid levels.', minimum=1, maximum=16)
    edge_threshold: int = parameter(
        2, 'Width of the image border without keypoints.', unit='px', minimum=0, maximum=100)
    patch_size: int = parameter(
        31, 'Side length of the descriptor patch.', unit='px', minimum=5, maximum=101)
    fast_threshold: int = parameter(
        20, 'Minimum contrast of a FAST corner.', unit='grey levels', minimum=1, maximum=255)
    min_fast_threshold: int = parameter(
        5, 'The same where an image has less than half as many such corners as nfeatures, as of a '
        'dark place; noise of the image may raise it up to the former.', unit='grey levels',
        minimum=1, maximum=255)
    pixel_sigma: float = parameter(
        0.45, _PIXEL_SIGMA, unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(0.75, _PIXEL_EXPONENT, minimum=0.0, maximum=2.0)


@dataclass(frozen=True)
class SurfSettings(Checked):
    """Upright SURF detector; the defaults are those of the paper (IV-B)."""

    octaves: int = parameter(
        5, 'Number of octaves; filter spacing and sampling step double from one to the next.',
        minimum=1, maximum=8)
    intervals: int = parameter(
        5, 'Filters per octave; maxima are found in all but the smallest and the largest.',
        minimum=3, maximum=8)
    init_sample: int = parameter(
        2, 'Sampling step of the first octave.', unit='px', minimum=1, maximum=8)
    threshold: float = parameter(
        0.00001, 'Minimum determinant of the Hessian, for grey levels scaled to 0..1.',
        minimum=0.0, maximum=1.0)
    pixel_sigma: float = parameter(
        0.25, _PIXEL_SIGMA, unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(0.75, _PIXEL_EXPONENT, minimum=0.0, maximum=2.0)


@dataclass(frozen=True)
class SiftSettings(Checked):
    """SIFT detector; the defaults are those of OpenCV except for the number of keypoints."""

    nfeatures: int = parameter(
        1100, 'Maximum number of keypoints detected per image.', minimum=10, maximum=20000)
    octave_layers: int = parameter(
        3, 'Scales per octave at which extrema are found.', minimum=1, maximum=8)
    contrast_threshold: float = parameter(
        0.04, 'Minimum contrast of an extremum; a larger value rejects more weak ones.',
        minimum=0.0, maximum=1.0)
    edge_threshold: float = parameter(
        10.0, 'Maximum ratio of the principal curvatures of an extremum; a smaller value rejects '
        'more edges.', minimum=1.0, maximum=1000.0)
    sigma: float = parameter(
        1.6, 'Standard deviation of the Gaussian at the first scale.',
        unit='px', minimum=0.6, maximum=10.0)
    pixel_sigma: float = parameter(
        0.15, _PIXEL_SIGMA, unit='px', minimum=0.01, maximum=10.0)
    pixel_exponent: float = parameter(0.4, _PIXEL_EXPONENT, minimum=0.0, maximum=2.0)


@dataclass(frozen=True)
class FeatureSettings(Checked):
    """Keypoints of the colour image."""

    detector: str = parameter(
        'orb', 'Keypoint detector and descriptor.', choices=('orb', 'surf', 'sift'))
    max_keypoints: int = parameter(
        400, 'Maximum number of keypoints with valid depth that are kept; 0: all.',
        minimum=0, maximum=20000)
    cell_size: float = parameter(
        60.0, 'Side length of the grid cells over which the kept keypoints are spread evenly, the '
        'strongest of each cell first; 0: the strongest of the whole image.',
        unit='px', minimum=0.0, maximum=10000.0)
    orb: OrbSettings = OrbSettings()
    surf: SurfSettings = SurfSettings()
    sift: SiftSettings = SiftSettings()

    @property
    def chosen(self) -> OrbSettings | SurfSettings | SiftSettings:
        """Settings of the chosen detector."""
        detectors: dict[str, OrbSettings | SurfSettings | SiftSettings] = {
            'orb': self.orb, 'surf': self.surf, 'sift': self.sift}
        return detectors[self.detector]
