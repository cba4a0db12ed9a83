# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``aick`` as ``python3 -m aick_ros``."""

import sys

if __name__ == '__main__':
    try:
        from aick_ros.cli import main
        main()
    except KeyboardInterrupt:  # during that import
        print('aick: interrupted', file=sys.stderr)
        sys.exit(130)
    finally:
        # Where Ctrl-C came while Python ran code from text, as for each dataclass and namedtuple,
        # it would end `python -m` by SIGINT, handled or not, unless other text was run since.
        eval('None')
