"""A command's output files: they appear all together, complete, or not at all, and take nothing else's place."""

from __future__ import annotations

import filecmp
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..mesh_data import Refusal
from .parts import own_parts
from .temporary import temporary_folder
from .unreadable import Unreadable


def real_place(path: Path) -> Path:
    """Return where a path leads, whatever links are on the way; the last file need not be there."""
    return Path(os.path.realpath(path))


def require_place(path: Path) -> None:
    """Raise `Unreadable` if no file can be written, or replaced, at `path`; see also `require_folder`."""
    place = real_place(path)
    try:
        place.lstat()
    except FileNotFoundError:
        pass
    except OSError as error:  # as a name that is too long
        raise Unreadable(f"'{path}' cannot be written: {error.strerror}") from error
    if place.is_dir():
        raise Unreadable(f"'{path}' is a folder: name a file to write")
    if place.is_symlink() or (place.exists() and not place.is_file()):
        raise Unreadable(f"'{path}' is no file that can be replaced: name another one")
    if not place.parent.is_dir():
        raise Unreadable(f"there is no folder '{path.parent}' to write '{path.name}' in")
    if place.exists() and not os.access(place, os.W_OK):
        raise Unreadable(f"'{path}' is write-protected: name another file, or allow writing")


def require_folder(folder: Path) -> None:
    """Raise `Unreadable` if nothing can be written in `folder`."""
    try:
        with temporary_folder(folder):
            pass
    except OSError as error:
        raise Unreadable(f"nothing can be written in the folder '{folder}' ({error.strerror})") from error


@dataclass(frozen=True)
class _Output:
    """A file to come: where it is written, and where it belongs."""

    written: Path
    final: Path
    backup: bool

    def beside(self) -> Iterator[tuple[Path, Path]]:
        """Yield the files that an exporter put beside it, and where these belong."""
        folder = self.written.parent
        if folder.parent != self.final.parent:  # a folder of its own
            for path in sorted(folder.rglob("*")):
                if path.is_file() and path != self.written:
                    yield path, self.final.parent / path.relative_to(folder)


class Outputs:
    """Files that appear all together, complete, or not at all.

    Each is written in a hidden folder beside its place, a .blend as a hidden file there, since its relative paths are
    those of its folder; when everything has succeeded they are moved. A file that is replaced hands on its permissions.
    """

    def __init__(self, folders: ExitStack) -> None:
        self._stack = folders
        self._folders: dict[Path, Path] = {}
        self._outputs: list[_Output] = []

    def path(self, final: Path, name: str | None = None, *, backup: bool = False) -> Path:
        """Return where to write what is to become `final`.

        Parameters
        ----------
        final : Path
            A link is followed to what it points to. Its folder is made if it is not there.
        name : str, optional
            The file's name until then, after which an exporter names what it puts beside it.
        backup : bool
            Keep the file that is there as Blender does, with a number after its name.
        """
        final = real_place(final)
        home = final.parent if final.parent.is_dir() else final.parent.parent
        if home not in self._folders:
            self._folders[home] = self._stack.enter_context(temporary_folder(home))
        folder, number = self._folders[home], len(self._outputs)
        if final.suffix.lower() == ".blend":
            written = folder.with_name(f"{folder.name}.{number}.blend")
        else:
            (folder / str(number)).mkdir()
            written = folder / str(number) / (name or final.name)
        self._outputs.append(_Output(written, final, backup))
        return written

    def publish(self) -> None:
        """Move everything that was written to its place.

        Raises
        ------
        Refusal
            Something that is not ours is in the way; nothing was moved.
        OSError
            A file could not be moved; everything is as it was.
        """
        beside = [move for output in self._outputs for move in self._beside(output)]
        moves = [*beside, *((output.written, output.final) for output in self._outputs)]
        for written, final in moves:
            _finish(written, final)
        replaced: dict[Path, Path] = {}
        with ExitStack() as undo:
            for number, (written, final) in enumerate(moves):
                if not final.parent.is_dir():
                    final.parent.mkdir()
                    undo.callback(_quietly, final.parent.rmdir)
                if final.exists():
                    replaced[final] = self._folder_of(final) / f"replaced {number}"
                    _keep(final, replaced[final])
                    undo.callback(_quietly, lambda final=final: replaced[final].replace(final))
                else:
                    undo.callback(_quietly, lambda final=final: final.unlink())
                written.replace(final)
            undo.pop_all()
        for output in self._outputs:
            if output.backup and output.final in replaced:
                _number_versions(output.final, replaced[output.final])

    def _folder_of(self, final: Path) -> Path:
        return next(folder for parent, folder in self._folders.items() if final.is_relative_to(parent))

    @staticmethod
    def _beside(output: _Output) -> Iterator[tuple[Path, Path]]:
        """Yield what is to be moved beside an output: what is there already with the same content stays."""
        own = own_parts(output.final)
        for written, final in output.beside():
            if final.exists() or final.is_symlink():
                if final.is_file() and filecmp.cmp(written, final, shallow=False):
                    continue
                if final not in own:
                    raise Refusal(
                        f"'{output.final.name}' needs a file '{final}' beside it, and another one is there: "
                        "choose another name or folder"
                    )
            yield written, final


def _keep(path: Path, kept: Path) -> None:
    """Give a file a second name, or a copy where the file system has no links."""
    try:
        os.link(path, kept)
    except OSError:
        shutil.copy2(path, kept)


def _number_versions(final: Path, replaced: Path) -> None:
    """Number what was replaced as Blender does: name.blend1 is the last, .blend2 the one before it."""
    count = max(1, bpy.context.preferences.filepaths.save_version)
    for number in range(count, 1, -1):
        older = final.with_name(f"{final.name}{number - 1}")
        if older.exists():
            older.replace(final.with_name(f"{final.name}{number}"))
    replaced.replace(final.with_name(f"{final.name}1"))


def _finish(written: Path, final: Path) -> None:
    """Have the disk hold all of a file, and give it the permissions of the one that it replaces."""
    with written.open("rb+") as file:
        os.fsync(file.fileno())
    if final.exists():
        shutil.copymode(final, written)
        if hasattr(os, "chown"):
            there = final.stat()
            with suppress(OSError):  # only the administrator gives files away
                os.chown(written, there.st_uid, there.st_gid)


def _quietly(action: Callable[[], object]) -> None:
    with suppress(OSError):
        action()


@contextmanager
def outputs() -> Iterator[Outputs]:
    """Collect the output files of a command; an exception leaves none of them behind.

    Raises
    ------
    Refusal
        The disk is full, or a file cannot be written for another reason.
    """
    with ExitStack() as folders:
        collected = Outputs(folders)
        try:
            yield collected
            collected.publish()
        except OSError as error:
            where = f" ('{error.filename}')" if error.filename else ""
            raise Refusal(f"nothing was written: {error.strerror or error}{where}") from error
