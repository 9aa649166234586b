"""What the command ``import`` shows: what came out, and what it rests on."""

from pathlib import Path

from kankaku.commands.screen import answers, complain
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import write_files
from kankaku.scenarios.drafts.provenance_notes import SOURCES_FILE
from kankaku.scenarios.importing.formats import Wish, imported


def import_source(name: str, source: Path, folder: Path, wish: Wish, *, force: bool) -> int:
    """
    Import a source into a folder.

    Parameters
    ----------
    name
        Of the format.
    source
        File or folder.
    folder
        Where the scenario is written.
    wish
        What is asked for.
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        draft = imported(name, source, wish)
        write_files(draft.files(), folder, force=force)
    except KankakuError as error:
        complain(f"{source} {error.verdict}", error.sentences)
    notes = draft.notes
    stations, trains = (len(draft.rows[file]) for file in ("stations.csv", "services.csv"))
    answers.print(f"{draft.title}: {stations} stations, {trains} trains.")
    answers.print(
        f"{len(notes.taken)} things taken, {len(notes.assumed)} assumed, {len(notes.missing)} "
        f"missing: see {folder / SOURCES_FILE}."
    )
    return 0
