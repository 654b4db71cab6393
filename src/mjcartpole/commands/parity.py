"""`mjcartpole parity`."""

import dataclasses
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from mjcartpole.commands.bar import Bar
from mjcartpole.commands.options import Command
from mjcartpole.files import check_writable, make_folder, write_whole

if TYPE_CHECKING:
    from mjcartpole.studies.parity import Figure, Result, Subject

QUESTIONS = {
    "cartpole-v1": "Is {} CartPole-v1?",
    "itself": "Does MuJoCo move {} as the equations with its own parameters do?",
}
MOVES = {"cartpole-v1": "CartPole-v1", "itself": "its own equations say"}
VERDICTS = {"holds": "holds", "fails": "FAILS", "beyond": "BEYOND", "skipped": "skipped"}


@dataclass(frozen=True)
class Parity(Command):
    """Hold MuJoCo against CartPole-v1, rung by rung."""

    model: str = "cartpole"
    """A shipped model's name or an MJCF file."""
    set: tuple[str, ...] = ()
    """Edits of the model, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    against: Literal["cartpole-v1", "itself"] = "cartpole-v1"
    """cartpole-v1: is this model CartPole-v1? itself: does MuJoCo move it as its equations do?"""
    rungs: tuple[int, ...] = tuple(range(1, 11))
    """Which rungs of the ladder."""
    quick: bool = False
    """Fewer samples."""
    strict: bool = False
    """Exit with 1 also where the motion holds and the model's numbers are not CartPole-v1's."""
    json: Path | None = None
    """Write every figure to this file."""

    def run(self) -> int:
        """Climb the ladder and print each rung as it is found; return the exit code.

        It is 0 where the motion holds (with `strict`, where no number differs either), else 1.
        """
        from mjcartpole.physics.load import load_model
        from mjcartpole.physics.simulation import silence_mujoco
        from mjcartpole.studies.parity import Subject
        from mjcartpole.studies.parity.ladder import check_rungs

        silence_mujoco()
        check_rungs(self.rungs)
        cartpole = load_model(self.model, self.set, own_timestep=True)
        subject = Subject(cartpole, self.against, self.quick)
        # A model whose parameters cannot be read is the user's mistake: better known before work.
        _ = subject.numbers
        if self.json:
            check_writable(make_folder(self.json.parent))
        results = self._climb(subject)
        holds = all(result.verdict in {"holds", "skipped"} for result in results)
        _print_motion(subject, results, holds)
        _print_numbers(subject, holds)
        if self.json:
            report = json.dumps(_report(subject, results, holds), indent=2, allow_nan=False)
            write_whole(self.json, report + "\n")
            print(f"\nreport {self.json}")
        return 0 if holds and not (self.strict and subject.numbers) else 1

    def _climb(self, subject: "Subject") -> "list[Result]":
        from mjcartpole.studies.parity import run_ladder

        question = QUESTIONS[self.against].format(subject.cartpole.name)
        print(question + (" (quick)" if self.quick else ""))
        if subject.region.bounds:
            print(f"  asked where it moves freely; outside: {'; '.join(subject.region.bounds)}")
        if subject.solves_to_the_end:
            print("  dry friction is solved to the end, not to the file's solver tolerance")
        results: list[Result] = []
        ladder = run_ladder(subject, self.rungs)
        while (result := _next_result(ladder)) is not None:
            results.append(result)
            _print_result(result)
        return results


def _next_result(ladder: "Iterator[Result]") -> "Result | None":
    with Bar(lambda: "climbing …"):
        return next(ladder, None)


def _print_result(result: "Result") -> None:
    print(f"\n{result.rung:2d}  {VERDICTS[result.verdict]:8s} {result.title}")
    if result.skipped:
        print(f"     {result.skipped}")
    for figure in result.figures:
        print(f"     {figure.name:52s} {_number(figure.value):>10s} {_bound(figure)}")
    for line in (*result.problems, *result.story):
        print(f"     ! {line}")
    if not result.skipped:
        print(f"     because: {result.reason}")


def _number(value: float) -> str:
    whole = abs(value) < 1e7 and value == round(value)
    return f"{value:.0f}" if whole else f"{value:.4g}"


def _bound(figure: "Figure") -> str:
    """Return the bound in words; a figure without one is only reported."""
    if figure.bound is None:
        return figure.unit
    relation = "≥" if figure.at_least else "≤"
    mark = "" if figure.holds else "   <- out of bounds"
    return f"{relation} {_number(figure.bound)} {figure.unit}".rstrip() + mark


def _print_motion(subject: "Subject", results: "list[Result]", holds: bool) -> None:
    failed = [str(r.rung) for r in results if r.verdict in {"fails", "beyond"}]
    skipped = [str(r.rung) for r in results if r.verdict == "skipped"]
    ending = f"; skipped: {', '.join(skipped)}" if skipped else ""
    name = subject.cartpole.name
    if holds:
        verdict = f"all rungs hold ({len(results) - len(skipped)}){ending}"
        moves = f": it moves as {MOVES[subject.against]}" if len(skipped) < len(results) else ""
        print(f"\nmotion   {name}: {verdict}{moves}")
        return
    print(f"\nmotion   {name}: does not hold on rung {', '.join(failed)}{ending}")
    for cause in subject.beyond if subject.against == "itself" else ():
        print(f"  {cause}")


def _print_numbers(subject: "Subject", holds: bool) -> None:
    """Say whether the document's numbers are CartPole-v1's, whatever the motion."""
    if subject.against == "itself":
        print("numbers  its own, as the compiled model has them")
    elif not subject.numbers:
        print("numbers  CartPole-v1's own")
    else:
        moves = "moves as CartPole-v1, with other numbers" if holds else "other numbers"
        print(f"numbers  {moves}:")
        for phrase in subject.numbers:
            print(f"  {phrase}")


def _report(subject: "Subject", results: "list[Result]", holds: bool) -> dict[str, Any]:
    from mjcartpole.learning.runs import versions

    return {
        "model": subject.cartpole.name,
        "against": subject.against,
        "quick": subject.quick,
        "holds": holds,
        "causes": subject.causes,
        "numbers": subject.numbers,
        "outside": subject.region.bounds,
        "parameters": dataclasses.asdict(subject.own),
        "reference": dataclasses.asdict(subject.reference),
        "versions": versions(),
        "rungs": [result.as_dict() for result in results],
    }
