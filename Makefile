# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
UNFINISHED := $(VENV)/unfinished
TF2_MSGS := $(VENV)/tf2_msgs
PINS := requirements/constraints.txt
JOBS ?= 3
EXTRAS := ros,eval,view,test

# A ROS that the calling shell has sourced stays out of the virtual environment, and the traffic
# stays on this machine.
unexport PYTHONHOME PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH
unexport RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Every module is compiled once, not by each of the processes that tests start.
unexport PYTHONDONTWRITEBYTECODE
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export PIP_DISABLE_PIP_VERSION_CHECK := 1

RECORDINGS := $(wildcard ../shared/tum)
ifneq ($(RECORDINGS),)
export AICK_DATA ?= $(abspath $(RECORDINGS))
endif

.PHONY: help setup run test test-oldest test-newest lint fuzz mutation bench movers lookalikes \
    pairs baselines pcl clean

help:
	@echo 'make run              render a sequence, or take BAG=path, and run the node on it'
	@echo '                      (ARGS=--register-depth where its depth is not registered)'
	@echo 'make test             run every test, style and types included (ARGS=... go to pytest;'
	@echo '                      JOBS=0 runs them in one process)'
	@echo 'make test-oldest      run the tests of the core with the oldest NumPy and OpenCV'
	@echo 'make test-newest      the same with the newest releases of everything'
	@echo 'make lint             check style and types: flake8, isort, mypy'
	@echo 'make fuzz             give damaged inputs to all that reads input, for SECONDS=600; what'
	@echo '                      fails is kept in fuzz_findings/'
	@echo 'make mutation         put defects into the core, one at a time, and count those that its'
	@echo '                      tests notice (ARGS="--mutants 30 --seed 0 --folder geometry")'
	@echo 'make bench            time a frame beside other methods, and name what got slower since the'
	@echo '                      last release (ARGS="--record RELEASE" adds this one)'
	@echo 'make movers           measure errors while objects move through the view, and name what got'
	@echo '                      worse since the last release (ARGS="--runs 3 --record RELEASE" adds'
	@echo '                      this one)'
	@echo 'make lookalikes       follow a camera through 100 rooms that repeat themselves, and fail where'
	@echo '                      a place is taken for another one (ARGS="--rooms 20 --first 9000")'
	@echo 'make pairs            register pairs of frames of the recordings in AICK_DATA and of two'
	@echo '                      rendered cameras, and fail where what is learned of one harms'
	@echo '                      them'
	@echo 'make setup            make .venv, which run, test and lint do by themselves'
	@echo '                      (PYTHON=python3.12 chooses the interpreter, 3.11 or newer)'
	@echo 'make baselines        install the other methods of aick benchmark, too (1 GB)'
	@echo 'make pcl              build those of PCL (needs libpcl-dev, cmake, g++)'
	@echo 'make clean            remove .venv and what was built'

setup: $(READY) $(TF2_MSGS)

export BAG
run: setup
	$(BIN)/aick demo $(if $(BAG),"$$BAG") $(ARGS)

test: setup
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(JOBS) --dist loadfile \
	    --no-loadscope-reorder $(ARGS)

# Environments of their own, with NumPy and OpenCV of Ubuntu 24.04, and with the newest releases.
# The viewer needs a newer NumPy than the oldest.
CORE := borders geometry settings features frames messages registration odometry sources
test-oldest:
	$(MAKE) test VENV=.venv-oldest PINS=requirements/oldest.txt EXTRAS=ros,eval,test \
	    ARGS='$(or $(ARGS),$(CORE:%=test/%))'
test-newest:
	$(MAKE) test VENV=.venv-newest PINS=requirements/newest.txt \
	    ARGS='$(or $(ARGS),$(CORE:%=test/%))'

lint: setup
	$(BIN)/python -m flake8
	$(BIN)/python -m isort --check-only --quiet .
	$(BIN)/python -m mypy aick_ros examples

SECONDS ?= 600
fuzz: setup
	OPENBLAS_NUM_THREADS=1 $(BIN)/python tools/fuzz --seconds $(SECONDS) $(ARGS)

mutation: setup
	$(BIN)/python -m pip install --quiet --constraint $(PINS) --no-build-isolation \
	    --editable '.[mutation]'
	OPENBLAS_NUM_THREADS=1 $(BIN)/python tools/mutation.py $(ARGS)

bench: setup
	$(BIN)/python benchmarks/speed.py $(ARGS)

movers: setup
	$(BIN)/python benchmarks/movers.py $(ARGS)

lookalikes: setup
	$(BIN)/python benchmarks/false_reuses.py $(ARGS)

pairs: setup
	$(BIN)/python benchmarks/pairs.py $(or $(ARGS),--frames 100 late:63 raw:64 \
	    $(dir $(wildcard $(AICK_DATA)/*/rgb.txt)))

baselines: setup
	$(BIN)/python -m pip install --quiet --constraint $(PINS) --no-build-isolation \
	    --editable '.[baselines]'

pcl:
	cmake -S benchmarks/pcl -B build/pcl
	cmake --build build/pcl

clean:
	rm -rf $(VENV) .venv-oldest .venv-newest build install log dist *.egg-info .pytest_cache \
	    aick_ros/*.so

# A set-up that was interrupted left the file `unfinished`: it is begun anew. Modules are compiled
# when they are imported first: to compile all of them takes as long as to install them.
$(READY): setup.py setup.cfg pyproject.toml $(PINS) $(wildcard src/kernels/*)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo '$(PYTHON) is missing or older than Python 3.11: name a newer one,' \
	           'make setup PYTHON=python3.12' >&2; exit 1; }
	@$(PYTHON) -c 'import os, shutil, sys, sysconfig; sys.exit(not (shutil.which( \
	    (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()[0]) and \
	    os.path.isfile(os.path.join(sysconfig.get_path("include"), "Python.h"))))' || \
	    { echo 'a C compiler or the headers of $(PYTHON) are missing: install them' \
	           '(Debian, Ubuntu: apt install gcc python3-dev)' >&2; exit 1; }
	@if [ -e $(UNFINISHED) ]; then rm -rf $(VENV); fi
	@mkdir -p $(VENV) && touch $(UNFINISHED)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --upgrade --constraint $(PINS) \
	    pip setuptools
	PYTHONWARNINGS=ignore::UserWarning $(BIN)/python -m pip install --quiet --no-compile \
	    --constraint $(PINS) --no-build-isolation --editable '.[$(EXTRAS)]'
	@mv $(UNFINISHED) $(READY) && touch $(READY)

# Without it everything works but the transforms: a missing compiler does not stop the set-up.
$(TF2_MSGS): $(READY) tools/make_messages.py
	@if $(BIN)/python tools/make_messages.py; then touch $@; fi
