"""Reports, on a hand-made data set with known answers."""

import csv
import dataclasses
import itertools

import numpy as np
import pytest

from command_line import call
from mjcartpole.errors import ConfigError, RunError
from mjcartpole.media.plots import is_installed
from mjcartpole.studies.statistics import bootstrap_interval, iqm
from mjcartpole.studies.study.report import OfMeasure, sections
from mjcartpole.studies.study.report_plot import ReportPlot
from mjcartpole.studies.study.report_text import latex, markdown
from mjcartpole.studies.study.results import read_results

FILE = """
[study]
seeds = 4
measure = ["greedy_mean", "episodes_to_solve"]
[factors]
alpha = [0.1, 0.3]
ties = ["first", "random"]
"""
# By point, seed by seed: alpha moves the mean by 100, ties by 50 at the larger alpha only.
MEANS = {
    ("0.1", "first"): (200, 210, 220, 230),
    ("0.1", "random"): (200, 210, 220, 230),
    ("0.3", "first"): (300, 310, 320, 330),
    ("0.3", "random"): (350, 360, 370, 380),
}


def write(folder, rows, text=FILE):
    folder.mkdir(exist_ok=True)
    (folder / "study.toml").write_text(text)
    with (folder / "runs.csv").open("w") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return folder


def rows():
    found = []
    for point, ((alpha, ties), means) in enumerate(MEANS.items(), start=1):
        for seed, mean in enumerate(means):
            never = alpha == "0.1" and seed == 3
            found.append(
                {
                    "point": point,
                    "alpha": alpha,
                    "ties": ties,
                    "seed": seed,
                    "greedy_mean": float(mean),
                    "episodes_to_solve": "" if never else 10 + seed,
                    "episodes_trained": 100,
                    "steps_trained": 1000,
                    "error": "",
                }
            )
    return found


@pytest.fixture
def folder(tmp_path):
    return write(tmp_path / "mine", rows())


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return read_results(write(tmp_path_factory.mktemp("report"), rows()))


def said_of(results, baseline=()):
    return sections(results, results.baseline(baseline))


@pytest.fixture(scope="module")
def said(results):
    """What is said of these results; thousands of resamples, once."""
    return said_of(results)


def table(said, measure, title):
    section = next(each for each in said if each.measure == measure)
    found = next(each for each in section.tables if each.title == title)
    return [dict(zip(found.columns, row, strict=True)) for row in found.rows]


def test_a_factors_levels_have_their_averages_and_chances(said):
    low, high = table(said, "greedy_mean", "alpha")
    assert (low["runs"], low["IQM"], low["worst"]) == ("8", "215", "200")
    assert (high["IQM"], high["worst"]) == ("340", "300")
    # By hand: every run at 0.3 beats every run at 0.1.
    assert (high["P(better than 0.1)"], high["95 % of P"]) == ("1.00", "1.00 to 1.00")
    assert (low["P(better than 0.1)"], low["95 % of P"]) == ("", "")
    (_, ties) = table(said, "greedy_mean", "ties")
    # By hand: 0.5 at alpha 0.1, where all is equal, and 1 at 0.3.
    assert ties["P(better than first)"] == "0.75"


def test_points_of_a_level_are_tasks_on_a_full_grid(results, said):
    of = OfMeasure(results, "greedy_mean")
    scores = of.of_level(results.levels[0], 1)
    assert scores.T.tolist() == [[300, 310, 320, 330], [350, 360, 370, 380]]
    ends = bootstrap_interval(scores, resamples=2000)
    assert table(said, "greedy_mean", "alpha")[1]["95 %"] == f"{ends.low:.5g} to {ends.high:.5g}"
    pooled = dataclasses.replace(results, study=dataclasses.replace(results.study, design="random"))
    assert OfMeasure(pooled, "greedy_mean").of_level(results.levels[0], 1).shape == (8,)


def test_the_base_line_is_the_one_that_is_named(results):
    low, high = table(said_of(results, ["alpha=0.3"]), "greedy_mean", "alpha")
    assert (low["P(better than 0.3)"], high["P(better than 0.3)"]) == ("0.00", "")
    with pytest.raises(ConfigError, match=r"alpha: level '0.2' is unknown; available: 0.1, 0.3"):
        results.baseline(["alpha=0.2"])
    with pytest.raises(ConfigError, match="factor 'alpa' is unknown"):
        results.baseline(["alpa=1"])
    with pytest.raises(ConfigError, match="--baseline has two levels of alpha; give one"):
        results.baseline(["alpha=0.1", "alpha=0.3"])


