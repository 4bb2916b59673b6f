"""docs/guide.html from docs/guide.md: the page that the extension opens, in the few marks that the guide uses."""

from __future__ import annotations

import html
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 17px/1.5 sans-serif; max-width: 46em; margin: 2em auto; padding: 0 1em; color: #222; background: #fff; }}
img {{ max-width: 100%; border: 1px solid #ccc; }}
code {{ background: #eee; padding: 0 0.2em; }}
li {{ margin: 0.3em 0; }}
</style>
</head>
<body>
{body}
</body>
</html>
"""


def page(text: str) -> str:
    """Return a page of headings, paragraphs, lists, pictures, bold, slanted and fixed text as HTML."""
    parts = []
    for block in re.split(r"\n\s*\n", text.strip()):
        lines = block.splitlines()
        level = len(lines[0]) - len(lines[0].lstrip("#"))
        items = re.split(r"^(?:\d+\.|-) +", block, flags=re.MULTILINE)[1:]
        if level:
            parts.append(f"<h{level}>{_marked(lines[0].strip('# '))}</h{level}>")
        elif items and re.match(r"\d+\. |- ", block):
            kind = "ul" if block.startswith("-") else "ol"
            listed = "\n".join(f"<li>{_marked(item)}</li>" for item in items)
            parts.append(f"<{kind}>\n{listed}\n</{kind}>")
        else:
            parts.append(f"<p>{_marked(block)}</p>")
    return _PAGE.format(title=html.escape(text.splitlines()[0].strip("# ")), body="\n".join(parts))


def pictures(text: str) -> list[str]:
    """Return the names of the pictures that a page shows."""
    return re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)


def _marked(text: str) -> str:
    """Return a piece of text with its marks as HTML."""
    text = html.escape(" ".join(text.split()), quote=False)
    for mark, made in (
        (r"!\[([^\]]*)\]\(([^)]+)\)", r'<img src="\2" alt="\1">'),
        (r"\*\*([^*]+)\*\*", r"<strong>\1</strong>"),
        (r"\*([^*]+)\*", r"<em>\1</em>"),
        (r"`([^`]+)`", r"<code>\1</code>"),
    ):
        text = re.sub(mark, made, text)
    return text


if __name__ == "__main__":
    (DOCS / "guide.html").write_text(page((DOCS / "guide.md").read_text(encoding="utf-8")), encoding="utf-8")
