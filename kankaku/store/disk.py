"""What has to be on the disk before anything else happens."""

import os
from contextlib import suppress
from pathlib import Path


def to_disk(path: Path) -> None:
    """
    Wait until a file, or the names in a folder, are on the disk, so that a power cut leaves them.

    Parameters
    ----------
    path
        The file or folder.
    """
    number = os.open(path, os.O_RDONLY)
    try:
        # Some disks cannot, and need not be asked twice.
        with suppress(OSError):
            os.fsync(number)
    finally:
        os.close(number)
