# make demo | test | check | bench: each sets up .venv first, once.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.set-up
BARE := .venv-bare
OTHER := .venv-other
LOWEST := .venv-lowest
INTEROP := .venv-interop
RAY := .venv-ray
# The interpreter to use; empty: CPython 3.11 if there is one, else the newest of 3.12 to 3.14.
PYTHON ?=
# More for pytest, as in `make test ARGS='-k lattice -x'`.
ARGS ?=
DEMO ?= demo
MINI := internav_data/dataset/mini

.PHONY: help
help: ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

define NO_PYTHON
No CPython 3.11 to 3.14 that can make virtual environments was found (looked for python3.11,
python3.14, python3.13, python3.12, python3 and python on PATH).

Install one      apt install python3-venv | brew install python | pyenv install 3.13 |
                 uv python install 3.13 | conda create -n internav python=3.13
and run make again, or name one: make PYTHON=/path/to/python3.13
endef
export NO_PYTHON

# Finds $python, makes the virtual environment $(1) with it unless there is a working one.
# 3.11 comes first, as both physics engines have wheels for it; then the newest.
define VIRTUAL_ENVIRONMENT
python="$(PYTHON)"; \
for candidate in python3.11 python3.14 python3.13 python3.12 python3 python; do \
  if [ -z "$$python" ] && "$$candidate" -c \
    'import ensurepip, sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' \
    >/dev/null 2>&1; then \
    python=$$candidate; \
  fi; \
done; \
if [ -z "$$python" ]; then echo "$$NO_PYTHON" >&2; exit 1; fi; \
if ! "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then \
  echo "PYTHON=$$python is not a Python of version 3.11 or above" >&2; exit 1; \
fi; \
if ! $(1)/bin/python -m pip --version >/dev/null 2>&1; then \
  "$$python" -m venv --clear $(1); \
fi
endef

$(STAMP): pyproject.toml constraints.txt
	@$(call VIRTUAL_ENVIRONMENT,$(VENV)); \
	echo "Setting up $(VENV) with $$($(BIN)/python --version); about a minute, once ..." >&2; \
	$(BIN)/python -m pip install -qq --disable-pip-version-check --no-input \
	  --constraint constraints.txt --editable '.[dev]'; \
	touch $(STAMP)

.PHONY: setup
setup: $(STAMP) ## only set up .venv

.PHONY: demo
demo: $(STAMP) ## make a small dataset, prove it right, draw it: about three minutes
	$(BIN)/internav-data demo --out $(DEMO)

.PHONY: mini
mini: $(STAMP) ## make the small dataset that ships with the package again
	rm -rf $(MINI)
	$(BIN)/internav-gen generate --out $(MINI) --scenes 40 --episodes-per-scene 10 --physics mujoco
	$(BIN)/internav-gen validate $(MINI) --level physics

DEMO_HOUSES := --rooms 1 --set 'episodes.max_obstacles=[2,2,2]'
DEMO_TRAIN := --device cpu --preset small --method ppo --pretrain bc --steps 65536 \
  --set network.observation=map --set cloning.frames=80000 --set cloning.epochs=1 \
  --set ppo.critic_warmup_rollouts=4 --set ppo.update_epochs=2 --set ppo.ent_coef=0.003 \
  --set run.max_steps=150 --set run.validate_every=0
DEMO_MEASURE := --split all --max-steps 150 --force --no-reference-policies

