# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Memory that is freed is used again, without asking the system for it."""

import platform
import subprocess
import sys

import pytest

ANEW = '''
import resource
import numpy as np
from aick_ros.borders.allocator import keep_freed_memory
{keep}
for _ in range(20):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    images = [np.ones((480, 640), np.float32) for _ in range(3)]
    del images
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
'''
AFTER_ANOTHER_THREAD = '''
import resource, threading
import numpy as np
from aick_ros.borders.allocator import keep_freed_memory
{keep}
def images():
    return [np.ones((480, 640), np.float32) for _ in range(3)]
for _ in range(2):  # so that each thread has allocated before
    thread = threading.Thread(target=images)
    thread.start()
    thread.join()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
made = images()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
'''


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='the allocator of glibc')
@pytest.mark.parametrize('program', [ANEW, AFTER_ANOTHER_THREAD])
def test_images_are_put_where_others_were(program):
    faults = [int(subprocess.run(
        [sys.executable, '-c', program.format(keep=keep)], capture_output=True, text=True,
        check=True).stdout) for keep in ('', 'keep_freed_memory()')]
    pages = 3 * 480 * 640 * 4 / 4096
    assert faults[0] > 0.5 * pages  # else it is not needed
    assert faults[1] < 0.05 * pages


RELEASED = '''
import numpy as np
from pathlib import Path
from aick_ros.borders.allocator import keep_freed_memory, release_freed_memory
def resident():
    pages = [int(line.split()[1]) for line in Path('/proc/self/status').open()
             if line.startswith('VmRSS')]
    return pages[0] / 1024
keep_freed_memory()
images = [np.ones((480, 640), np.float32) for _ in range(40)]
del images[::2], images[:-1]  # what stays in use is behind what is freed
before = resident()
release_freed_memory()
print(before - resident())
'''


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='the allocator of glibc')
def test_what_is_freed_is_given_back_when_it_is_asked_for():
    released = float(subprocess.run([sys.executable, '-c', RELEASED], capture_output=True,
                                    text=True, check=True).stdout)
    freed = 39 * 480 * 640 * 4 / 2 ** 20
    assert released > 0.9 * freed
