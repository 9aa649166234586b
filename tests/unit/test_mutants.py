"""The mutants fit the source: each of their texts stands there exactly once."""

from pathlib import Path

import pytest

from tools.mutants.catalogue import MUTANTS, Mutant

PROJECT = Path(__file__).parents[2]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_what_a_mutant_replaces_stands_in_the_source_once(mutant: Mutant) -> None:
    for patch in mutant.patches:
        text = (PROJECT / patch.file).read_text("utf-8")
        assert text.count(patch.old) == 1
        assert patch.new != patch.old
