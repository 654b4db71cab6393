"""The page's code under Node.js, and the page in a browser; skips where these are not."""

import functools
import json
import shutil
import subprocess
from pathlib import Path

import pytest

from mjcartpole.page.document import ASSETS

WEB = Path(__file__).resolve().parents[2] / "web"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@functools.cache
def node():
    """Node.js; skips where it or the npm packages are not."""
    found = shutil.which("node")
    if found is None or not (WEB / "node_modules" / "esbuild").is_dir():
        pytest.skip("needs Node.js and the page's npm packages: cd web && npm ci")
    return found


def answers(**questions):
    """What the page's code makes of questions; see web/same.mjs."""
    return _run("same.mjs", questions)


def drive(file, *acts, **wish):
    """Open a page in a browser, without a network; see web/drive.mjs."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None or not (WEB / "node_modules" / "playwright-core").is_dir():
        pytest.skip("needs Chromium and playwright-core: apt install chromium, cd web && npm ci")
    return _run("drive.mjs", {"file": str(file), "browser": browser, "acts": acts, **wish})


def needs_assets():
    """Skip where what the page is made of was not built."""
    if not (ASSETS / "page.js").is_file():
        pytest.skip("needs what web/ is built to: make page")


def _run(script, content):
    command = [node(), str(WEB / script)]
    done = subprocess.run(
        command, input=json.dumps(content), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
