# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages and transforms in: subscriptions, pairs of images, calibrations, TF."""