def test_a_base_line_without_a_run_yet_is_no_unknown_level(tmp_path):
    begun = write(tmp_path / "begun", [row for row in rows() if row["alpha"] == "0.3"])
    said = "no run with alpha=0.1, the base line, is done yet, or all failed; .* alpha=0.3"
    with pytest.raises(ConfigError, match=said):
        read_results(begun).baseline(["alpha=0.1"])


def test_a_run_that_was_never_solved_counts_as_all_that_it_spent(said):
    low, high = table(said, "episodes_to_solve", "alpha")
    assert (low["worst"], high["worst"]) == ("100", "13")
    assert (low["solved"], high["solved"]) == ("75%", "100%")
    assert low["IQM"] == f"{iqm([10, 11, 12, 100] * 2):.5g}"
    # 16 pairs a task: of seeds 0 to 2 nobody is ahead but for 3 against them, 100 loses to all.
    wins = sum(
        (x < y) + (x == y) / 2 for x, y in itertools.product([10, 11, 12, 13], [10, 11, 12, 100])
    )
    assert high["P(better than 0.1)"] == f"{wins / 16:.2f}"
    notes = [t.note for s in said for t in s.tables]
    assert any("2 of 16 runs never came to it" in note for note in notes)


def test_pairs_profiles_and_shares(said):
    pair = table(said, "greedy_mean", "alpha and ties: IQM")
    assert pair[1]["random"].startswith("365 (")
    profile = table(said, "greedy_mean", "alpha: performance profile")
    assert list(profile[0]) == ["alpha", *(f"more than {200 + 30 * n}" for n in range(1, 6))]
    assert [row["more than 320"] for row in profile] == ["0%", "62%"]
    shares = {row["factor"]: row for row in table(said, "greedy_mean", "sensitivity")}
    total = np.concatenate(list(MEANS.values())).var()
    assert shares["alpha"]["share of variance"] == f"{62.5**2 / total:.1%}"
    assert shares["ties"]["share of variance"] == f"{12.5**2 / total:.1%}"
    assert shares["alpha and ties"]["share of variance"] == f"{12.5**2 / total:.1%}"
    assert shares["seeds and the rest"]["share of variance"] == f"{125 / total:.1%}"
    assert shares["alpha"]["by chance"] == f"{1 / 15:.1%}"


def test_the_best_points_and_the_worst_runs_and_seeds(said):
    best = table(said, "greedy_mean", "points")
    assert [row["point"] for row in best[:2]] == ["alpha=0.3 ties=random", "alpha=0.3 ties=first"]
    worst = table(said, "greedy_mean", "worst runs")
    assert (worst[0]["seed"], worst[0]["greedy_mean"]) == ("0", "200")
    seeds = table(said, "episodes_to_solve", "worst seeds")
    assert [row["seed"] for row in seeds] == ["3", "2", "1", "0"]
    (section, _) = said
    assert section.sentence.startswith("Best by greedy_mean is alpha=0.3 ties=random: IQM 365")
    assert "alpha explains most: 9" in section.sentence


def test_failed_runs_are_left_out_and_counted(tmp_path):
    failed = {**rows()[0], "greedy_mean": "", "error": "it diverged"}
    results = read_results(write(tmp_path / "mine", [failed, *rows()[1:]]))
    assert (results.failed, len(results.seeds)) == (1, 15)
    # No full grid is left: all of a level are pooled.
    assert OfMeasure(results, "greedy_mean").of_level(results.levels[0], 0).shape == (7,)
    assert said_of(results)


def test_a_range_is_told_in_parts(tmp_path):
    text = FILE.replace("[0.1, 0.3]", "{low = 0, high = 1}")
    text = text.replace("seeds = 4", 'seeds = 1\ndesign = "latin"\nsamples = 40')
    some = [{**rows()[0], "point": n, "alpha": n / 40, "greedy_mean": float(n)} for n in range(40)]
    alpha = read_results(write(tmp_path / "mine", some, text)).levels[0]
    assert alpha.names[0] == "0 to 0.244" and len(alpha.names) == 4
    assert np.bincount(alpha.labels).tolist() == [10] * 4


@pytest.mark.parametrize(
    ("design", "count", "given", "meant"),
    [
        ('design = "latin"\nsamples = 40', 40, "alpha=0.3", "0.244 to 0.487"),
        ('design = "latin"\nsamples = 40', 40, "alpha=1", "0.731 to 0.975"),
        ('design = "latin"\nsamples = 4', 4, "alpha=0.06", "0.05"),
        ("", 41, "alpha=0.3", "0.25 to 0.5"),
    ],
)
def test_a_base_line_of_a_range_is_where_the_nearest_run_was(tmp_path, design, count, given, meant):
    levels = "" if design else ", levels = 41"
    text = FILE.replace("[0.1, 0.3]", f"{{low = 0, high = 1{levels}}}")
    text = text.replace("seeds = 4", f"seeds = 1\n{design}")
    some = [{**rows()[0], "point": n, "alpha": n / 40} for n in range(count)]
    results = read_results(write(tmp_path / "mine", some, text))
    assert results.baseline([given])["alpha"] == meant
    for level in ("1.5", "x", "nan"):
        with pytest.raises(ConfigError, match=f"alpha: level '{level}' is unknown"):
            results.baseline([f"alpha={level}"])


