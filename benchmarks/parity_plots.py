"""The two plots of docs/parity.md.

    python benchmarks/parity_plots.py docs/images

How an error grows with the same pushes on both sides, with its predicted bound; and what each
integrator does to the energy of a pole that swings freely.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjcartpole.files import make_folder
from mjcartpole.media.palette import CURVES, INK
from mjcartpole.media.plots import css, plot_style, write_plot
from mjcartpole.physics import linear
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject
from mjcartpole.studies.parity.convergence import METHODS, energy_track
from mjcartpole.studies.parity.rounding import EPS
from mjcartpole.studies.parity.trajectories import error_growth

MEASURED, BOUND = (css(colour) for colour in CURVES[:2])


@plot_style()
def plot_growth(subject: Subject) -> Figure:
    """Plot the errors of twenty open-loop episodes, eps rho^t, and the bound."""
    figure, axes = _empty()
    runs = [error_growth(subject, seed) for seed in range(20)]
    for run in runs:
        steps = np.arange(1, len(run.error) + 1)
        axes.semilogy(steps, np.maximum(run.error, EPS / 4), color=MEASURED, lw=0.6, alpha=0.6)
    longest = max(runs, key=lambda run: len(run.error))
    steps = np.arange(1, len(longest.error) + 1)
    rho = linear.spectral_radius(subject.reference, "gym")
    axes.semilogy([], [], color=MEASURED, label="measured, 20 episodes")
    axes.semilogy(
        steps, EPS * rho**steps, "--", color=css(INK), lw=1, label=f"eps rho^t, rho = {rho:.4f}"
    )
    axes.semilogy(steps, longest.predicted, color=BOUND, lw=1, label="predicted bound")
    axes.set(
        xlabel="control step",
        ylabel="largest difference of the two states",
        title="The same pushes: MuJoCo and CartPole-v1 drift apart",
        ylim=(EPS / 4, 10),
    )
    axes.legend(fontsize=8)
    return figure


@plot_style()
def plot_energy(subject: Subject) -> Figure:
    """Plot the energy of a free swing over time, for each integrator."""
    figure, axes = _empty()
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
    return figure


def _empty() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(7.7, 4.4), layout="constrained")
    return figure, figure.add_subplot()


def main() -> None:
    """Make both plots."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = make_folder(parser.parse_args().folder)
    subject = Subject(load_model("cartpole"))
    write_plot(plot_growth(subject), folder / "parity_growth.png")
    write_plot(plot_energy(subject), folder / "parity_energy.png")


if __name__ == "__main__":
    main()
