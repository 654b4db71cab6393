"""The two plots of docs/parity.md.

    python benchmarks/parity_plots.py docs/images

How an error grows with the same pushes on both sides, with its predicted bound; and what each
integrator does to the energy of a pole that swings freely.
"""

import argparse
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

from mjcartpole.files import make_folder
from mjcartpole.physics import linear
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject
from mjcartpole.studies.parity.convergence import METHODS, energy_track
from mjcartpole.studies.parity.dynamics import EPS
from mjcartpole.studies.parity.trajectories import error_growth


def plot_growth(subject: Subject, path: Path) -> None:
    """Errors of twenty open-loop episodes, eps rho^t, and the bound."""
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    runs = [error_growth(subject, seed) for seed in range(20)]
    for run in runs:
        steps = np.arange(1, len(run.error) + 1)
        axes.semilogy(steps, np.maximum(run.error, EPS / 4), color="tab:blue", lw=0.6, alpha=0.6)
    longest = max(runs, key=lambda run: len(run.error))
    steps = np.arange(1, len(longest.error) + 1)
    rho = linear.spectral_radius(subject.reference, "gym")
    axes.semilogy([], [], color="tab:blue", label="measured, 20 episodes")
    axes.semilogy(steps, EPS * rho**steps, "k--", lw=1, label=f"eps rho^t, rho = {rho:.4f}")
    axes.semilogy(steps, longest.predicted, color="tab:red", lw=1, label="predicted bound")
    axes.set(
        xlabel="control step",
        ylabel="largest difference of the two states",
        title="The same pushes: MuJoCo and gymnasium's CartPole-v1 drift apart",
        ylim=(EPS / 4, 10),
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def plot_energy(subject: Subject, path: Path) -> None:
    """Energy of a free swing over time, for each integrator."""
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    p = subject.reference
    for name, (integrator, option, _) in METHODS.items():
        energy = energy_track(subject, integrator, option)
        gained = (energy - energy[0]) / (p.pole_mass * p.gravity * p.com_distance)
        axes.plot(np.arange(len(energy)) * p.timestep, gained, label=name)
    axes.set(
        xlabel="time, s",
        ylabel="energy gained, in m g l",
        title="A free swing at 0.02 s: explicit Euler pumps energy",
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Make both plots."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = make_folder(parser.parse_args().folder)
    mpl.use("agg")
    subject = Subject(load_model("cartpole"))
    plot_growth(subject, folder / "parity_growth.png")
    plot_energy(subject, folder / "parity_energy.png")


if __name__ == "__main__":
    main()