def test_a_range_of_which_many_runs_have_one_number_has_no_empty_part(tmp_path):
    text = FILE.replace("[0.1, 0.3]", "{low = 0, high = 1}")
    text = text.replace("seeds = 4", 'seeds = 1\ndesign = "random"\nsamples = 40')
    some = [{**rows()[0], "point": n, "alpha": max(0, n - 20) / 40} for n in range(40)]
    results = read_results(write(tmp_path / "mine", some, text))
    assert np.bincount(results.levels[0].labels).min() > 0
    assert said_of(results)


def three_factors():
    """What only three together explain, and seeds: +1 or -1 by parity, and a tenth for a seed."""
    levels = {"alpha": ("0.1", "0.3"), "ties": ("first", "random"), "gamma": ("0.9", "1.0")}
    found = []
    for point, places in enumerate(itertools.product((0, 1), repeat=3), start=1):
        about = {name: levels[name][place] for name, place in zip(levels, places, strict=True)}
        for seed in (0, 1):
            mean = (-1) ** sum(places) + (0.1 if seed else -0.1)
            found.append({**rows()[0], **about, "point": point, "seed": seed, "greedy_mean": mean})
    return found


def test_what_only_three_factors_explain_is_not_left_to_seeds(tmp_path):
    text = FILE + "gamma = [0.9, 1.0]\n"
    shares = {
        row["factor"]: (row["share of variance"], row["by chance"])
        for row in table(
            said_of(read_results(write(tmp_path / "mine", three_factors(), text))),
            "greedy_mean",
            "sensitivity",
        )
    }
    # By hand: variances 1 and 0.1 squared; one degree of freedom of 15.
    assert shares["more than two together"] == (f"{1 / 1.01:.1%}", f"{1 / 15:.1%}")
    assert shares["seeds and the rest"] == (f"{0.01 / 1.01:.1%}", "")
    assert shares["alpha and gamma"][0] == "0.0%"
    some = read_results(write(tmp_path / "mine", three_factors()[:-2], text))
    names = [row["factor"] for row in table(said_of(some), "greedy_mean", "sensitivity")]
    assert "more than two together" not in names


def test_a_cell_of_a_pair_keeps_the_points_of_other_factors_apart(tmp_path):
    text = FILE + "gamma = [0.9, 1.0]\n"
    results = read_results(write(tmp_path / "mine", three_factors(), text))
    cell = table(said_of(results), "greedy_mean", "alpha and ties: IQM")[0]["first"]
    ends = bootstrap_interval(np.array([[0.9, -1.1], [1.1, -0.9]]), resamples=2000)
    assert cell == f"{iqm([-1.1, -0.9, 0.9, 1.1]):.4g} ({ends.low:.4g} to {ends.high:.4g})"


def test_points_and_runs_that_are_alike_are_counted(tmp_path):
    alike = [{**row, "greedy_mean": 500.0, "episodes_to_solve": ""} for row in rows()]
    results = read_results(write(tmp_path / "mine", alike))
    means, solved = said_of(results)
    assert means.sentence == (
        "Best by greedy_mean is alpha=0.1 ties=first (and 3 of 4 points that are as good): IQM 500 "
        "(95 % 500 to 500, 4 runs); no factor explains more of the variance than chance would."
    )
    worst = next(each for each in solved.tables if each.title == "worst runs")
    assert worst.note == "As bad as the last of these: 11 more."
    assert "16 of 16 runs never came to it" in solved.tables[1].note


def test_rounding_explains_nothing(tmp_path):
    some = [{**row, "greedy_mean": 0.1 * (row["seed"] + 1)} for row in rows()[:4]]
    (section, _) = said_of(read_results(write(tmp_path / "mine", some)))
    assert "no factor explains more" in section.sentence


def test_a_single_run_has_no_interval(tmp_path):
    results = read_results(write(tmp_path / "mine", rows()[:1]))
    said = said_of(results)
    assert table(said, "greedy_mean", "points")[0]["95 %"] == ""
    assert list(table(said, "greedy_mean", "alpha: performance profile")[0]) == [
        "alpha",
        "more than 200",
    ]
    (section, _) = said
    assert ": IQM 200 (1 run); no factor" in section.sentence
    assert results.left == 15


