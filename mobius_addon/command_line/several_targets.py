"""A transfer to several targets: one after the other, each with files of its own in the folders that were named."""

from __future__ import annotations

import argparse


def one_by_one(options: argparse.Namespace) -> list[argparse.Namespace]:
    """Return the options of a transfer to each of several targets, whose results go into folders.

    Raises
    ------
    Unreadable
        Something is said that can be meant of one target only, or there is no such folder, or two names are the same.
    """
    from ..files import Unreadable, split_object_name

    for name in ("use_map", "landmarks", "pairs", "target_outer", "texture_map", "use_texture_map", "sheet"):
        if getattr(options, name) is not None:
            raise Unreadable(f"--{name.replace('_', '-')} is about one target: give one, not {len(options.target)}")
    suffixes = {"output": ".blend", "map": ".npz", "report": ".json"}
    folders = {name: getattr(options, name) for name in suffixes if getattr(options, name) is not None}
    for name, folder in folders.items():
        if not folder.is_dir():
            flag = "-o" if name == "output" else f"--{name}"
            raise Unreadable(f"{flag} '{folder}' is no folder, which several targets need: make it first")
    result: list[argparse.Namespace] = []
    for target in options.target:
        path, wanted = split_object_name(target)
        name = path.stem if wanted is None else f"{path.stem} {wanted}"
        paths = {key: folder / f"{name}{suffixes[key]}" for key, folder in folders.items()}
        if twin := next((x for x in result if x.output == paths["output"]), None):
            raise Unreadable(f"'{twin.target}' and '{target}' would both be written to '{twin.output}'")
        result.append(argparse.Namespace(**{**vars(options), "target": target, **paths}))
    return result
