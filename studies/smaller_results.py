"""Makes results small before they are published: one archive of all answers, a series without its gaps."""

import shutil
import zipfile
from pathlib import Path

from harness.results.answer_files import ARCHIVE
from harness.results.series_file import connected


def pack(directory: Path) -> None:
    """Let DIRECTORY/answers.zip take the place of DIRECTORY/answers; the same answers give the same bytes."""
    folder = directory / "answers"
    files = sorted(folder.glob("*.npz"))
    if files:
        with zipfile.ZipFile(directory / ARCHIVE, "w") as archive:
            for path in files:
                archive.writestr(zipfile.ZipInfo(path.name), path.read_bytes(), zipfile.ZIP_LZMA)
        shutil.rmtree(folder)


def drop_gaps(directory: Path) -> None:
    """Keep the rows of a series alone, in a smaller file."""
    with connected(directory, "EXCLUSIVE") as connection:
        connection.execute("UPDATE cases SET gap = NULL")
        connection.commit()
        connection.execute("VACUUM")