def test_points_with_a_single_seed_are_pooled(tmp_path):
    results = read_results(write(tmp_path / "mine", rows()[::4]))
    high = table(said_of(results), "greedy_mean", "alpha")[1]
    assert (high["runs"], high["95 %"]) == ("2", "300 to 350")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"alpha": "0.7"}, r"is no table of this study \(alpha has no level '0\.7'\)"),
        ({"greedy_mean": "much"}, "is no table of this study"),
        ({"greedy_mean": ""}, "greedy_mean is missing in a run that did not fail"),
        ({"point": "x"}, "is no table of this study"),
        ({"seed": None}, "is no table of this study"),
    ],
)
def test_a_table_of_somebody_else_is_refused(tmp_path, change, said):
    with pytest.raises(RunError, match=said):
        read_results(write(tmp_path / "mine", [{**rows()[0], **change}]))


def test_what_is_no_study_is_refused(tmp_path):
    with pytest.raises(RunError, match=r"has no study\.toml; give the folder of a study"):
        read_results(tmp_path)
    (tmp_path / "study.toml").write_text(FILE)
    with pytest.raises(RunError, match=r"has no runs\.csv"):
        read_results(tmp_path)
    (tmp_path / "runs.csv").write_text("error\n")
    with pytest.raises(RunError, match="was done without an error; go on with it: mjcartpole"):
        read_results(tmp_path)
    (tmp_path / "runs.csv").write_text("error\nit diverged\n")
    with pytest.raises(RunError, match="was done without an error; the first failed: it diverged"):
        read_results(tmp_path)
    (tmp_path / "runs.csv").write_text("point,seed,error\n1,0,\n")
    with pytest.raises(RunError, match=r"no table of this study \(it has no column greedy_mean\)"):
        read_results(tmp_path)


def test_markdown_and_latex_have_every_table(said):
    found = said
    text, tex = markdown("a|b", "head", found, "p.png"), latex("50% & more", found)
    count = sum(len(section.tables) for section in found)
    assert text.startswith("# a\\|b\n\nhead\n\n![](p.png)\n\n## greedy_mean\n")
    assert text.count("\n### ") == text.count("\n| --- |") == count
    assert tex.count(r"\begin{tabular}") == tex.count(r"\bottomrule") == count
    assert r"\caption{50\% \& more, greedy\_mean: points." in tex
    for line in tex.splitlines():
        if line.endswith(r"\\"):
            assert "%" not in line.replace(r"\%", "")


@pytest.mark.skipif(not is_installed(), reason="matplotlib is not installed")
def test_a_plot_shows_what_its_rows_say(results):
    plot = ReportPlot(results)
    shown = list(plot.rows())
    assert {row["factor"] for row in shown} == {"alpha", "ties"}
    averages = [row["value"] for row in shown if row["what"] == "iqm" and row["factor"] == "alpha"]
    assert averages == [215, 340]
    cells = [(row["level"], row["at"], row["value"]) for row in shown if "by" in row["what"]]
    # Alpha is a number, and ties are none: so it lies along the axis.
    assert [row["factor"] for row in shown][-1] == "ties"
    assert cells == [
        ("first", "0.1", 215),
        ("first", "0.3", 315),
        ("random", "0.1", 215),
        ("random", "0.3", 365),
    ]
    axes = plot.figure().axes
    assert len(axes) == 5
    drawn = [line.get_ydata().tolist() for line in axes[-1].lines]
    assert drawn == [[215, 315], [215, 365]]
    assert [float(line.get_xdata()[0]) for line in axes[0].lines[1::2]] == averages


@pytest.mark.long
def test_the_command_writes_it_and_says_it(folder, capsys):
    code, out, err = call(["study", "report", folder, "--baseline", "alpha=0.3"], capsys)
    assert (code, err) == (0, "")
    assert out.startswith("Best by greedy_mean is alpha=0.3 ties=random: ")
    assert "P(better than 0.3)" in (folder / "report.md").read_text()
    assert (folder / "report.tex").is_file()
    page = (folder / "report.html").read_text()
    assert "16 runs of preset=tuned. Intervals" in page
    assert "<th>0.3</th>" in page and ("data:image/svg+xml" in page) == is_installed()
    assert (folder / "report.png").is_file() == is_installed()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["report"], "give one folder"),
        (["report", "nothing"], "'nothing' has no study.toml"),
        (["report", "nothing", "--resume"], "give one folder, and nothing but --baseline"),
        (["a.toml", "--baseline", "alpha=1"], "--baseline is for `study report`"),
    ],
)
def test_words_that_make_no_sense(words, said, capsys):
    code, _, err = call(["study", *words], capsys)
    assert code == 2 and said in err and err.count("\n") == 1
