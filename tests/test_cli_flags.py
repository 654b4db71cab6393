"""Flags and their values: as the config has them, lists by commas, mistakes in one line."""

import os

import pytest

from command_line import call
from mjcartpole.commands import parsing
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.physics.load import load_model
from nightly import few


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["train", "--bins", "1,3,,6,8"], "nothing between two commas"),
        (["model", "show", "-o", "x.xml"], "-o is for `model edit`"),
        (["model", "list", "long"], "`model show` takes a name"),
        (["model", "list", "--set", "pole.length=2"], "`model show` takes a name"),
        (["model", "show", "/dev/zero"], "'/dev/zero' is a device or a pipe, not a file"),
        (["transfer", "policy.json", "--models", "gym", "--set", "pole.length=2"], "no run folder"),
    ],
)
def test_what_has_no_effect_is_refused(arguments, said, capsys):
    code, out, err = call(arguments, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_flags_are_the_fields_of_the_config():
    command = parsing.parse(["train", "--gamma", "0.9", "--bins", "1", "1", "2", "3", "--seed=4"])
    assert command.config == TrainConfig(gamma=0.9, bins=(1, 1, 2, 3), seed=4)
    assert command.where.preset == "tuned"
    assert command.how.video is True


@pytest.mark.parametrize("form", [["--preset", "article"], ["--preset=article"]])
def test_a_preset_changes_the_defaults(form):
    command = parsing.parse(["train", "--backend", "gym", *form, "--episodes", "50"])
    assert command.config == TrainConfig.preset("article", backend="gym", episodes=50)
    assert command.where.preset == "article"


@pytest.mark.parametrize("form", [["--method", "sarsa"], ["--method=sarsa"]])
def test_a_method_has_flags_of_its_own(form, capsys):
    command = parsing.parse(["train", *form, "--epsilon", "0.5"])
    assert command.config == TrainConfig(method="sarsa", epsilon=0.5)
    assert "--td-lambda" not in call(["train", *form, "--help"], capsys)[1]
    assert "--td-lambda" in call(["train", "--help"], capsys)[1]


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("--bins 1,3,6,9", {"bins": (1, 3, 6, 9)}),
        ("--bins=1,3,6,9 --alpha 0.2", {"bins": (1, 3, 6, 9), "alpha": 0.2}),
        ("--bins 1, 3, 6, 9", {"bins": (1, 3, 6, 9)}),
        ("--bins 1,3 6,9", {"bins": (1, 3, 6, 9)}),
        ("--low -2.4,-1e0,-.2,-1.5 --seed 3", {"low": (-2.4, -1.0, -0.2, -1.5), "seed": 3}),
        ("--low=-2.4,-1,-.2,-1.5", {"low": (-2.4, -1.0, -0.2, -1.5)}),
        ("--set pole.length=1.5,pole.mass=0.2", {"set": ("pole.length=1.5", "pole.mass=0.2")}),
        ("--set=a.b=1,c:d.e=2 f=3", {"set": ("a.b=1", "c:d.e=2", "f=3")}),
    ],
)
def test_commas_part_the_values_of_a_list(words, values):
    assert parsing.parse(["train", *words.split()]).config == TrainConfig(**values)


def test_commas_elsewhere(here):
    assert parsing.parse(["parity", "--rungs", "1,2,3", "--quick"]).rungs == (1, 2, 3)
    command = parsing.parse(["transfer", "a,b", "--models", "gym,long", "-o", "c,d"])
    assert command.models == ("gym", "long")
    assert ([str(source) for source in command.sources], str(command.output)) == (["a,b"], "c,d")
    (here / "heavy,long.xml").write_text("<mujoco/>")
    command = parsing.parse(["transfer", "a", "--models", "heavy,long.xml", "gym"])
    assert command.models == ("heavy,long.xml", "gym")


def test_a_list_that_makes_no_sense_is_one_line(here, capsys):
    for bins in ("1,3,6", "1,x,6,8", "1;3;6;8", ","):
        code, out, err = call(["train", "--bins", bins], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)


def test_negative_numbers_are_values():
    command = parsing.parse(["train", "--low", "-1", "-2.5", "-0.3", "-4e0"])
    assert command.config.low == (-1.0, -2.5, -0.3, -4.0)


def test_a_value_that_makes_no_sense_is_our_error():
    with pytest.raises(ConfigError, match="gamma must be a number from 0 to 1, not 2"):
        parsing.parse(["train", "--gamma", "2"])


