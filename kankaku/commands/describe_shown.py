"""What the command ``describe`` shows: files, columns and keys, or their schemas for editors."""

from pathlib import Path

from kankaku.commands.screen import answers, complain
from kankaku.commands.told_tables import path_line
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.describing.described_files import find_described
from kankaku.scenarios.describing.json_schemas import json_schemas
from kankaku.scenarios.describing.told_reference import told_file, told_files
from kankaku.scenarios.drafts.draft import write_files


def describe_files(asked: str) -> int:
    """
    Tell what is asked for.

    Parameters
    ----------
    asked
        A file, perhaps with a column or key; all files if it is empty.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        lines = told_file(*find_described(asked)) if asked else told_files()
    except KankakuError as error:
        complain(f"{asked} {error.verdict}", error.sentences, error.pointer)
    for line in lines:
        answers.print(line, markup=False, highlight=False, soft_wrap=True)
    return 0


def write_schemas(folder: Path) -> int:
    """
    Write the JSON Schema of every file.

    Parameters
    ----------
    folder
        Made if missing; schemas of before are replaced, being of the program that runs.

    Returns
    -------
    int
        How the command ends.
    """
    schemas = json_schemas()
    try:
        write_files(schemas, folder, force=True)
    except KankakuError as error:
        complain(f"{folder} cannot be written", error.sentences)
    path_line("Schemas", folder)
    answers.print(f"{len(schemas)} files, a schema each.", highlight=False)
    return 0
