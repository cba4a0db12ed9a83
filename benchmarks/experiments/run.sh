#!/bin/sh
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

# Measures what docs/experiments.md shows, and writes the page and its pictures.
#
#     benchmarks/experiments/run.sh timed SOURCE...    Table I and all times: on an idle machine
#     benchmarks/experiments/run.sh success SOURCE...  what does not depend on the load
#
# Interrupted, the same command goes on where it was. It takes `make baselines pcl`.
set -eu

case "${1-}" in
timed|success) what=$1 ;;
*) sed -n '5,10s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
shift
root=$(cd "$(dirname "$0")/../.." && pwd)
results=$root/benchmarks/experiments/results
export PATH="$root/.venv/bin:$PATH"
paper=aick-orb,aick-orb-350,aick-orb-fast,aick-surf,aick-surf-200,aick-surf-fast
ransac=ransac3,ransac3-orb
others=gicp-tuned,ndt-tuned,pnp,small-gicp
others=$others,open3d-hybrid,open3d-plane,opencv-depth,opencv-rgbd

if [ "$what" = timed ]; then
    aick benchmark "$@" --methods "aick,$paper,$ransac,$others" --gaps 1,2,5,10 --pairs 40 \
        --json "$results/experiments.json"
    aick benchmark "$@" --methods aick-orb,gicp,ndt --gaps 1,5 --pairs 8 \
        --json "$results/slow.json"
else
    aick benchmark "$@" --methods "$paper,$ransac" --gaps 1,5 --jobs 2 \
        --json "$results/every.json"
    aick benchmark "$@" --methods aick-orb --gaps 1,2,5,10 --pairs 40 --jobs 2 \
        --json "$results/sweeps.json" --plots "$results/plots"
fi
python "$root/benchmarks/experiments/write_page.py"
