# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the topics of a bag: colour, depth, calibrations and ground truth."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from aick_ros.borders.names import quoted_if_blank
from aick_ros.errors import InputError

IMAGE = 'sensor_msgs/msg/Image'
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
IMU = 'sensor_msgs/msg/Imu'
POSES = ('geometry_msgs/msg/PoseStamped', 'geometry_msgs/msg/PoseWithCovarianceStamped',
         'geometry_msgs/msg/TransformStamped', 'nav_msgs/msg/Odometry')
"""Types of messages that can be ground truth."""

TRANSFORMS = 'tf2_msgs/msg/TFMessage'

_IMAGES = (IMAGE, COMPRESSED_IMAGE)
_DEPTH = re.compile(r'depth', re.IGNORECASE)
_REGISTERED = re.compile(r'registered|aligned|depth_to_', re.IGNORECASE)
_COLOUR = re.compile(r'rgb|colou?r', re.IGNORECASE)
_NEITHER = re.compile(r'infra|\bir\b|disparity|confidence|mask|label|debug', re.IGNORECASE)
_GROUND_TRUTH = re.compile(r'ground_?truth', re.IGNORECASE)
_ACCELEROMETER = re.compile(r'acc', re.IGNORECASE)
_TRANSPORT = re.compile(r'/(compressed|compressedDepth)$')

_OPTIONS = {'colour': '--colour-topic', 'depth': '--depth-topic', 'camera_info': '--info-topic',
            'depth camera_info': '--depth-info-topic', 'ground truth': '--ground-truth-topic',
            'IMU': '--imu-topic'}

Rank = Callable[[str], tuple[Any, ...]]


@dataclass(frozen=True)
class BagTopics:
    """
    The topics of a bag that have messages.

    :param types: topic -> type.
    :param bag: path of the bag, for error messages.
    """

    types: Mapping[str, str]
    bag: str

    def colour(self, given: str | None, depth: str | None = None) -> str:
        """
        Return the topic of the colour images; raw ones are preferred to compressed ones.

        :param given: the topic that the user chose, or None.
        :param depth: the depth topic, where the user chose it.
        :raises InputError: where no topic fits, or several fit equally.
        """
        def fits(topic: str) -> bool:
            return not _DEPTH.search(topic) and not _NEITHER.search(topic)

        def rank(topic: str) -> tuple[Any, ...]:
            return (bool(_COLOUR.search(topic)), _shared(topic, depth), *self._plainness(topic))

        return self._choose('colour', given, _IMAGES, fits, rank)

    def depth(self, given: str | None, colour: str, registered: bool = True) -> str:
        """
        Return the topic of the depth images.

        :param colour: the colour topic; one beside it is preferred.
        :param registered: whether depth in the colour camera's image is preferred, or depth in
            that of the depth camera.
        :raises InputError: as :meth:`colour`.
        """
        def fits(topic: str) -> bool:
            return bool(_DEPTH.search(topic)) and not _NEITHER.search(topic)

        def rank(topic: str) -> tuple[Any, ...]:
            return (bool(_REGISTERED.search(topic)) == registered, _shared(topic, colour),
                    *self._plainness(topic))

        return self._choose('depth', given, _IMAGES, fits, rank)

    def info(self, given: str | None, colour: str) -> str:
        """Return the topic of the colour camera's camera_info, preferably beside its images."""
        return self._info('camera_info', given, colour, is_depth=False)

    def depth_info(self, given: str | None, depth: str) -> str:
        """Return the topic of the depth camera's camera_info, preferably beside its images."""
        return self._info('depth camera_info', given, depth, is_depth=True)

    def ground_truth(self, given: str | None) -> str | None:
        """Return the topic of the ground truth, None where the bag has none."""
        def fits(topic: str) -> bool:
            return bool(_GROUND_TRUTH.search(topic))

        if given is None and not any(fits(topic) for topic in self._of(POSES)):
            return None
        return self._choose('ground truth', given, POSES, fits, lambda topic: ())

    def imu(self, colour: str) -> str | None:
        """
        Return the topic of an IMU, or of a gyroscope alone; None where there is none.

        :param colour: the colour topic; one beside it is preferred.
        """
        candidates = [topic for topic in self._of((IMU,)) if not _ACCELEROMETER.search(topic)]
        return max(candidates, key=lambda topic: _shared(topic, colour), default=None)

    def only_imu(self, given: str | None) -> str:
        """
        Return the topic of an IMU, of a recording that is about it.

        :raises InputError: as :meth:`colour`.
        """
        return self._choose('IMU', given, (IMU,), lambda topic: True, lambda topic: ())

    def __str__(self) -> str:
        """Return the topics with their types, for error messages."""
        topics = (f'{topic} ({type_})' for topic, type_ in sorted(self.types.items()))
        return ', '.join(topics) or 'no messages'

    def _of(self, types: tuple[str, ...]) -> list[str]:
        return sorted(topic for topic, type_ in self.types.items() if type_ in types)

    def _info(self, what: str, given: str | None, images: str, is_depth: bool) -> str:
        beside = _TRANSPORT.sub('', images).rpartition('/')[0] + '/camera_info'

        def fits(topic: str) -> bool:
            return topic == beside or (bool(_DEPTH.search(topic)) == is_depth
                                       and not _NEITHER.search(topic))

        def rank(topic: str) -> tuple[Any, ...]:
            return (topic == beside, _shared(topic, images))

        return self._choose(what, given, (CAMERA_INFO,), fits, rank)

    def _plainness(self, topic: str) -> tuple[Any, ...]:
        return (self.types[topic] == IMAGE, topic.endswith('/compressedDepth'),
                _TRANSPORT.sub('', topic).endswith('/image_raw'))

    def _choose(self, what: str, given: str | None, types: tuple[str, ...],
                fits: Callable[[str], bool], rank: Rank) -> str:
        option = _OPTIONS[what]
        if given is not None:
            if given not in self._of(types):
                raise InputError(f'{self.bag} has no {" or ".join(types)} on '
                                 f'{quoted_if_blank(given)} ({option}); it has {self}')
            return given
        candidates = [topic for topic in self._of(types) if fits(topic)]
        if not candidates:
            raise InputError(f'{self.bag} has no {what} topic ({" or ".join(types)}): give it '
                             f'with {option}; it has {self}')
        best = max(map(rank, candidates))
        chosen = [topic for topic in candidates if rank(topic) == best]
        if len(chosen) > 1:
            raise InputError(f'{self.bag} has several that may be the {what} topic, '
                             f'{", ".join(chosen)}: choose with {option}')
        return chosen[0]


def _shared(topic: str, other: str | None) -> int:
    """Return the number of leading parts that two topic names have in common."""
    count = 0
    for part, other_part in zip(topic.split('/'), (other or '').split('/')):
        if part != other_part:
            break
        count += 1
    return count
