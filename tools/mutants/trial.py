"""One run in a process of its own: prints what was seen of it, as JSON."""

import json
import sys
from pathlib import Path
from typing import Any

from kankaku.studies import study


def seen_in_run(folder: Path, controller: str) -> list[dict[str, Any]]:
    """
    Return what monitor and SUMO see in a run.

    Parameters
    ----------
    folder
        Scenario folder.
    controller
        Which of its controllers runs.

    Returns
    -------
    list[dict[str, Any]]
        ``by``, ``time_s`` since the first train stood ready and ``message`` of every violation, by
        time; last of all, without a time, what ended the run.
    """
    chosen = study.choose(folder, names=(controller,))
    (spec,), (seed,) = chosen.specs, chosen.seeds
    services = chosen.scenario.timetable.services
    begin_s = min(service.calls[0].arrival_s for service in services)
    try:
        record = study.run_once(chosen.scenario, spec, seed, chosen.step_s)
    except Exception as error:  # noqa: BLE001 - whatever a mutant does to the run is seen
        return [{"by": type(error).__name__, "time_s": None, "message": str(error)}]
    found: list[dict[str, Any]] = [
        {"by": v.kind, "time_s": v.time_s - begin_s, "message": v.message}
        for v in record.violations
    ]
    return found


def main() -> None:
    """Run the scenario and the controller that the command line names."""
    folder, controller = sys.argv[1:]
    sys.stdout.write(json.dumps(seen_in_run(Path(folder), controller)) + "\n")


if __name__ == "__main__":
    main()
