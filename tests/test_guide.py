"""The guide: its page is made from its text, every picture is there, and it names buttons that exist."""

import re
import tomllib
from pathlib import Path

from release.guide import DOCS, page, pictures

TEXT = (DOCS / "guide.md").read_text(encoding="utf-8")


def test_the_page_is_made_from_the_text():
    made = (DOCS / "guide.html").read_text(encoding="utf-8")
    assert made == page(TEXT), "make it anew: python -m release.guide"


def test_the_zip_takes_the_page_with_its_pictures():
    manifest = tomllib.loads((DOCS.parent / "blender_manifest.toml").read_text(encoding="utf-8"))
    kept = {Path(x.removeprefix("!/docs/")).name for x in manifest["build"]["paths_exclude_pattern"] if x[0] == "!"}
    assert kept == {"guide.html", *pictures(TEXT)}
    assert all((DOCS / name).is_file() for name in kept)
    assert sum((DOCS / name).stat().st_size for name in kept) < 1_000_000


def test_marks_become_elements():
    made = page("# A & B\n\nplain **bold** *slanted* `a < b`\n\n1. one\n   goes on\n2. two\n\n- x\n\n![p](p.png)\n")
    for part in ("<h1>A &amp; B</h1>", "<strong>bold</strong>", "<em>slanted</em>", "<code>a &lt; b</code>"):
        assert part in made
    assert "<ol>\n<li>one goes on</li>\n<li>two</li>\n</ol>" in made
    assert "<ul>\n<li>x</li>\n</ul>" in made
    assert '<img src="p.png" alt="p">' in made
    assert not re.search(r"\*\*|`", page(TEXT).partition("<body>")[2])
