"""A page cites what the project's own citation file cites."""

import re
from pathlib import Path

from kankaku.analysis.page.citing import PAPERS, TITLE, citation

CITED = (Path(__file__).parents[2] / "CITATION.cff").read_text("utf-8")
WORKS = CITED.split("  - type: article")[1:]
"""What the file says of each paper."""


def test_the_program_is_cited_as_its_file_says() -> None:
    assert f'title: "{TITLE}"' in CITED
    told = citation([])
    assert TITLE in told["text"]
    assert TITLE in told["bibtex"]
    assert told["papers"] == []


def test_every_paper_stands_in_the_file() -> None:
    for paper in PAPERS.values():
        (work,) = [one for one in WORKS if re.findall(r'title: "(.*)"', one)[0] in paper]
        assert re.findall(r"year: (\d+)", work)[0] in paper
        for author in re.findall(r"family-names: (\w+)", work):
            assert author in paper


def test_the_papers_of_the_layers_that_ran_are_cited() -> None:
    layers = [{"protection": "moving_block", "operation": "two_stage_plain"}, {"peer": "another"}]
    assert citation(layers)["papers"] == [PAPERS["two_stage"]]