BAD = [
    (["train", "--preset", "best"], "preset 'best' is unknown; available: tuned"),
    (["train", "--task", "juggle"], "task 'juggle' is unknown; available: CartPole-v1"),
    (["train", "--method", "guess"], "method 'guess' is unknown; available: q-learning, sarsa"),
    (["train", "--method", "sarsa", "--td-lambda", "0.5"], "--td-lambda"),
    (["train", "--episodes", "0"], "episodes must be a whole number from 1 up, not 0"),
    (["train", "--episodes", "-7"], "not -7"),
    (["train", "--episodes", "many"], "many"),
    (["train", "--bins", "1", "2"], "bins needs 4 values"),
    (["train", "--bins", "1", "2", "3", "0"], "from 1 up"),
    (["train", "--bins", "1000", "1000", "1000", "1000"], "states; the most is"),
    (["train", "--low", "5", "5", "5", "5"], "low < high"),
    (["train", "--high", "nan", "1", "1", "1"], "finite"),
    (["train", "--alpha", "7"], "alpha must be a number from 0 to 1"),
    (["train", "--seed", "-1"], "seed must be"),
    (["train", "--backend", "bullet"], "'bullet'"),
    (["train", "--backend", "gym", "--model", "other"], "takes no model"),
    (["train", "--model", "cartpol"], "did you mean 'cartpole'"),
    (["train", "--model", "nowhere.xml"], "'nowhere.xml' is not there"),
    (["train", "--model", "broken.xml"], "line 3"),
    (["train", "--model", "ball.xml"], "a ball joint"),
    (["train", "--run-dir", "/proc/nothing"], "cannot make the folder"),
    (["train", "--run-dir", "full"], "holds other files"),
    (["train", "--run-dir", "a-file"], "a-file"),
    (["train", "--engine", "fast"], "fast"),
    (["train", "--checkpoint-every", "-1"], "checkpoint-every must be a number of seconds"),
    (["train", "--seeds", "0"], "seeds must be a number from 1"),
    (["train", "--workers", "2"], "--workers is for several --seeds"),
    (["train", "--resume", "nowhere"], "no run folder or checkpoint 'nowhere'"),
    (["train", "--resume", "full"], "'full' holds no training that could be continued"),
    (["train", "--resume", "a-file"], "holds no training that could be continued"),
    (["train", "--resume", "RUN", "--seed", "9"], "leave out --seed"),
    (["train", "--resume", "RUN", "--seed", "0", "--no-mirror"], "leave out --seed, --mirror"),
    (["train", "--resume", "RUN", "--method", "sarsa"], "leave out --method"),
    (["train", "--resume", "RUN", "--seeds", "2", "--overwrite"], "leave out --seeds, --overwrite"),
    (["train", "--overwriet"], "perhaps you meant --overwrite"),
    (["train", "--dealy", "2"], "perhaps you meant --delay INT; see mjcartpole train --help"),
    (["evaluate", "RUN", "--overwrite"], "evaluate); see mjcartpole evaluate --help"),
    (["fly"], "command 'fly' is unknown; available: train, evaluate"),
    (["tarin"], "did you mean 'train'?"),
    (["evaluate"], "RUN-OR-POLICY"),
    (["evaluate", "nowhere"], "no run folder or policy file 'nowhere'"),
    (["evaluate", "full"], "no complete run folder"),
    (["evaluate", "a-file"], "not a policy"),
    (["evaluate", "noise.json"], "not a policy"),
    (["evaluate", "RUN", "--episodes", "0"], "episodes must be"),
    (["evaluate", "RUN", "--seed", "-4"], "seed must be"),
    (["evaluate", "RUN", "--backend", "gym", "--integrator", "mujoco"], "takes no model"),
    (["render", "nowhere"], "nowhere"),
    (["render", "RUN", "-o", "video.xyz"], "video.xyz"),
    (["render", "RUN", "-o", "/proc/nothing/video.mp4"], "/proc/nothing"),
    (["render", "RUN", "--camera", "moon"], "'moon'; available: side, follow"),
    (["render", "RUN", "--size", "0x480"], "width 0 is no size of a picture"),
    (["render", "RUN", "--size", "640"], "such as 640x480, not '640'"),
    (["render"], "RUN-OR-POLICY"),
    (["doctor", "--now"], "--now"),
]


@pytest.mark.parametrize(
    ("arguments", "message"), few(BAD, *BAD[::3]), ids=lambda value: str(value)[:50]
)
def test_a_mistake_is_one_line_and_exit_code_2(run, arguments, message, here, capsys):
    (here / "broken.xml").write_text("<mujoco>\n<worldbody>\n<geom sise='1'/></worldbody></mujoco>")
    text = load_model().xml.replace('type="hinge" axis="0 1 0"', 'type="ball"')
    (here / "ball.xml").write_text(text)
    (here / "full").mkdir()
    (here / "full" / "thesis.tex").write_text("years of work")
    (here / "a-file").write_text("text")
    (here / "noise.json").write_bytes(os.urandom(200))
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    code, out, err = call([str(run) if a == "RUN" else a for a in arguments], capsys)
    assert code == 2
    assert out == ""
    assert err.startswith("mjcartpole: error: ")
    assert err.count("\n") == 1
    assert message in err
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


def test_the_word_after_set_is_an_edit_even_where_it_is_none(here, capsys):
    code, _, error = call(["model", "show", "cartpole", "--set", "pole.length"], capsys)
    assert code == 2
    assert "'pole.length' is no edit; give NAME=VALUE" in error
