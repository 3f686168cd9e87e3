# `make demo` and `make test` are all a fresh machine needs; both first run scripts/bootstrap.sh.
# ARGS passes options on:  make evaluate ARGS="--policy blind --scenario opaque --episodes 50"

VENV := .venv/bin
ARGS :=

.PHONY: help demo test test-core test-newest coverage clients lint docs wheel evaluate golden bench soak kills full_disk doctor core full lock clean

demo: core  # film the robot in several scenarios
	$(VENV)/fixation-gym demo $(ARGS)

help:  # this list
	@awk -F ':[^#]*# *' '/^[a-z][a-z_ -]*:[^#]*#/ {printf "%-22s %s\n", $$1, $$2}' Makefile

test: full  # all tests, on up to four cores
	$(VENV)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile $(ARGS)

test-core: full  # tests that need no simulator
	$(VENV)/pytest -m "not sim" $(ARGS)

# Compiled functions are left out: their lines run as machine code. So are worker processes.
coverage: full  # all tests, and which lines they reach
	$(VENV)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile --cov --cov-report term:skip-covered $(ARGS)

# The environments once more on the newest MuJoCo that was tried; it is put beside .venv and comes first on the path.
NEWEST_MUJOCO := 4.0.0
test-newest: full  # tests of the environments on the newest MuJoCo
	$(VENV)/uv pip install --quiet --target .venv/newest --no-deps mujoco==$(NEWEST_MUJOCO) mujoco-core==$(NEWEST_MUJOCO)
	PYTHONPATH=.venv/newest $(VENV)/pytest --numprocesses auto --maxprocesses 4 --dist loadfile tests/envs $(ARGS)

# Programs that use the environments under other libraries, each installed beside .venv: half an hour, 10 GB. For nights.
clients: full  # programs of other libraries
	$(VENV)/python tests/clients/run.py $(ARGS)

lint: full  # ruff and pyright
	$(VENV)/ruff check .
	$(VENV)/ruff format --check .
	$(VENV)/pyright

# The documentation site, in out/site/index.html; a link or a name that leads nowhere is an error.
docs: core  # these pages as a site, links checked
	$(VENV)/uv pip install --quiet --constraint constraints.txt --editable '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(VENV)/mkdocs build --quiet

# What a user gets: the wheel by plain pip, in an environment of its own, tried from a folder that has nothing else.
wheel: core  # build the wheel and try it in a fresh environment
	rm -rf out/wheel
	$(VENV)/uv build --quiet --wheel --out-dir out/wheel
	$(VENV)/python -m venv out/wheel/env
	out/wheel/env/bin/pip install --quiet out/wheel/*.whl
	cd out/wheel && env/bin/fixation-gym doctor && env/bin/fixation-gym evaluate --policy random --scenario clear \
	    --episodes 1 --out evaluation

evaluate: core  # a policy over scenarios and seeds
	$(VENV)/fixation-gym evaluate $(ARGS)

# Runs 280 episodes of the servo and compares them with tests/golden/servo.csv; takes 12 minutes on two cores. The
# scenes of bin have changed since.
GOLDEN := clear,opaque,translucent,mirror,line_of_sight,moving_obstacle,moving_target,distractor,mixed,screen
golden: core  # compare the servo with recorded episodes, 12 minutes
	$(VENV)/fixation-gym evaluate --policy servo --scenario $(GOLDEN),screen_coloured,shelf,clutter,discovery \
	    --seed 954 --episodes 20 --workers 2 --out out/golden
	$(VENV)/python tests/golden/compare.py out/golden

bench: core  # time every stage, and the peers it is compared with
	$(VENV)/uv pip install --quiet --constraint constraints.txt --editable '.[bench]'
	$(VENV)/fixation-gym bench $(ARGS)

# What docs/reliability.md reports: random actions, kill -9 of every command, a disk that gets full (as root).
soak kills full_disk: full  # reliability, hours
	$(VENV)/python tests/reliability/$@.py --out out/$@ $(ARGS)

doctor: core  # check the installation
	$(VENV)/fixation-gym doctor

core full:  # install what demo needs, or everything
	@scripts/bootstrap.sh $@

# Versions in constraints.txt stay as they are while they fit pyproject.toml; delete the file to take the newest.
# One file serves Python 3.10 to 3.12. uv also writes the packages that [tool.uv] switches off: take them out.
lock: full  # write constraints.txt
	cp constraints.txt constraints.tmp || true
	sed -n 's/^TORCH_VERSION=/torch==/p' scripts/bootstrap.sh | $(VENV)/uv pip compile pyproject.toml --constraint - \
	    --universal --python-version 3.10 --extra rl --extra export --extra ros --extra fetch --extra viz --extra photoreal --extra cluster --extra bench --extra docs --extra dev --no-emit-package setuptools \
	    --no-annotate --no-header --quiet --output-file constraints.tmp >/dev/null
	{ echo "# All versions, for Python 3.10 to 3.12 and every extra. Regenerate with: make lock"; \
	  grep -v -e "'never'" -e '^#' constraints.tmp; } >constraints.txt
	rm constraints.tmp

clean:  # remove .venv and all results
	rm -rf .venv build out *.egg-info .pytest_cache .ruff_cache
