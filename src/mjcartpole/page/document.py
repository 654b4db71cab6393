"""The HTML file: a shell around what was built from web/, and the data of runs."""

import hashlib
import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mjcartpole.errors import ConfigError
from mjcartpole.files import read_bytes
from mjcartpole.page.run_data import in_base64
from mjcartpole.versions import version_of

ASSETS: Final = Path(__file__).parent / "assets"
"""Where the build of web/ puts what it makes; in a wheel it is there."""

_NAMES: Final = ("page.js", "style.css", "mujoco.wasm.gz")
_MOST_BYTES: Final = 2**25

_POLICY: Final = (
    "default-src 'none'; script-src '{script}' 'wasm-unsafe-eval'; style-src '{style}'; "
    "img-src data:; media-src data:; base-uri 'none'; form-action 'none'"
)
"""Lets this script, this style and WebAssembly be, and nothing else."""

_SHELL: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="referrer" content="no-referrer">
<title>{title} · mjcartpole</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""

_BODY: Final = """<div id="app"><p class="loading">Starting MuJoCo …</p></div>
<noscript>This page runs MuJoCo in the browser, which needs JavaScript.</noscript>
<script type="application/json" id="data">{data}</script>
<script type="application/octet-stream" id="wasm">{wasm}</script>
<script>{script}</script>"""


def shell(title: str, style: str, policy: str, body: str) -> str:
    """Return an HTML file around a body: what a browser needs to know, and the title, escaped."""
    return _SHELL.format(title=html.escape(title), style=style, policy=policy, body=body)


def page_html(runs: Sequence[Mapping[str, Any]], assets: Path = ASSETS) -> str:
    """Return the page of runs, whole, of what `run_data` returns of each.

    Nothing of a run is written as HTML but the title, escaped: the rest is JSON in which no `<` is
    left. The page may run this very script, and WebAssembly, and may load nothing at all.

    Raises:
        ConfigError: Nothing was built.
    """
    script, style, wasm = (_asset(assets, name) for name in _NAMES)
    page = {
        "version": version_of("mjcartpole") or "",
        "mujoco": version_of("mujoco") or "",
        "runs": runs,
    }
    names = ", ".join(str(run["name"]) for run in runs)
    body = _BODY.format(
        data=json.dumps(page).replace("<", "\\u003c"),
        wasm=in_base64(wasm),
        script=script.decode(),
    )
    policy = _POLICY.format(script=digest(script), style=digest(style))
    return shell(names, style.decode(), policy, body)


def check_built(assets: Path = ASSETS) -> None:
    """Refuse to go on where web/ was not built (ConfigError)."""
    if missing := [name for name in _NAMES if not (assets / name).is_file()]:
        raise ConfigError(
            f"what web/ builds is not in '{assets}' ({', '.join(missing)} missing); in a checkout "
            "`make page` builds them, with Node.js 20 or newer; wheels bring them along"
        )


def _asset(assets: Path, name: str) -> bytes:
    check_built(assets)
    return read_bytes(assets / name, _MOST_BYTES)


def digest(content: bytes) -> str:
    """Return what a page's policy calls a script or a style that may be."""
    return f"sha256-{in_base64(hashlib.sha256(content).digest())}"
