"""The file of a study: what it means, and a line for each mistake."""

import textwrap
import tomllib
from pathlib import Path

import pytest

from mjcartpole.errors import ConfigError, FileError
from mjcartpole.studies.study.design import Factor, Range, points_of
from mjcartpole.studies.study.study_file import MOST_BYTES, read_study, study_of

DOCS = Path(__file__).resolve().parents[3] / "docs"


def meant(text):
    return study_of(tomllib.loads(textwrap.dedent(text)))


def mistakes(text):
    with pytest.raises(ConfigError) as refused:
        meant(text)
    return str(refused.value).split("\n")


def test_a_file_means_what_it_says(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(
        """
        [study]
        seeds = 3
        measure = ["greedy_mean", "seconds"]
        design = "latin"
        samples = 8
        baseline = {method = "sarsa"}
        [base]
        preset = "tuned"
        hinge.damping = 0.1
        [factors]
        alpha = {low = 0.01, high = 1, log = true}
        method = ["sarsa", "q-learning"]
        "pole.length" = [0.5, 1]
        bins = [[1, 3, 6, 8], [1, 3, 6, 12]]
        """
    )
    study = read_study(path)
    assert (study.seeds, study.measure) == ((0, 1, 2), ("greedy_mean", "seconds"))
    assert (study.design, study.samples, study.baseline) == ("latin", 8, {"method": "sarsa"})
    assert study.base == {"preset": "tuned", "hinge.damping": 0.1}
    assert study.factors == (
        Factor("alpha", Range(0.01, 1.0, log=True)),
        Factor("method", ("sarsa", "q-learning")),
        Factor("pole.length", (0.5, 1)),
        Factor("bins", ((1, 3, 6, 8), (1, 3, 6, 12))),
    )
    assert study.text == path.read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "[factors] is empty"),
        ("[factors]\nalpha = []", "[factors] alpha has no levels"),
        ("[factors]\nalpha = 0.1", "belongs to [base]"),
        ("[factors]\nalpa = [0.1]", "did you mean alpha?"),
        ("[factors]\nalpha = {low = 1, high = 0}", "low below high"),
        ("[factors]\nalpha = {low = 0, high = 1, log = true}", "needs a range above 0"),
        ("[factors]\nalpha = {low = -inf, high = 1, levels = 3}", "low below high"),
        ("[factors]\nalpha = {low = 0, high = 1}", "a grid needs levels = N"),
        ("[factors]\nalpha = [0.1, 0.2, 0.10]", "alpha has the level 0.1 more than once"),
        ("[factors]\npole.length = [0.5, '0.5']", "pole.length has the level 0.5 more than once"),
        ("[factors]\nepisodes = {low = 1, high = 3, levels = 9}", "only 3 of 9"),
        (
            "[study]\ndesign = 'latin'\nsamples = 3\n"
            "[factors]\nalpha = {low = 0, high = 1, levels = 3}",
            'levels = N is for a grid; design = "latin" draws from all of a range',
        ),
        ("[factors]\nalpha = {low = 0, hihg = 1}", "did you mean 'high'?"),
        ("[factors]\nalpha = {low = 0, high = 1, levels = 1}", "from 2 to 100,000"),
        ("[factors]\nmethod = {low = 0, high = 1}", "method is no number"),
        ("[base]\nalpha = 1\n[factors]\nalpha = [0.1]", "in [base] and in [factors]"),
        ("[study]\nseeds = -1\n[factors]\nalpha = [1]", "seeds must be how many"),
        ("[study]\nseeds = 1000000000000\n[factors]\nalpha = [1]", "seeds must be how many"),
        ("[study]\nseeds = [1, 1]\n[factors]\nalpha = [1]", "different whole numbers"),
        ("[study]\nmeasure = []\n[factors]\nalpha = [1]", "measure is empty"),
        ("[study]\nmeasure = 'speed'\n[factors]\nalpha = [1]", "measure 'speed' is unknown"),
        ("[study]\ndesign = 'gird'\n[factors]\nalpha = [1]", "did you mean 'grid'?"),
        ("[study]\ndesign = 'random'\n[factors]\nalpha = [1]", "needs samples = N"),
        ("[study]\nsamples = 9\n[factors]\nalpha = [1]", "a grid has all combinations"),
        ("[study]\nbaseline = {alpha = 0.3}\n[factors]\nalpha = [1]", "0.3 is none of the levels"),
        (
            "[study]\nbaseline = {alpha = 3}\n[factors]\nalpha = {low = 0, high = 1, levels = 3}",
            "3.0 is none of the levels",
        ),
        (
            "[study]\nbaseline = {alpha = 3}\ndesign = 'latin'\nsamples = 3\n"
            "[factors]\nalpha = {low = 0, high = 1}",
            "3.0 is none of the levels",
        ),
        ("factors = 3", "factors must be a table"),
        ("[study]\ndesign = 'latn'\nsamples = 5\n[factors]\nalpha = [1]", "mean 'latin'?"),
        ("[study]\nbaseline = {alpha = 1}\n[factors]\nalpha = 1", "belongs to [base]"),
        ("[study]\nbaseline = {gamma = 0.3}\n[factors]\nalpha = [1]", "none of the factors"),
        ("[robustness]\nnoise = 0.1\n[factors]\nalpha = [1]", "belong together"),
        ("[study]\nmeasure = ['robust_mean']\n[factors]\nalpha = [1]", "belong together"),
        (
            "[study]\nmeasure = 'robust_mean'\n[robustness]\nnosie = 1\n[factors]\nalpha = [1]",
            "did you mean 'noise'?",
        ),
        ("[factor]\nalpha = [1]\n[factors]\nalpha = [1]", "[factor] is no part of a study"),
        ("study = 3\n[factors]\nalpha = [1]", "study must be a table"),
    ],
)
def test_a_mistake_is_told_in_one_line(text, said):
    (line,) = mistakes(text)
    assert said in line


