"""What the README shows works as it is shown."""

import re
from pathlib import Path

import pytest

from mjcartpole import cli

README = (Path(__file__).resolve().parents[1] / "README.md").read_text(encoding="utf-8")


def commands():
    """Every mjcartpole command line of the README."""
    return re.findall(r"^    (?:\S*/)?mjcartpole (.*?)(?:\s+#.*)?$", README, re.M)


def test_every_command_is_understood():
    assert len(commands()) >= 7
    for line in commands():
        cli.parse(line.split())


def test_what_it_links_to_is_there():
    root = Path(__file__).resolve().parents[1]
    links = [link for link in re.findall(r"\]\(([^)]+)\)", README) if "://" not in link]
    assert len(links) >= 5
    assert [link for link in links if not (root / link).exists()] == []


@pytest.mark.slow
def test_the_python_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]
    names = {}
    exec(code, names)
    assert names["result"].returns[-100:].mean() > 475
    assert (tmp_path / "policy.json").is_file()
