"""An option that the method lacks: whose it is, what the method has, where help is."""

import pytest

from command_line import call
from mjcartpole.commands.method_flags import flags_of, given, lacking
from mjcartpole.learning.methods import METHODS

TILED = ", ".join(each for each in METHODS if "tilings" in flags_of(each))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "--method planning --tilings 4",
            f"method 'planning' has no option --tilings (--tilings belongs to {TILED}); "
            "its options are --gamma, --tolerance, --sweeps; "
            "see mjcartpole train --method planning --help",
        ),
        ("--preset planned --tilings=4", "method 'planning' has no option --tilings (--tilings"),
        ("--preset quick --alpha 0.1", "method 'model' has no option --alpha (--alpha belongs"),
        (
            "--method sarsa --trace-lambda .5",
            "'sarsa' has no option --trace-lambda (--trace-lambda belongs to actor-critic); its",
        ),
        (
            "--method=reinforce --planning_steps 3",
            "'reinforce' has no option --planning-steps (--planning belongs to prioritized-sweep",
        ),
        ("--method planning --no-learn-last-step", "'planning' has no option --learn-last-step ("),
        ("--epsilom .5", "--epsilom; its options are --epsilon, --epsilon-final, --gamma, "),
        ("--resume run --sweeps 3", "--resume continues a run as it began: leave out --sweeps"),
        ("--method n-step", "'n-step' is unknown; available: q-learning, sarsa, expected-sarsa, "),
        ("--method n-step", "; did you mean 'n-step-sarsa'?"),
    ],
)
def test_it_is_one_line(words, said, capsys):
    code, out, err = call(["train", *words.split()], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("mjcartpole: error: ")
    assert said in err


@pytest.mark.parametrize("method", METHODS)
def test_of_every_method_each_option_is_taken_or_told_with_its_owners(method):
    every = sorted({flag for each in METHODS for flag in flags_of(each)})
    for flag in every:
        said = lacking(["train", f"--{flag}", "1"], method, ["method", "seed"])
        if flag in flags_of(method):
            assert said is None
        else:
            owners = [each for each in METHODS if flag in flags_of(each)]
            assert said.startswith(f"method '{method}' has no option --{flag} (")
            assert f"belongs to {', '.join(owners)})" in said
            assert all(f"--{own}" in said for own in flags_of(method))


@pytest.mark.parametrize("words", ["--gamma x", "--overwriet", "--frobnicate 3", "--help", "-x"])
def test_what_belongs_to_no_method_is_left_alone(words):
    assert lacking(words.split(), "planning", ["overwrite", "help"]) is None


def test_the_flags_among_words():
    words = ["--a-b", "1", "--c_d=2", "--no-e", "-f", "--no_g=yes\nno", "--"]
    assert given(words) == ["a-b", "c-d", "e", "g"]
