# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``aick``, also as ``python3 -m aick_ros``."""

import sys


def main() -> None:
    """Run the command and exit, of which Ctrl-C during its import is a part."""
    try:
        from aick_ros.cli import main as run
        run()
    except KeyboardInterrupt:  # during that import
        print('aick: interrupted', file=sys.stderr)
        sys.exit(130)


if __name__ == '__main__':
    try:
        main()
    finally:
        # Where Ctrl-C came while Python ran code from text, as for each dataclass and namedtuple,
        # it would end `python -m` by SIGINT, handled or not, unless other text was run since.
        eval('None')
