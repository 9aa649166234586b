"""What somebody types about a line of his own, and every mistake in it at once."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from kankaku.railway.errors import suggesting
from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.own_line import LineWish, OwnLineError
from kankaku.scenarios.drafts.regular_times import Working
from kankaku.scenarios.drafts.sketch import Stop
from kankaku.scenarios.drafts.station_texts import stations_of
from kankaku.scenarios.drafts.stock_library import LibraryTrain, library_train
from kankaku.scenarios.drafts.train_figures import train_of_figures
from kankaku.scenarios.reading.cell_texts import clock, text_trouble
from kankaku.scenarios.reading.units import whole_seconds

T = TypeVar("T")
DEFAULT_TRAIN = "metro"
RANGES: Mapping[str, tuple[float, float, str]] = {
    "headway": (30, 7200, "whole seconds"),
    "turn_back": (20, 3600, "whole seconds"),
    "dwell": (15, 600, "whole seconds"),
    "supplement": (0, 100, "per cent"),
    "terminal_tracks": (1, 8, "a whole number"),
}
"""Allowed figures by answer."""
EARLIEST_S, LONGEST_S = 600, 24 * 3600
MOST_WORKINGS = 4


@dataclass(frozen=True, slots=True)
class LineAnswers:
    """Texts as they were typed; an empty one was not said."""

    stations: str = ""
    title: str = ""
    headway: str = ""
    from_time: str = ""
    until_time: str = ""
    pattern: str = ""
    turn_back: str = ""
    dwell: str = ""
    supplement: str = ""
    terminal_tracks: str = ""
    train: str = ""
    train_figures: str = ""
    driving: str = ""
    single_track: bool = False


class HasTimes(Protocol):
    """Texts of two times of day."""

    @property
    def from_time(self) -> str:
        """First trains."""
        ...

    @property
    def until_time(self) -> str:
        """Last trains."""
        ...


def wish_of(answers: LineAnswers, name: str) -> LineWish:
    """
    Return what somebody wants.

    Parameters
    ----------
    answers
        What was typed.
    name
        Title where none was.

    Returns
    -------
    LineWish
        Figures, each one sensible for itself.

    Raises
    ------
    OwnLineError
        With everything that is wrong.
    """
    mistakes: list[str] = []
    read = stations_of(answers.stations)
    mistakes += read.mistakes
    train = _train(answers, mistakes)
    begin_s, end_s = times_of(answers, mistakes)
    workings = _or_note(lambda: workings_of(answers.pattern, read.stops), mistakes)
    if answers.single_track and workings and len(workings) > 1:
        mistakes.append("--pattern: several workings; allowed: one with --single-track")
    if answers.driving not in {"", "left", "right"}:
        mistakes.append(f"--driving: {answers.driving!r}; allowed: left, right")
    title = answers.title.strip() or name
    if text_trouble(title):
        mistakes.append(f"--title: {title!r}; allowed: {text_trouble(title)}")
    fields = {key: figure_of(answers, key, mistakes) for key in RANGES}
    if mistakes or train is None or workings is None:
        raise OwnLineError(mistakes)
    usual = LineWish(title, read.stops, train)
    tracks = fields["terminal_tracks"]
    return LineWish(
        title,
        read.stops,
        train,
        int(_said(fields["headway"], usual.headway_s)),
        begin_s,
        end_s,
        workings,
        int(_said(fields["turn_back"], usual.turn_back_s)),
        int(_said(fields["dwell"], usual.dwell_s)),
        _said(fields["supplement"], usual.supplement_percent),
        None if tracks is None else int(tracks),
        answers.single_track,
        answers.driving != "right",
        _given(answers),
    )


def _said(figure: float | None, usual: float) -> float:
    return usual if figure is None else figure


def _given(answers: LineAnswers) -> frozenset[str]:
    names = {
        "headway_s": answers.headway,
        "turn_back_s": answers.turn_back,
        "dwell_s": answers.dwell,
        "supplement_percent": answers.supplement,
        "train": answers.train or answers.train_figures,
        "left_hand": answers.driving,
    }
    return frozenset(name for name, text in names.items() if text)


def figure_of(answers: object, key: str, mistakes: list[str]) -> float | None:
    """
    Return a number that was typed.

    Parameters
    ----------
    answers
        Has a text of that name.
    key
        One of ``RANGES``.
    mistakes
        What is wrong is added.

    Returns
    -------
    float | None
        Nothing if it was not said, or is wrong.
    """
    text: str = getattr(answers, key).strip().removesuffix("s").removesuffix("%").strip()
    if not text:
        return None
    least, most, kind = RANGES[key]
    option = f"--{key.replace('_', '-')}"
    try:
        figure = float(text)
    except ValueError:
        figure = float("nan")
    # Not a number lies between no two of them.
    inside = least <= figure <= most
    if not inside or (key != "supplement" and figure != round(figure)):
        told = getattr(answers, key)
        mistakes.append(f"{option}: {told!r}; allowed: {kind}, {least:g} to {most:g}")
        return None
    return figure


def _or_note(make: Callable[[], T], mistakes: list[str]) -> T | None:
    try:
        return make()
    except (OwnLineError, DraftError) as error:
        mistakes.extend(error.sentences)
        return None


def _train(answers: LineAnswers, mistakes: list[str]) -> LibraryTrain | None:
    figures = answers.train_figures or (answers.train if "=" in answers.train else "")
    if figures:
        if answers.train not in {"", figures}:
            mistakes.append("--train: stands beside --train-figures; allowed: one of the two")
        read = train_of_figures(figures)
        mistakes += read.mistakes
        return read.train
    name = answers.train or DEFAULT_TRAIN
    return _or_note(lambda: library_train(name), mistakes)


def times_of(answers: HasTimes, mistakes: list[str]) -> tuple[int, int]:
    """
    Return when first and last trains begin.

    Parameters
    ----------
    answers
        Have two texts.
    mistakes
        What is wrong is added.

    Returns
    -------
    tuple[int, int]
        Seconds after midnight. [s]
    """
    begin_s = clock_s(answers.from_time or "07:00:00", "--from", mistakes)
    end_s = clock_s(answers.until_time or "08:00:00", "--until", mistakes)
    if begin_s is None or end_s is None:
        return 0, 0
    if begin_s < EARLIEST_S:
        mistakes.append("--from: too early; allowed: 00:10 or later, trains stand ready before")
    if not 0 <= end_s - begin_s <= LONGEST_S:
        told = (
            f"--until: {answers.until_time or '08:00'} with --from {answers.from_time or '07:00'}"
        )
        mistakes.append(f"{told}; allowed: up to 24 h later; after midnight hours go on with 24")
    return begin_s, end_s


def clock_s(text: str, option: str, mistakes: list[str]) -> int | None:
    """
    Return a time of day that was typed.

    Parameters
    ----------
    text
        ``HH:MM`` or ``HH:MM:SS``.
    option
        Where it was typed.
    mistakes
        What is wrong is added.

    Returns
    -------
    int | None
        Seconds after midnight, or nothing. [s]
    """
    plain = text.strip()
    told = clock(f"{plain}:00" if plain.count(":") == 1 else plain)
    if told is None:
        mistakes.append(f"{option}: {text!r}; allowed: a time of day as HH:MM or HH:MM:SS")
        return None
    return whole_seconds(told)


def workings_of(pattern: str, stops: Sequence[Stop]) -> tuple[Working, ...]:
    """
    Return between which stations trains run.

    Parameters
    ----------
    pattern
        ``Airport to Zoo, City to Zoo``: the workings take turns; from end to end if empty or
        ``full``.
    stops
        Stations by rising chainage.

    Returns
    -------
    tuple[Working, ...]
        Empty if nothing is known of the stations.

    Raises
    ------
    OwnLineError
        With everything that is wrong.
    """
    if not stops:
        return ()
    ends = Working(stops[0].id, stops[-1].id)
    names = {stop.name.casefold(): stop.id for stop in stops} | {stop.id: stop.id for stop in stops}
    order = [stop.id for stop in stops]
    found: list[Working] = []
    mistakes = []
    for part in filter(None, (piece.strip() for piece in pattern.split(","))):
        if part.casefold() == "full":
            found.append(ends)
            continue
        pair = [piece.strip().casefold() for piece in part.split(" to ")]
        unknown = [name for name in pair if name not in names]
        if len(pair) != 2 or unknown or pair[0] == pair[1]:
            told = ", ".join(stop.name for stop in stops)
            allowed = suggesting(unknown[0], [*names], told) if unknown else told
            mistakes.append(
                f"--pattern: {part!r}; allowed: full, or STATION to STATION, of {allowed}"
            )
            continue
        low, high = sorted((names[name] for name in pair), key=order.index)
        found.append(Working(low, high))
    if len(found) > MOST_WORKINGS:
        mistakes.append(f"--pattern: {len(found)} workings; allowed: up to {MOST_WORKINGS}")
    if mistakes:
        raise OwnLineError(mistakes)
    return tuple(found) or (ends,)
