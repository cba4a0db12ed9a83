# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Two hosts on one machine, joined by a cable that delays frames and loses some of them.

A host is a network namespace with shared memory of its own and one TAP device. This process reads
what one host sends and writes it to the other: each Ethernet frame is lost by chance, independent
of all others, or delivered after the delay, in order. Needs root and iproute2, but not netem.
"""

from __future__ import annotations

import ctypes
import fcntl
import multiprocessing
import os
import random
import select
import struct
import subprocess
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454ca, 2, 0x1000  # by definition, linux/if_tun.h
_LARGEST_FRAME = 2048  # bytes; derived: above the MTU of 1500
_QUEUE = 10_000  # frames that a device holds while this process does not run; chosen
_CLONE_NEWNET = 0x40000000  # by definition, linux/sched.h
_RECEIVED, _LOST, _BYTES = range(3)


class NotAllowed(Exception):
    """Network namespaces are missing or forbidden here."""


@dataclass(frozen=True)
class Traffic:
    """Traffic over the link, in both directions."""

    frames: int
    lost: int
    megabytes: float


class Host:
    """A network namespace with one device, kept by a process that waits."""

    def __init__(self, name: str, address: str) -> None:
        self.name, self._device = name, f'aick_{name}'
        try:
            self._keeper = subprocess.Popen(
                ['unshare', '--net', '--mount', 'sh', '-c',
                 'mount -t tmpfs tmpfs /dev/shm && echo ready && read end'],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        except FileNotFoundError:
            raise NotAllowed('unshare is not installed') from None
        try:
            assert self._keeper.stdout is not None and self._keeper.stderr is not None
            if self._keeper.stdout.readline() != 'ready\n':
                raise NotAllowed(self._keeper.stderr.read().strip())
            self.tap = _tap(self._device)
            _run('ip', 'link', 'set', self._device, 'txqueuelen', str(_QUEUE),
                 'netns', str(self._keeper.pid))
            self.run('ip', 'address', 'add', f'{address}/24', 'dev', self._device)
            self.run('ip', 'link', 'set', 'lo', 'up')
            self.set_up(True)
        except BaseException:
            self.close()
            raise

    def command(self, *command: str) -> list[str]:
        """Return a command that runs another one on this host."""
        return ['nsenter', '--target', str(self._keeper.pid), '--net', '--mount', *command]

    def run(self, *command: str) -> str:
        """Run a command on this host and return its output."""
        return _run(*self.command(*command))

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Have this thread, and the threads and processes it starts, on this host's network."""
        with (open('/proc/thread-self/ns/net') as before,
              open(f'/proc/{self._keeper.pid}/ns/net') as here):
            _enter(here.fileno())
            try:
                yield
            finally:
                _enter(before.fileno())

    def drops(self) -> int:
        """Return how many frames the device had no room for; these are no loss by chance."""
        fields = self.run('cat', '/proc/net/dev').partition(f'{self._device}:')[2].split()
        return int(fields[3]) + int(fields[11])

    def set_up(self, up: bool) -> None:
        """Bring the device up, with the route that discovery needs, or down."""
        self.run('ip', 'link', 'set', self._device, 'up' if up else 'down')
        if up:
            self.run('ip', 'route', 'add', '224.0.0.0/4', 'dev', self._device)

    def close(self) -> None:
        """End the host; its device ends with it."""
        if hasattr(self, 'tap'):
            os.close(self.tap)
        self._keeper.communicate('\n')


class LossyLink:
    """
    Two hosts, ``camera`` and ``robot``; leave the ``with`` block to end them.

    :param loss: share of the Ethernet frames that are lost, in each direction.
    :param delay: of each frame [s].
    :raises NotAllowed: where namespaces are not allowed.
    """

    def __init__(self, loss: float, delay: float, seed: int = 0) -> None:
        self._counts = multiprocessing.RawArray('q', 3)
        self.camera = Host('camera', '10.203.0.1')
        try:
            self.robot = Host('robot', '10.203.0.2')
        except BaseException:
            self.camera.close()
            raise
        self._relay = multiprocessing.get_context('fork').Process(
            target=_relay, args=((self.camera.tap, self.robot.tap), loss, delay,
                                 random.Random(seed), self._counts), daemon=True)

    def __enter__(self) -> LossyLink:
        """Begin to relay."""
        self._relay.start()
        return self

    def __exit__(self, *error: object) -> None:
        """End relay and hosts."""
        self._relay.kill()
        self._relay.join()
        self.camera.close()
        self.robot.close()

    @property
    def traffic(self) -> Traffic:
        """Traffic over the link so far."""
        return Traffic(self._counts[_RECEIVED], self._counts[_LOST], 1e-6 * self._counts[_BYTES])


def _relay(taps: Sequence[int], loss: float, delay: float, chance: random.Random,
           counts: Sequence[int]) -> None:
    """Carry frames between two devices until this process is ended."""
    for tap in taps:
        os.set_blocking(tap, False)
    under_way: deque[tuple[float, int, bytes]] = deque()  # when it is due, where, what
    while True:
        wait = under_way[0][0] - time.monotonic() if under_way else None
        readable, _, _ = select.select(taps, (), (), wait if wait is None else max(wait, 0.0))
        due = time.monotonic() + delay
        for tap in readable:
            target = taps[1 - taps.index(tap)]
            for frame in _frames(tap):
                counts[_RECEIVED] += 1
                counts[_BYTES] += len(frame)
                if chance.random() < loss:
                    counts[_LOST] += 1
                else:
                    under_way.append((due, target, frame))
        now = time.monotonic()
        while under_way and under_way[0][0] <= now:
            _, target, frame = under_way.popleft()
            try:
                os.write(target, frame)
            except OSError:
                pass  # the device is down


def _frames(tap: int) -> Iterator[bytes]:
    """Yield the frames that wait in a device, at most 100: others wait to be written."""
    for _ in range(100):
        try:
            yield os.read(tap, _LARGEST_FRAME)
        except OSError:  # there is none, or the device is down
            return


def _tap(name: str) -> int:
    """Return a new TAP device."""
    try:
        tap = os.open('/dev/net/tun', os.O_RDWR)
        fcntl.ioctl(tap, _TUNSETIFF, struct.pack('16sH22x', name.encode(),
                                                 _IFF_TAP | _IFF_NO_PI))
    except OSError as error:
        raise NotAllowed(f'TAP device: {error}') from None
    return tap


def _enter(namespace: int) -> None:
    if ctypes.CDLL(None, use_errno=True).setns(namespace, _CLONE_NEWNET):
        raise NotAllowed(f'setns: {os.strerror(ctypes.get_errno())}')


def _run(*command: str) -> str:
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise NotAllowed(f'{command[0]} is not installed') from None
    except subprocess.CalledProcessError as error:
        raise NotAllowed(f'{" ".join(command)}: {error.stderr.strip()}') from None
