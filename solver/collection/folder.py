"""A collection on disk: prepared surfaces, results one by one, and what they were computed from.

    manifest.json        what was asked for
    surfaces/NAME.npz    specimens, prepared; see `align.surface_file`
    specimens.jsonl      a line per specimen, written when it is prepared: its fingerprints, and what was done to it
    pairs.jsonl          a line per pair, written when it is done: of several about one the last counts
    maps/A to B.npz      dense maps, as `carry.map_file` writes them, and `transfer --use-map` reads them
    lock                 who works here has it

Every line and file is whole or not there. A run that is stopped in whatever way goes on from what is there.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from ..align.surfaces.settings import AlignSettings
from .lock import locked
from .pair import Figures
from .tasks import Result, whole_file

PREPARING = ("samples", "targets", "fill_holes")
"""Settings that prepared surfaces depend on."""

VERSION = 4
"""Of the lines and of what is computed for them: those of another version are done anew."""


LONGEST = 100
"""Bytes of a specimen's name: two of them, and what is added, are within the 255 that a file's name may have."""


def digest(settings: AlignSettings, *, prepare_only: bool = False, **more: Any) -> str:
    """Return a short text that changes with whatever results depend on."""
    given = {name: value for name, value in asdict(settings).items() if name != "threads"}
    if prepare_only:
        given = {name: given[name] for name in PREPARING}
    return hashlib.sha256(json.dumps([VERSION, given, more], sort_keys=True).encode()).hexdigest()[:16]


class Folder:
    """The files of a collection.

    Parameters
    ----------
    root : Path
        The folder; it is made if it is not there.

    Attributes
    ----------
    specimens : dict of str to dict
        By name, the lines: "stamp", of the file it came from; "prepared", a digest of the settings; "fingerprint", of
        the mesh; "notes", "vertices", "faces", "seconds".
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        for folder in (root, root / "surfaces", root / "maps"):
            folder.mkdir(parents=True, exist_ok=True)
        self._lock = locked(root / "lock")
        for left in (*root.glob(".*.unfinished"), *root.glob("*/.*.unfinished")):
            left.unlink(missing_ok=True)
        self._open: dict[str, TextIO] = {}
        self.specimens: dict[str, dict[str, Any]] = {line["name"]: line for line in self._lines("specimens")}

    def surface(self, name: str) -> Path:
        """Return where a prepared specimen is."""
        return self.root / "surfaces" / f"{name}.npz"

    def handed(self, name: str) -> Path:
        """Return where a specimen's mesh is, as it was read, until it is prepared."""
        return self.root / "surfaces" / f".{name}.mesh.unfinished"

    def dense_map(self, source: str, target: str) -> Path:
        """Return where the dense map of a pair is."""
        return self.root / "maps" / f"{source} to {target}.npz"

    def prepared(self, name: str, stamp: str, settings_digest: str) -> bool:
        """Return whether a specimen is prepared already, from the same file and with the same settings."""
        known = self.specimens.get(name)
        return (
            known is not None
            and (known["stamp"], known["prepared"]) == (stamp, settings_digest)
            and self.surface(name).is_file()
        )

    def write_manifest(self, asked: dict[str, Any]) -> None:
        """Write what was asked for."""
        with whole_file(self.root / "manifest.json") as path:
            path.write_text(json.dumps({"version": VERSION, **asked}, indent=1, ensure_ascii=False) + "\n", "utf-8")

    def pairs(self) -> dict[tuple[str, str, str], dict[str, Any]]:
        """Return the lines that count, by source, target and digest: of the specimens as they are now."""
        found: dict[tuple[str, str, str], dict[str, Any]] = {}
        for line in self._lines("pairs"):
            known = [self.specimens.get(line[role], {}).get("fingerprint") for role in ("source", "target")]
            if known == [line["source_fingerprint"], line["target_fingerprint"]]:
                found[line["source"], line["target"], line["digest"]] = line
        return found

    def add_specimen(self, name: str, stamp: str, settings_digest: str, result: Result) -> None:
        """Write that a specimen is prepared."""
        self.specimens[name] = {"name": name, "stamp": stamp, "prepared": settings_digest, **result}
        self._add("specimens", self.specimens[name])

    def add_pair(self, source: str, target: str, settings_digest: str, result: Result) -> dict[str, Any]:
        """Write the result of a pair, and return its line."""
        line = {
            "source": source,
            "target": target,
            "digest": settings_digest,
            "source_fingerprint": self.specimens[source]["fingerprint"],
            "target_fingerprint": self.specimens[target]["fingerprint"],
            **result,
        }
        self._add("pairs", line)
        return line

    def close(self) -> None:
        """Close what is open."""
        for file in self._open.values():
            file.close()
        self._open.clear()
        self._lock.close()

    def _add(self, name: str, line: dict[str, Any]) -> None:
        if name not in self._open:
            self._open[name] = _appending(self.root / f"{name}.jsonl")
        self._open[name].write(json.dumps(line, ensure_ascii=False) + "\n")
        self._open[name].flush()

    def _lines(self, name: str) -> Iterator[dict[str, Any]]:
        path = self.root / f"{name}.jsonl"
        if not path.exists():
            return
        with path.open("rb") as lines:
            for raw in lines:
                # a line that was being written when the program ended has no end
                if raw.endswith(b"\n"):
                    try:
                        yield json.loads(raw)
                    except ValueError:  # as where the machine lost its power: it is done again
                        continue


def figures_of(line: dict[str, Any]) -> Figures | None:
    """Return the figures of a line; None if the pair failed."""
    if "error" in line:
        return None
    return Figures.read({name: line[name] for name in Figures.__dataclass_fields__})


def _appending(path: Path) -> TextIO:
    """Open a file of lines to add more; half a line at its end is taken off."""
    if path.exists():
        with path.open("rb+") as file:
            content = file.read()
            file.truncate(content.rfind(b"\n") + 1)
    return path.open("a", encoding="utf-8")


def free_name(name: str) -> str:
    """Return a specimen's name as a file may have it on every system."""
    # of a name that is no UTF-8 Python makes surrogates
    wrong = [sign in '<>:"/\\|?*' or ord(sign) < 32 or 0xD800 <= ord(sign) < 0xE000 for sign in name]
    kept = "".join("_" if bad else sign for bad, sign in zip(wrong, name, strict=True)).strip(" .")
    if len(kept.encode()) > LONGEST:
        told_apart = hashlib.sha256(kept.encode()).hexdigest()[:8]
        kept = kept.encode()[: LONGEST - 9].decode(errors="ignore").strip(" .") + "-" + told_apart
    return kept or "specimen"
