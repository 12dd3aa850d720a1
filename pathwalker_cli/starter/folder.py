"""A new folder on disk: all of it, or nothing."""

from __future__ import annotations

from pathlib import Path

from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import DataError, PatientError
from pathwalker_cli.inverse.recorded_files import staged_folder
from pathwalker_cli.patient import load_patient
from pathwalker_cli.starter.child import Child
from pathwalker_cli.starter.files import folder_files

__all__ = ["check_new", "write_folder"]


def check_new(folder: Path) -> None:
    """Refuse a folder that holds anything.

    Raises:
        DataError: If it does, or is a file.
    """
    if folder.exists() and not folder.is_dir():
        raise DataError("is a file, not a folder", where=str(folder), mend="choose another name")
    inside = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    if inside:
        raise DataError(
            f"is not empty: it holds {inside[0]}",
            where=str(folder),
            allowed="a new or empty folder",
            mend="choose another name",
        )


def write_folder(folder: Path, child: Child, worn: bool, example: bool) -> None:
    """Write a new folder for a child.

    Args:
        folder: The folder; new or empty.
        child: The made-up child to begin with.
        worn: Whether there is an orthosis.
        example: Whether to make C3D files of the child.

    Raises:
        DataError: If the folder is not empty or cannot be written.
        PatientError: If no child of these numbers is accepted.
    """
    check_new(folder)
    with staged_folder(folder) as staging:
        for name, text in folder_files(child, worn, example).items():
            (staging / name).write_text(text, encoding="utf-8")
        try:
            patient = load_patient(staging)
        except PatientError as error:
            where = f"--{error.where.rpartition(' ')[2].replace('body_', '')}"
            raise PatientError(error.what, where=where, allowed=error.allowed) from None
        if example:
            from pathwalker_cli.starter.example import write_example

            write_example(staging, patient, CONDITIONS if worn else ("barefoot",))
