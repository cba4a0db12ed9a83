# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses, cameras and stamps: mathematics without images or settings."""
