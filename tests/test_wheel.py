"""The wheel, away from the checkout: it brings its models, trains and renders."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from command_line import done
from pages import needs_assets

pytestmark = pytest.mark.slow

CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    subprocess.run([*command, str(CHECKOUT)], check=True, capture_output=True)
    return next(folder.glob("mjcartpole-*.whl"))


@pytest.fixture(scope="module")
def elsewhere(wheel, tmp_path_factory):
    """Run code with the unpacked wheel before everything else on the path, in another folder."""
    site = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(site)
    work = tmp_path_factory.mktemp("work")

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=work,
            env={**os.environ, "PYTHONPATH": str(site)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    run.site, run.work = site, work
    return run


def test_the_wheel_holds_the_package_its_models_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {name.removeprefix("mjcartpole/models/") for name in names if "/models/" in name}
    assert shipped == {path.name for path in (CHECKOUT / "models").glob("*.xml")}
    assert "mjcartpole/py.typed" in names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"mjcartpole"}


def test_the_env_is_made_from_the_wheel(elsewhere):
    out = elsewhere(
        "-c",
        "import gymnasium, mjcartpole\n"
        "from mjcartpole.physics.load import models_folder\n"
        "print(mjcartpole.__file__, models_folder())\n"
        "env = gymnasium.make('mjcartpole/CartPole-v1')\n"
        "env.reset(seed=0); print(env.step(1)[1])",
    )
    package = elsewhere.site / "mjcartpole"
    assert out.split() == [str(package / "__init__.py"), str(package / "models"), "1.0"]


def test_the_wheel_trains_and_renders(elsewhere):
    out = elsewhere("-m", "mjcartpole", "train", "--episodes", "20", "--run-dir", "runs/there")
    assert "video  videos/there.mp4" in out
    assert (elsewhere.work / "videos" / "there.mp4").stat().st_size > 1000
    out = elsewhere("-m", "mjcartpole", "evaluate", "runs/there", "--episodes", "5")
    assert "5 episodes" in out


def test_the_wheel_writes_the_page_of_the_checkout_without_node(elsewhere, monkeypatch):
    needs_assets()
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent))
    elsewhere("-m", "mjcartpole", "train", "--episodes", "3", "--no-video", "--run-dir", "paged")
    elsewhere("-m", "mjcartpole", "page", "paged", "-o", "there.html", "--no-plots")
    done(["page", elsewhere.work / "paged", "-o", elsewhere.work / "here.html", "--no-plots"])
    pages = [(elsewhere.work / name).read_bytes() for name in ("there.html", "here.html")]
    assert pages[0] == pages[1]
