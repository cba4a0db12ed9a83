# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera on another host, over a network that loses packets."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / 'benchmarks'
COUNT = 12  # frames rendered
SECONDS = 6.0
RATE = 10.0
LOSS = 0.05  # of the packets, more than Wi-Fi has: an image is 60 of them

# In a process of its own: Fast DDS remembers the network that it has seen first.
PROGRAM = '''
import json, os, sys
from pathlib import Path
sys.path.insert(0, {benchmarks!r})
from lossy_link import NotAllowed
from network import Case, run
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SUBNET'  # of the two hosts
try:
    outcome = run(Case('test', loss={loss}, rate={rate}), Path(sys.argv[1]), {seconds})
except NotAllowed as error:
    print(json.dumps(dict(skip=str(error))))
else:
    print(json.dumps(dict(stamps=outcome.stamps, received=list(outcome.received),
                          lost=outcome.lost)))
'''.format(benchmarks=str(BENCHMARKS), loss=LOSS, rate=RATE, seconds=SECONDS)


@pytest.fixture
def recording(all_frames, tmp_path):
    """A file of frames, as the camera of the benchmarks takes it."""
    frames = all_frames[:COUNT]
    path = tmp_path / 'frames.npz'
    np.savez(path, k=frames[0].camera.matrix, colour=[frame.colour for frame in frames],
             depth=[np.rint(1000 * np.nan_to_num(frame.depth)).astype('<u2')
                    for frame in frames])
    return path


def test_compressed_images_are_answered_though_the_network_loses_packets(ros_domain, recording):
    """With the profile for wireless networks, what is lost is sent again in time."""
    run = subprocess.run([sys.executable, '-c', PROGRAM, str(recording)], capture_output=True,
                         text=True, env=os.environ)
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout.splitlines()[-1])
    if 'skip' in found:
        pytest.skip(f'network namespaces are not allowed here: {found["skip"]}')
    assert 0.5 * LOSS < found['lost'] < 2.0 * LOSS
    answered = set(found['received'])
    assert answered <= set(found['stamps'])
    # one image in twenty gets through whole; a busy machine may answer late
    assert len(answered) >= 0.2 * RATE * SECONDS