.PHONY: demo-train
demo-train: $(STAMP) ## see an agent learn on 128 small houses: about five minutes
	$(BIN)/internav-gen generate --out $(DEMO)/houses --scenes 128 --episodes-per-scene 10 $(DEMO_HOUSES)
	$(BIN)/internav-gen generate --out $(DEMO)/unseen --scenes 32 --episodes-per-scene 4 $(DEMO_HOUSES) --seed 1
	rm -rf $(DEMO)/agent
	$(BIN)/camp-train $(DEMO)/houses --out $(DEMO)/agent $(DEMO_TRAIN) --stages cloning
	$(BIN)/camp-eval $(DEMO)/agent $(DEMO)/unseen $(DEMO_MEASURE) --out $(DEMO)/cloned >/dev/null
	$(BIN)/camp-train $(DEMO)/houses --out $(DEMO)/agent --resume --stages single,all
	$(BIN)/camp-eval $(DEMO)/agent $(DEMO)/unseen $(DEMO_MEASURE) --out $(DEMO)/trained --video >/dev/null
	$(BIN)/camp-eval compare $(DEMO)/cloned $(DEMO)/trained --dataset $(DEMO)/unseen --force \
	  --out $(DEMO)/learnt
	$(BIN)/python examples/draw_curve.py $(DEMO)/agent --out $(DEMO)/curve.png >/dev/null
	@echo
	@echo "Look at   $(DEMO)/curve.png: success while it learns"
	@echo "          $(DEMO)/trained/report.html: tables, curves, where it went"
	@echo "Watch     $(DEMO)/trained/videos: what it saw and meant, step by step"

TESTS := -q -m 'not slow and not learning' -n 2 --dist loadfile --max-worker-restart 1

.PHONY: test
test: $(STAMP) ## run the tests (not the slow campaigns); COVERAGE=1 prints what they cover a room
ifdef COVERAGE
	rm -rf build/coverage && mkdir -p build/coverage
	$(BIN)/coverage run -m pytest $(TESTS) $(ARGS)
	$(BIN)/coverage combine --quiet
	$(BIN)/python docs/covered.py
else
	$(BIN)/python -m pytest $(TESTS) $(ARGS)
endif

.PHONY: test-slow
test-slow: $(STAMP) ## run the slow campaigns
	$(BIN)/python -m pytest -q -m slow -o faulthandler_timeout=7200 $(ARGS)

.PHONY: test-learning
test-learning: $(STAMP) ## see every learner learn, two at a time: about three minutes
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -q -m learning -n 2 --dist load $(ARGS) tests/camp

# All rows, one after the other, if none is named.
ROW ?=
BUDGET ?= 2h

.PHONY: torture
torture: $(STAMP) ## break runs and files in very many ways: make torture ROW=faults BUDGET=2h
	nice $(BIN)/python tests/torture --row '$(ROW)' --budget $(BUDGET) $(ARGS)

.PHONY: test-bare
test-bare: ## run the loader's tests with nothing but numpy and pyarrow installed
	@$(call VIRTUAL_ENVIRONMENT,$(BARE)); \
	$(BARE)/bin/python -m pip install -qq --disable-pip-version-check --no-input \
	  --constraint constraints.txt --editable . pytest hypothesis
	$(BARE)/bin/python -m pytest -q $(ARGS) tests/test_import.py tests/dataset \
	  --ignore tests/dataset/test_json_schemas.py -k 'not (pandas or duckdb or polars)'

OTHER_TESTS := tests/physics tests/generation tests/dataset tests/core tests/test_import.py

.PHONY: test-other
test-other: ## run tests of physics, generation and the loader with PYTHON=another, without torch
	@$(call VIRTUAL_ENVIRONMENT,$(OTHER)); \
	$(OTHER)/bin/python -m pip install -qq --disable-pip-version-check --no-input \
	  --constraint constraints.txt --editable '.[generate,meshes]' \
	  gymnasium hypothesis jsonschema psutil pytest pytest-xdist
	$(OTHER)/bin/python -m pytest $(TESTS) -k 'not (pandas or duckdb or polars)' $(ARGS) $(OTHER_TESTS)

.PHONY: test-interop
test-interop: ## the newest datasets, mlcroissant and huggingface_hub read and send what we write; buckets by moto
	@$(call VIRTUAL_ENVIRONMENT,$(INTEROP)); \
	$(INTEROP)/bin/python -m pip install -qq --disable-pip-version-check --no-input --upgrade \
	  --editable '.[generate]' pytest hypothesis datasets huggingface_hub mlcroissant 'moto[server]' pyyaml
	$(INTEROP)/bin/python -m pytest -q $(ARGS) tests/interop tests/dataset/test_hugging_face.py \
	  tests/generation/test_object_store.py

