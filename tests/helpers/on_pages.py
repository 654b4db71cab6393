"""Commands on the pages of the documentation that a test does not run as they stand."""

NOT_HERE = {
    "make page": "it loads packages from an index",
    "make test": "it is the suite that this test belongs to",
    '.venv/bin/python -m pytest -q -m "not slow and not long"': "the same",
    "make docs": "it loads packages from an index; tests/test_site.py builds the site",
    "python3 -m venv .venv": "the test brings an environment that is set up",
    ".venv/bin/pip install -e '.[dev]'": "it loads packages from an index",
    "pip install 'mjcartpole[tensorboard]'": "it loads packages from an index",
    "pip install 'mjcartpole[plot]'": "it loads packages from an index",
    "pip install 'mjcartpole[dask]'": "it loads packages from an index",
    "pip install dask-jobqueue": "it loads packages from an index",
    "pip install mjcartpole": "it loads packages from an index",
    "pip install mujoco gymnasium numpy": "it loads packages from an index",
    "pip install --no-deps mjcartpole": "it loads packages from an index",
    "pip install 'mjcartpole[deep]'": "it loads packages from an index",
    "pip install --editable .": "it loads packages from an index",
    "make constraints": "it loads packages from an index",
    "python benchmarks/deep.py": "it needs PyTorch, and hours",
    "python benchmarks/kills.py": "it needs Dask; test_cluster.py does the like",
    "mjcartpole study docs/study.toml --scheduler tcp://127.0.0.1:8786": "it needs a scheduler",
}
"""Commands that are not run, and why."""

SCALED = {
    r"(?<=benchmarks/learners.py)(.* --seeds) \d+": r"\1 1",
    r"(?<=benchmarks/deep.py)(.* --seeds) \d+": r"\1 1",
    r"(?<=benchmarks/methods.py)(.* --seeds) \d+ --plot \S+": r"\1 1 --methods sarsa",
    r"(?<=benchmarks/robustness.py)(.* --seeds) \d+": r"\1 1",
    r"(?<=^mjcartpole train --backend gym --seeds) 2000": " 2",
    r"(?<=--episodes 20000)(.* --seeds) 10": r"\1 1",
    r"--starts \d+$": "--starts 50",
    r"^make bench$": "make bench ARGS=--quick",
    r"(?<=^python -m benchmarks.bench) (?=--json)": " --quick --only start ",
    r"(?<=--speed 0.25) (?=-o slow.webp)": " --size 160x120 ",
    r"for _ in range\(5\)": "for _ in range(1)",
    r"^mjcartpole study (docs/studies/\w+\.toml)$": (
        r"sed -i 's/^seeds = .*/seeds = 1/; s/, 48000, 192000//' \1 && mjcartpole study \1"
    ),
    r"--episodes 192000": "--episodes 2000",
    r"(?<=^python benchmarks/study.py)$": " --runs 2 --turns 1",
}
"""What takes many minutes, by the same code over fewer seeds, repeats or pixels."""

PICTURES = {
    "mjcartpole plot curve runs/tuned-mujoco-seed0 runs/tuned-gym-seeds0-4": {
        "docs/images/plot_curve.png": "plots/tuned-mujoco-seed0-and-1-other-curve.png",
    },
    "mjcartpole plot table runs/tuned-mujoco-seed0": {
        "docs/images/plot_table.png": "plots/tuned-mujoco-seed0-table.png",
    },
    "mjcartpole plot basin runs/tuned-mujoco-seed0": {
        "docs/images/plot_basin.png": "plots/tuned-mujoco-seed0-basin.png",
    },
    "mjcartpole transfer runs/tuned-mujoco-seed0 --sweep pole.length=1:31:2": {
        "docs/images/sweep_length.png": "transfer/sweep-pole.length.png",
    },
    "mjcartpole transfer runs/tuned-mujoco-seed0 runs/braked --sweep hinge.damping=0:1:0.1": {
        "docs/images/sweep_damping.png": "transfer/sweep-hinge.damping.png",
    },
    "python benchmarks/parity_plots.py docs/images": {
        "docs/images/parity_growth.png": "docs/images/parity_growth.png",
        "docs/images/parity_energy.png": "docs/images/parity_energy.png",
    },
}
"""Plots that pages show, and what a command has made of each."""
