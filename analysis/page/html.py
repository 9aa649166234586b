"""One HTML file that needs nothing else: style, program and data, and no way to the network."""

import base64
import hashlib
import html
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from kankaku.analysis.page.packing import Packed, compressed
from kankaku.analysis.page.page_data import PageSource, page_data, together

BROWSER: Final = Path(__file__).parent / "browser"
"""Style and program of the page; modules that import each other by their file names."""
STYLE, MAIN = "page.css", "main"
_IMPORT: Final = re.compile(
    r'^import\s*(?P<names>\{[^}]*\})\s*from\s*"\./(?P<file>[a-z_]+)\.js";\n', re.MULTILINE
)
_EXPORT: Final = re.compile(
    r"^export\s+(?P<kind>(?:async\s+)?function|const|let|class)\s+(?P<name>\w+)", re.MULTILINE
)
_COMMENT: Final = re.compile(r"^[ ]*(?:/\*\*(?:(?!\*/)[\s\S])*\*/|//[^\n]*)\n", re.MULTILINE)

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="Kankaku">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript><p>{title}</p><p>{words}</p></noscript>
<div id="page" aria-busy="true"></div>
<script type="application/octet-stream" id="data">{data}</script>
<script type="module">{script}</script>
</body>
</html>
"""


PAGE: Final = "report.html"
"""File of the page in a results folder."""


def page_of(sources: Sequence[PageSource]) -> str:
    """
    Return the page of some results.

    Parameters
    ----------
    sources
        Results; those of the same line and trains are compared with each other.

    Returns
    -------
    str
        HTML.

    Raises
    ------
    ValueError
        If there are none, or one has no run.
    """
    return page_html(page_data(together(sources)))


def page_html(packed: Packed) -> str:
    """
    Return a page.

    Parameters
    ----------
    packed
        What :func:`kankaku.analysis.page.page_data.page_data` returned.

    Returns
    -------
    str
        HTML. The data stand in it as base64, so that no name in them can become markup, and the
        page's own policy forbids every other program and every request.
    """
    first = packed.told["results"][0]
    script, style = program(), (BROWSER / STYLE).read_text("utf-8")
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return _PAGE.format(
        policy=policy,
        title=html.escape(str(first["title"]), quote=True),
        words=html.escape(f"{first['verdict']['en']} {first['safety']['en']}"),
        style=style,
        data=base64.b64encode(compressed(packed)).decode("ascii"),
        script=script,
    )


def program() -> str:
    """
    Return the page's program as one text.

    Returns
    -------
    str
        Every module once, after those that it imports, as a function that returns what it
        exports; comments left out.

    Raises
    ------
    ValueError
        If modules import each other in a circle.
    """
    return "".join(_modules(MAIN, [], ()))


def _modules(name: str, done: list[str], above: tuple[str, ...]) -> Iterator[str]:
    if name in above:
        msg = f"modules import each other: {' -> '.join((*above, name))}"
        raise ValueError(msg)
    if name in done:
        return
    text = (BROWSER / f"{name}.js").read_text("utf-8")
    for found in _IMPORT.finditer(text):
        yield from _modules(found["file"], done, (*above, name))
    done.append(name)
    exported = [found["name"] for found in _EXPORT.finditer(text)]
    text = _IMPORT.sub(
        lambda found: f"const {found['names'].replace(' as ', ': ')} = ${found['file']};\n", text
    )
    text = _COMMENT.sub("", _EXPORT.sub(r"\g<kind> \g<name>", text))
    yield f"const ${name} = (() => {{\n{text}return {{ {', '.join(exported)} }};\n}})();\n"


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
