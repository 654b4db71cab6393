"""What an index shows of the project: addresses, and a README whose links lead somewhere."""

import re
from pathlib import Path

import pytest

metadata = pytest.importorskip("hatchling.metadata.core", reason="comes with the extra `dev`")

ROOT = Path(__file__).resolve().parents[1]
SOURCE = "https://example.org/somebody/mjcartpole"


@pytest.fixture
def core(monkeypatch):
    from hatchling.plugin.manager import PluginManager

    def read(source):
        monkeypatch.setenv("MJCARTPOLE_SOURCE_URL", source)
        return metadata.ProjectMetadata(str(ROOT), PluginManager()).core

    return read


def test_where_it_was_built_from_every_link_and_picture_leads_there(core):
    found = core(SOURCE)
    assert set(found.urls) == {"Source", "Documentation", "Changelog", "Issues"}
    targets = re.findall(r"(?<=\]\()[^)]+|(?<=src=\")[^\"]+", found.readme)
    assert len(targets) > 10 and all(re.match(r"https://|#", target) for target in targets)
    ours = [target for target in targets if target.startswith(SOURCE)]
    for target in [*ours, *found.urls.values()]:
        path = re.sub(rf"^{SOURCE}/(blob|raw)/v{found.version}/|^{SOURCE}(/issues)?$", "", target)
        assert (ROOT / path.partition("#")[0]).exists(), target
    assert f"{SOURCE}/raw/v{found.version}/videos/example.gif" in ours


def test_where_that_is_not_said_nothing_is_made_up(core):
    found = core("")
    assert found.urls == {}
    assert found.readme == (ROOT / "README.md").read_text(encoding="utf-8")
    assert found.readme_content_type == "text/markdown"
