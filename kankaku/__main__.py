"""The command ``kankaku``, also ``python -m kankaku``: signals first, then everything else."""

from multiprocessing import parent_process

from kankaku import interrupts

if parent_process() is not None:
    # A worker reads the main module first.
    interrupts.end_with_parent()


def main() -> None:
    """Run the command line."""
    # Before everything else is imported, which takes a moment.
    interrupts.end_at_once()
    from kankaku.commands.app import app  # noqa: PLC0415 - see above

    app()


if __name__ == "__main__":
    main()