.PHONY: test-ray
test-ray: ## a Ray cluster of two nodes on this machine makes the bytes of processes; skipped where Ray has no wheel
	@$(call VIRTUAL_ENVIRONMENT,$(RAY)); \
	$(RAY)/bin/python -m pip install -qq --disable-pip-version-check --no-input \
	  --constraint constraints.txt --editable '.[generate]' pytest hypothesis jsonschema pyyaml; \
	if ! $(RAY)/bin/python -m pip install -qq --disable-pip-version-check --no-input --only-binary ray \
	  --editable '.[generate,ray]'; then \
	  echo "Ray cannot be installed on $$($(RAY)/bin/python --version) here: its tests are skipped" >&2; \
	fi; \
	$(RAY)/bin/python -m pytest -q $(ARGS) tests/generation/test_ray.py tests/generation/test_executors.py

LOWEST_TESTS := tests/dataset/test_loader.py tests/dataset/test_stream.py tests/core \
  tests/geometry tests/catalog tests/evaluation/test_statistics.py tests/verification/test_mutations.py \
  tests/cli/test_commands.py tests/envs/test_copies.py tests/camp/test_networks.py tests/camp/test_stages.py

.PHONY: test-lowest
test-lowest: ## run a part of every room's tests with the lowest versions that pyproject.toml allows
	@$(call VIRTUAL_ENVIRONMENT,$(LOWEST)); \
	$(LOWEST)/bin/python -m pip install -qq --disable-pip-version-check --no-input \
	  --constraint constraints-lowest.txt --editable '.[all]' \
	  hypothesis jsonschema psutil pytest pytest-xdist
	$(LOWEST)/bin/python -m pytest $(TESTS) -k 'not (pandas or duckdb or polars)' $(LOWEST_TESTS) $(ARGS)

.PHONY: wheels
wheels: $(STAMP) ## ask the package index for wheels, each platform and Python; downloads 5 GB
	$(BIN)/python -m pytest -q -m slow -o faulthandler_timeout=7200 $(ARGS) tests/test_wheels.py

.PHONY: docs
docs: $(STAMP) ## build the documentation's site into build/docs; a warning is an error
	rm -rf build/docs docs/reference # Sphinx repeats no warning of a page that it does not read again
	$(BIN)/python -m sphinx -b html -W --keep-going -q docs build/docs
	@echo "Look at   build/docs/index.html"

.PHONY: wheel-test
wheel-test: $(STAMP) ## build wheel and sdist, try the wheel in an environment of its own; ARGS=quick
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	.ci/try-wheel $(BIN)/python dist/*.whl $(ARGS)

.PHONY: bench
bench: $(STAMP) ## run the benchmarks: JSON into bench-results/
	@mkdir -p bench-results
	$(BIN)/python benchmarks/compare.py --out bench-results/compare.json >/dev/null
	$(BIN)/python benchmarks/generation.py > bench-results/generation.json
	$(BIN)/python benchmarks/loader.py > bench-results/loader.json
	$(BIN)/python benchmarks/houses.py --out bench-results/houses.json
	$(BIN)/python benchmarks/table2.py > bench-results/table2.json
	$(BIN)/python benchmarks/confounding.py --rate --out bench-results/confounding.json >/dev/null
	for room in navigation verification world camera expert holds; do \
	  $(BIN)/python benchmarks/$$room.py > bench-results/$$room.json; \
	done
	$(BIN)/internav-gen generate --out bench-results/dataset --scenes 24 --episodes-per-scene 5
	$(BIN)/python benchmarks/envs.py bench-results/dataset > bench-results/envs.json
	$(BIN)/python benchmarks/trainer.py bench-results/dataset > bench-results/trainer.json
	@echo "Results: bench-results/*.json"

.PHONY: check
check: $(STAMP) ## lint, format, types, layers, language, schemas
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(BIN)/python docs/check_language.py
	$(BIN)/internav-gen schema --out build/schemas
	diff -r schemas build/schemas

.PHONY: size
size: $(STAMP) ## print lines of code a room
	$(BIN)/python docs/size.py

.PHONY: format
format: $(STAMP) ## mend what ruff can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

.PHONY: clean
clean: ## remove what was built here (not .venv)
	rm -rf build dist docs/reference bench-results $(DEMO) .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find internav_data cli tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