def test_all_mistakes_are_told_at_once():
    lines = mistakes(
        """
        [base]
        preset = "tund"
        gravity = "x"
        [factors]
        alpa = [1]
        gamma = []
        [study]
        measure = "robust_mean"
        [robustness]
        nosie = 1
        noise = "x"
        """
    )
    assert len(lines) == 6
    names = "".join(f"x{n} = [1]\n" for n in range(99))
    many = mistakes(f"[factors]\n{names}")
    assert len(many) == 21 and many[-1] == "and 79 mistakes more"


def test_tables_that_are_too_deep_are_refused(tmp_path):
    (tmp_path / "a.toml").write_text(f"[factors.{'.'.join('a' * 3000)}]\nx = 1")
    # The reader of newer Pythons refuses them itself.
    with pytest.raises(FileError, match=r"lists in it are too deep|is no TOML: .* 1000 parts"):
        read_study(tmp_path / "a.toml")


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe", b"a = ", b"a = " + b"[" * 100_000, b"a = " + b"9" * 5000, b"[a]\n[a]"],
    ids=["bytes", "cut", "deep", "digits", "twice"],
)
def test_what_is_no_toml_is_refused(tmp_path, content):
    (tmp_path / "a.toml").write_bytes(content)
    with pytest.raises(FileError, match="is no TOML"):
        read_study(tmp_path / "a.toml")


def test_a_byte_order_mark_is_no_part_of_it(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbf[factors]\nalpha = [1]")
    assert read_study(tmp_path / "a.toml").text == "[factors]\nalpha = [1]"


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"#" * (MOST_BYTES + 1))
    with pytest.raises(FileError, match="no more than 1,048,576 are read"):
        read_study(tmp_path / "a.toml")


@pytest.mark.parametrize("path", sorted(DOCS.rglob("*.toml")), ids=lambda path: path.stem)
def test_the_studies_of_the_docs_are_studies(path):
    study = read_study(path)
    assert len(points_of(study.factors, study.design, study.samples, study.design_seed)) > 5
