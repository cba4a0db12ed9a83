# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The package aick_ros, for pip and for colcon (build type ament_python)."""

from glob import glob
from hashlib import sha256
from pathlib import Path

from setuptools import Extension, find_packages, setup

PACKAGE = 'aick_ros'
SHARE = f'share/{PACKAGE}'

CLI = ['typer>=0.12', 'rich>=13.8', 'pyyaml>=6.0']
EVAL = [*CLI, 'matplotlib>=3.6']
FLEET = [*EVAL, 'dask>=2025.1', 'distributed>=2025.1', 'bokeh>=3.1', 'pyarrow>=15.0',
         'fsspec>=2024.2', 'aiohttp>=3.9']
S3 = ['s3fs>=2026.9', 'aiobotocore>=3.10']  # older ones exclude the multidict of today's aiohttp
VIEW = [*CLI, 'rerun-sdk>=0.41']
BASELINES = ['small_gicp>=1.0', 'open3d>=0.18', 'scipy>=1.11']
ROS = ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces', 'pyyaml>=6.0']
LINT = ['flake8>=7.0', 'isort>=5.12', 'mypy>=1.11', 'types-PyYAML']
TEST = [*FLEET, *S3, *LINT, 'pytest>=7.4', 'pytest-xdist>=3.7', 'evo>=1.31', 'scipy>=1.11',
        'mahotas>=1.4', 'rvl>=1.0', 'hypothesis>=6.100', 'moto[s3]>=5.2', 'flask>=3.0',
        'flask-cors>=6.0',
        # colcon calls commands of setup.py that setuptools 80 no longer has
        'colcon-common-extensions', 'setuptools<80']

MUTATION = ['cosmic-ray>=8.7']

DATA_FILES = [
    ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
    (SHARE, ['package.xml']),
    (f'{SHARE}/config', glob('config/*.*')),
    (f'{SHARE}/config/cameras', glob('config/cameras/*.yaml')),
    (f'{SHARE}/config/sros2', glob('config/sros2/*.xml')),
    (f'{SHARE}/launch', glob('launch/*.launch.py')),
    # `ros2 run` looks for executables here; these start the entry points, in bin of the prefix
    (f'lib/{PACKAGE}', glob('scripts/*')),
]

# Loops and small algebra; the stable interface serves every Python from 3.11 on
KERNEL_FILES = sorted(glob('src/kernels/*'))
DIGEST = sha256(b''.join(Path(file).read_bytes() for file in KERNEL_FILES)).hexdigest()
KERNELS = Extension(
    f'{PACKAGE}._kernels', [file for file in KERNEL_FILES if file.endswith('.c')],
    depends=[*KERNEL_FILES, 'setup.py'], py_limited_api=True,
    define_macros=[('Py_LIMITED_API', '0x030b0000'), ('DIGEST', f'"{DIGEST}"')],
    # no contraction: the same digits on every processor
    extra_compile_args=['-std=c11', '-O3', '-fno-math-errno', '-ffp-contract=off'])

setup(
    name=PACKAGE,
    version='0.1.0',
    description='RGB-D visual odometry by Adaptive Iterative Closest Keypoint, for ROS 2 '
                'and offline',
    license='Apache-2.0',
    url='https://doi.org/10.1109/ECMR.2013.6698824',  # the paper; no public repository yet
    maintainer='The aick_ros authors',
    maintainer_email='aick_ros@no-address-yet.invalid',
    ext_modules=[KERNELS],
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', '_kernels.pyi', 'features/vocabularies/*']},
    python_requires='>=3.11',
    install_requires=['numpy>=1.26', 'opencv-python-headless>=4.6', 'rosbags>=0.11.1'],
    extras_require={'ros': ROS, 'cli': CLI, 'eval': EVAL, 'fleet': FLEET, 's3': S3,
                    'view': VIEW,
                    'baselines': BASELINES,
                    'test': TEST, 'mutation': MUTATION},
    data_files=DATA_FILES,
    entry_points={'console_scripts': [
        'aick = aick_ros.__main__:main',
        'odom_node = aick_ros.ros.process.entry_points:odom_node',
        'odom_lifecycle_node = aick_ros.ros.process.entry_points:odom_lifecycle_node',
        'bag_player = aick_ros.ros.process.entry_points:bag_player',
    ]},
)
