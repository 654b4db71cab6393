"""What `mjcartpole parity` does and prints."""

import dataclasses
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from mjcartpole.files import check_writable, make_folder, write_whole
from mjcartpole.learning.runs import versions
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies.parity import Against, Figure, Result, Subject, run_ladder
from mjcartpole.studies.parity.ladder import check_rungs

QUESTIONS: dict[Against, str] = {
    "cartpole-v1": "Is {} CartPole-v1?",
    "itself": "Does MuJoCo move {} as the equations with its own parameters do?",
}
MOVES: dict[Against, str] = {
    "cartpole-v1": "CartPole-v1",
    "itself": "its own equations say",
}
VERDICTS = {"holds": "holds", "fails": "FAILS", "beyond": "BEYOND", "skipped": "skipped"}


def run_parity(
    model: str,
    edits: Sequence[str] = (),
    *,
    against: Against,
    rungs: Sequence[int],
    quick: bool,
    strict: bool = False,
    output: Path | None,
) -> int:
    """Climb the ladder and print each rung as it is found.

    Returns:
        0 where the motion holds (with `strict`, where no number differs either), else 1.
    """
    silence_mujoco()
    check_rungs(rungs)
    cartpole = load_model(model, edits, own_timestep=True)
    subject = Subject(cartpole, against, quick)
    # A model whose parameters cannot be read is the user's mistake: better known before any work.
    _ = subject.numbers
    if output:
        check_writable(make_folder(output.parent))
    print(QUESTIONS[against].format(cartpole.name) + (" (quick)" if quick else ""))
    if subject.region.bounds:
        print(f"  asked where it moves freely; outside: {'; '.join(subject.region.bounds)}")
    if subject.solves_to_the_end:
        print("  dry friction is solved to the end, not to the file's solver tolerance")
    results: list[Result] = []
    console, ladder = Console(stderr=True), run_ladder(subject, rungs)
    # While it is shown, the status takes stdout over: nothing may be printed then.
    while (result := _next_result(console, ladder)) is not None:
        results.append(result)
        _print_result(result)
    holds = all(result.verdict in {"holds", "skipped"} for result in results)
    _print_motion(subject, results, holds)
    _print_numbers(subject, holds)
    if output:
        write_whole(
            output, json.dumps(_report(subject, results, holds), indent=2, allow_nan=False) + "\n"
        )
        print(f"\nreport {output}")
    return 0 if holds and not (strict and subject.numbers) else 1


def _next_result(console: Console, ladder: Iterator[Result]) -> Result | None:
    with console.status("climbing …"):
        return next(ladder, None)


def _print_result(result: Result) -> None:
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


def _bound(figure: Figure) -> str:
    """The bound in words; a figure without one is only reported."""
    if figure.bound is None:
        return figure.unit
    relation = "≥" if figure.at_least else "≤"
    mark = "" if figure.holds else "   <- out of bounds"
    return f"{relation} {_number(figure.bound)} {figure.unit}".rstrip() + mark


def _print_motion(subject: Subject, results: list[Result], holds: bool) -> None:
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


def _print_numbers(subject: Subject, holds: bool) -> None:
    """Whether the document's numbers are CartPole-v1's, whatever the motion."""
    if subject.against == "itself":
        print("numbers  its own, as the compiled model has them")
    elif not subject.numbers:
        print("numbers  CartPole-v1's own")
    else:
        moves = "moves as CartPole-v1, with other numbers" if holds else "other numbers"
        print(f"numbers  {moves}:")
        for phrase in subject.numbers:
            print(f"  {phrase}")


def _report(subject: Subject, results: list[Result], holds: bool) -> dict[str, Any]:
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
