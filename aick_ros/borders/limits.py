# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Largest inputs that are accepted; docs/limits.md lists them.

They are far above what cameras and robots send, and low enough that damaged or hostile input is
rejected before it takes memory or time.
"""

from __future__ import annotations

MAX_PIXELS = 2 ** 24
"""Pixels of an image, for example 4096 x 4096; chosen: at 52 bytes each they take 1 GB at most."""

MAX_RVL_PIXELS = 2 ** 22
"""Pixels of an image in RVL data; chosen: it is decoded in NumPy, at 100 bytes a pixel."""

MAX_SIDE = 2 ** 15 - 1
"""Columns or rows of an image; derived: the largest coordinate of OpenCV's remap."""

MAX_SCANS = 100
"""Scans of a progressive JPEG, each of which may be of all pixels; chosen: encoders make 10."""

MAX_MESSAGE_BYTES = 2 ** 28
"""Bytes of a message, and of an unpacked chunk, of a bag; chosen: MAX_PIXELS of 8 bytes, twice."""

MAX_UNPACKING = 100
"""Unpacked bytes of a packed file, or of all chunks of one, per byte; chosen: cameras have 10."""

MAX_PACKED_FRAMES = 1000
"""Frames of a packed chunk or message, one after the other; chosen: writers make one."""

MAX_CHUNKS = 2 ** 18
"""Chunks of an MCAP file that are small in the mean; chosen: as many take 8 s to find."""

SMALL_CHUNK_BYTES = 2 ** 12
"""Mean size of the chunks of an MCAP file below which they are small; chosen: ROS 2 records chunks
of 768 KiB, and whoever records hours has many."""

MAX_CHUNK_MESSAGES = 2 ** 20
"""Messages of a chunk of a bag, of topics that are read; chosen: it is full at 256 bytes each."""

MAX_INDEXED_MESSAGES = 2 ** 22
"""Messages of a ROS 1 bag, if they are small; chosen: the index of as many takes 0.7 GB."""

MEAN_MESSAGE_BYTES = 2 ** 12
"""Mean size of the messages of a ROS 1 bag from which on it may have more; chosen: images are far
larger, and whoever records hours has many."""

MAX_DAMAGED_IMAGES = 50_000
"""Images of a recording that are skipped; chosen: 14 min of colour and depth at 30 Hz."""

MAX_DEFINITION_LINES = 2 ** 17
"""Lines of the definitions of messages in a bag; chosen: 400 types of 300 lines."""

MAX_DEFINED_FIELDS = 2 ** 13
"""Fields of all types that a bag defines; chosen: 400 types of 20 fields."""

MAX_MESSAGE_FIELDS = 1000
"""Fields of the messages that are read, those in them included; chosen: Odometry has 30."""

MAX_METADATA_BYTES = 2 ** 20
"""Bytes of metadata.yaml of a bag; chosen: that of a bag of some thousand files."""

MAX_RECORDINGS = 100_000
"""Recordings of a fleet, and sources that a list of them names; chosen: 10,000 were measured."""

MAX_TABLE_CELLS = 2 ** 23
"""Cells of the table of a fleet; chosen: 100,000 runs with 80 columns."""

MAX_REMOTE_FILES = 100_000
"""Files of a recording at a URL; chosen: about half an hour of images, colour and depth."""

MAX_REMOTE_DEPTH = 16
"""Folders in each other at a URL; chosen."""

MAX_LIST_BYTES = 2 ** 26
"""Bytes of a list of images, of files at a URL or of names in a table, or of a trajectory; chosen:
10 h at 200 Hz."""

MAX_FRAMES_BYTES = 2 ** 30
"""Bytes of the table of frames of a run; chosen: 6 h at 30 Hz, of 1.5 kB a frame."""

MAX_CONFIGURATION_BYTES = 2 ** 18
"""Bytes of a parameter or calibration file; chosen: ten times all parameters."""

MAX_YAML_DEPTH = 32
"""Levels of nesting in a YAML file; chosen."""

MAX_YAML_VALUES = 100_000
"""Values in a YAML file, with aliases expanded; chosen."""

MAX_VOCABULARY_BYTES = 2 ** 27
"""Bytes of a vocabulary file, packed or unpacked; chosen: MAX_WORDS of 128 float32, and more."""

MAX_WORDS = 100_000
"""Words of a vocabulary; chosen: a frame of 400 keypoints takes seconds then."""

MAX_DISTANCE = 1e8
"""Distance of a pose from its origin [m]; chosen: twice around the Earth, to 15 nm in float64."""

MAX_EXTRINSIC = 1000.0
"""Distance of a camera from the origin of its robot [m]; chosen: above the largest machines."""

MAX_TURN_RATE = 1000.0
"""Turn rate of an IMU about an axis [rad/s]; chosen: the fastest gyroscopes end at 70."""

MAX_ACCELERATION = 1e5
"""Acceleration of an IMU along an axis [m/s^2]; chosen: shocks of 10,000 g."""

MAX_PIXEL_LENGTH = 1e6
"""Focal length, or offset of the principal point, of a camera [px]; chosen."""

MIN_FOCAL_LENGTH = 0.1
"""Focal length of a camera [px]; chosen: less than that of a thumbnail."""

MIN_DEPTH = 1e-5
"""Depth of a pixel [m]; chosen: nearer than any macro lens; less is none."""

MAX_DEPTH = 1e5
"""Depth of a pixel [m]; chosen: farther than any lidar; more is none."""

MAX_DISTORTION = 1e6
"""Absolute value of a distortion coefficient; chosen: rational models reach some hundreds."""
