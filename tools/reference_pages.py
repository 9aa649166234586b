"""Write the page of the documentation that tells every column and key of a scenario."""

from pathlib import Path

from kankaku.scenarios.describing.reference_page import reference_page

PAGE = "columns_and_keys.md"


def write_reference(folder: Path) -> None:
    """
    Write the page; one that is as it was is left alone.

    Parameters
    ----------
    folder
        Where it goes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text, file = reference_page(), folder / PAGE
    if not file.is_file() or file.read_text("utf-8") != text:
        file.write_text(text, "utf-8")
