"""What all tests share holds for all of them."""

import re
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st


@given(st.none())
@settings(max_examples=1)
def test_no_example_has_a_deadline(_):
    for chosen in (settings.default, settings(max_examples=7)):
        assert chosen.deadline is None
        assert HealthCheck.too_slow in chosen.suppress_health_check


def test_no_file_sets_a_deadline_of_its_own():
    folder = Path(__file__).parent
    files = set(folder.rglob("*.py")) - {Path(__file__), folder / "conftest.py"}
    assert len(files) > 50
    texts = {file.name: file.read_text("utf-8") for file in files}
    assert [name for name, text in texts.items() if re.search(r"deadline\s*=", text)] == []
