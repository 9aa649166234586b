# Everything runs in .venv, which the first target that needs it makes.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
# Who has no tests left takes those of another: what belongs together stays together.
WORKERS := -n auto --dist worksteal
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# What is compiled to bytecode once is not compiled by every process anew, also where containers say so.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: rush-hour explained capacity radio availability sakai takaoka test deep check in-turn format lint types contracts bench benchmark seeds map yizhuang terminals interval driving steps limits reserve losses approach stress sensitivity variance fuzz kills mutants results docs clean

# A target makes its results anew: after an edit of the program earlier runs are refused.
rush-hour: $(READY)
	$(BIN)/python run.py scenarios/rush_hour --fresh $(RUSH_HOUR)

# Is what is said of random stops of the rush hour true? Compared with the raw tables.
explained: rush-hour
	$(BIN)/python -m tools.explained_stops out/rush_hour

# Headways, blocking times and occupation under five protections; writes out/rush_hour_capacity/.
capacity: $(READY)
	$(BIN)/python run.py capacity scenarios/rush_hour --simulate all \
		--controller close_up --controller atc --controller atd --controller d_atc --controller relative_braking

# What the trains of an earlier rush hour ask of the radio; writes out/rush_hour_radio/.
radio: $(READY)
	test -f out/rush_hour/summary.csv || $(BIN)/python run.py scenarios/rush_hour --fresh
	$(BIN)/python run.py radio scenarios/rush_hour

# Failures, availability and fault tree; writes out/control_map_availability/.
availability: $(READY)
	$(BIN)/python run.py availability scenarios/control_map

# The case study of Sakai et al. 2020: one sweep for each of its three cases.
sakai: $(READY)
	$(BIN)/python run.py scenarios/sakai_case1 --fresh
	$(BIN)/python run.py scenarios/sakai_case2 --fresh
	$(BIN)/python run.py scenarios/sakai_case3 --fresh

# Multi-step ATC against ATD, and energy-saving driving: the examples of Takaoka et al. 1991.
takaoka: $(READY)
	$(BIN)/python run.py scenarios/atd_headway --fresh
	$(BIN)/python run.py scenarios/eco_driving --fresh

test: $(READY)
	$(BIN)/python -m pytest $(WORKERS)

# The same with all examples of every property and all figures.
deep: $(READY)
	$(BIN)/python -m pytest $(WORKERS) --deep

# The rush hour beside the rest: it compiles, in one process, what the tests find compiled then.
check: $(READY)
	$(MAKE) --jobs 2 explained in-turn RUSH_HOUR="--jobs 1"

in-turn: $(READY)
	$(MAKE) lint
	$(MAKE) contracts
	$(MAKE) types
	$(MAKE) docs
	$(MAKE) test

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(READY)
	$(BIN)/mypy

contracts: $(READY)
	$(BIN)/lint-imports

# Speed beside bare SUMO; writes out/bench.json.
bench: $(READY)
	$(BIN)/python -m tools.bench

# All shipped controllers on the fixed suites, under one core-hour; goes on where it was ended.
# Writes out/benchmark/ and the table of docs/benchmark.md. Computing time is what `bench` measures.
benchmark: $(READY)
	$(BIN)/python -m tools.benchmark_table

# Forty mornings on two lines, for means and confidence intervals; goes on where it was ended.
seeds: $(READY)
	$(BIN)/python run.py across scenarios/rush_hour scenarios/yizhuang --seeds 40 --step 0.5 \
		--controller close_up --controller two_stage --out out/seeds

# Five mornings under the control map, beside trains that are driven alike; goes on where it was ended.
map: $(READY)
	$(BIN)/python run.py scenarios/rush_hour --seeds 5 --step 0.5 --out out/map \
		--controller close_up_planned --controller two_stage_planned --controller control_map

# The stochastic approach on two lines, on mornings that nothing was chosen by; writes out/approach/.
approach: $(READY)
	$(BIN)/python run.py across scenarios/rush_hour scenarios/yizhuang --seed 101 --seeds 20 --step 0.5 \
		--controller close_up --controller two_stage --controller stochastic_approach \
		--controller stochastic_eco --controller stochastic_firm --controller clairvoyant --out out/approach

# The stochastic approach where it is told the wrong thing; writes out/stress/.
stress: $(READY)
	$(BIN)/python -m tools.stress

# The second line under every controller.
yizhuang: $(READY)
	$(BIN)/python run.py scenarios/yizhuang --fresh

# How close trains can turn back at a terminal, by the number of its platform tracks.
terminals: $(READY)
	$(BIN)/python -m tools.terminals

# Time and energy of ways of driving; writes out/driving.md.
driving: $(READY)
	$(BIN)/python -m tools.driving_energy

# From a departure to the next arrival at Akabane, beside what was measured; writes out/station_interval.md.
interval: $(READY)
	$(BIN)/python -m tools.station_interval

# How the indicators depend on the step.
steps: $(READY)
	$(BIN)/python -m tools.steps

# How the gain depends on the longest dwell delay.
limits: $(READY)
	$(BIN)/python -m tools.limits

# What the reserve of the control map brings and costs.
reserve: $(READY)
	$(BIN)/python -m tools.reserve

# What lost telegrams cost under the control map and under the moving block by radio.
losses: $(READY)
	$(BIN)/python -m tools.losses

# Which doubtful assumption of the rush hour decides; goes on where it was ended.
sensitivity: $(READY)
	$(BIN)/python -m tools.sensitivity

# Widths of intervals where seeds share draws, at equal cost; writes out/variance.md, goes on where it was ended.
variance: $(READY)
	$(BIN)/python -m tools.variance

# Harmed scenario folders by the thousand: no traceback, no hang, no unsafe run.
fuzz: $(READY)
	$(BIN)/python -m tools.fuzz

# Kills studies and their workers at random moments; fails if a finished run is lost, or any byte is another one.
kills: $(READY)
	$(BIN)/python -m tools.kills
	$(BIN)/python -m tools.study_kills

# Faults that are put into a copy of the source: each one has to be seen in a run.
mutants: $(READY)
	$(BIN)/python -m tools.mutants

# Writes the result tables and figures of the documentation from out/.
results: $(READY)
	$(BIN)/python -m tools.results

# The documentation as HTML, tutorials run; writes out/docs/. A warning is an error.
docs: $(READY)
	$(BIN)/sphinx-build --builder html --fail-on-warning --keep-going --quiet --jobs auto docs out/docs

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@

clean:
	rm -rf .venv out
