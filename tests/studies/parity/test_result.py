"""Verdicts of figures and bounds."""

from mjcartpole.studies.parity import Figure, Result


def test_verdicts():
    def verdict(*figures, **options):
        return Result(1, "", "", figures, **options).verdict

    assert verdict(Figure("a", 1.0, 1.0), Figure("b", 9.0)) == "holds"
    assert verdict(Figure("a", 1.1, 1.0)) == "fails"
    assert verdict(Figure("a", float("nan"), 1.0)) == "fails"
    assert Figure("a", float("nan"), 1.0).as_dict()["value"] == "nan"
    assert verdict(Figure("p", 0.5, 0.1, at_least=True)) == "holds"
    assert verdict(Figure("p", 0.01, 0.1, at_least=True)) == "fails"
    assert verdict(problems=("wrong",)) == "fails"
    assert verdict(skipped="no") == "skipped"
    assert verdict(skipped="no", beyond=True) == "beyond"
