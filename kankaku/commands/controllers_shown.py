"""What ``--list-controllers`` shows."""

from pathlib import Path

from rich.markup import escape
from rich.table import Table

from kankaku.commands.listing import Listing, controllers_of, known_controllers
from kankaku.commands.screen import answers, refusals
from kankaku.commands.shared_options import OUT
from kankaku.scenarios.shipped import folder_of


def list_controllers(scenario: Path | None) -> None:
    """
    Show the controllers of a scenario; without one, all that a scenario can name.

    Parameters
    ----------
    scenario
        Its folder or name.
    """
    if scenario is None:
        for listing in known_controllers():
            _show_listing(listing)
        answers.print(
            "A scenario names controllers as pairs of protection and operation, with a supervision "
            "if they have one, or as a peer: see its scenario.toml. Any other pair is "
            "--controller protection+operation, or protection+operation+supervision."
        )
        return
    from kankaku.scenarios.loading.load import load  # noqa: PLC0415 - nobody else needs it

    with refusals(scenario, OUT):
        chosen = load(folder_of(scenario))
        listing = controllers_of(chosen.title, chosen.controllers)
    _show_listing(listing)


def _show_listing(listing: Listing) -> None:
    table = Table(*listing.header, title=escape(listing.title), title_justify="left")
    for row in listing.rows:
        table.add_row(*map(escape, row))
    answers.print(table)
