"""Why a text is no number, time, name or identifier, as its writer would say it."""

import re
import unicodedata
from collections.abc import Callable
from datetime import date, time

SHOWN = 60
"""Characters of a wrong value that are shown. [-]"""
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_CLOCK = re.compile(r"([0-9]{1,2}):([0-5][0-9]):([0-5][0-9])")
_COLONS = re.compile(r"[0-9]{1,4}(?::[0-9]{1,2}){1,2}")
_IDENTIFIER_LENGTH = 60
_TEXT_LENGTH = 200
_TURNING = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
_BREAKS = frozenset("\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029")


def number(text: str) -> float | None:
    """
    Return the number that a text is.

    Parameters
    ----------
    text
        The text, spaces around it allowed.

    Returns
    -------
    float | None
        The number, infinite if it is out of range; nothing if the text is none. Any unit
    """
    stripped = text.strip()
    return float(stripped) if NUMBER.fullmatch(stripped) else None


def clock(text: str) -> str | None:
    """
    Return a time of day in one form, so that later times sort later.

    Parameters
    ----------
    text
        ``H:MM:SS`` or ``HH:MM:SS``, hours 0 to 99.

    Returns
    -------
    str | None
        ``HH:MM:SS``; nothing if the text is no time.
    """
    found = _CLOCK.fullmatch(text)
    return f"{int(found[1]):02d}:{found[2]}:{found[3]}" if found else None


def shown(value: object) -> str:
    """
    Return a value as a refusal quotes it: short, and harmless to a terminal.

    Parameters
    ----------
    value
        Anything that a file holds.

    Returns
    -------
    str
        At most some eighty characters.
    """
    if isinstance(value, str):
        return repr(value) if len(value) <= SHOWN else f"{value[:SHOWN]!r}..."
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**SHOWN:
        return "a number of more than 60 digits"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple) and (len(value) > 5 or any(map(_is_nested, value))):
        return f"a list of {len(value)}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(shown, value))}]"
    return repr(value)


def _is_nested(value: object) -> bool:
    return isinstance(value, list | tuple | dict)


def printable(text: str) -> str:
    r"""
    Return a text without anything that moves a cursor, colours a screen or turns a line round.

    Parameters
    ----------
    text
        Any text.

    Returns
    -------
    str
        The same, with ``\x1b`` and the like in place of such characters.
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in text)


def text_trouble(value: str) -> str:
    """
    Return why a text cannot be a name that people read.

    Parameters
    ----------
    value
        The text.

    Returns
    -------
    str
        Why not; empty if it can.
    """
    if not value.strip():
        return "has nothing but spaces" if value else ""
    for one in value:
        if one in _BREAKS:
            return "has a line break; is a quotation mark missing?"
        if unicodedata.category(one) in {"Cc", "Cs"}:
            return f"has the control character U+{ord(one):04X}"
        if one in _TURNING:
            return f"has U+{ord(one):04X}, which turns the direction of writing"
    return f"has {len(value)} characters" if len(value) > _TEXT_LENGTH else ""


def identifier_trouble(value: object) -> str:
    """
    Return why a value cannot be an identifier.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Why not; empty if nothing can be said.
    """
    if not isinstance(value, str):
        return ""
    odd = list(dict.fromkeys(one for one in value if not _fits_identifier(one)))
    if odd:
        named = ", ".join("a space" if one == " " else printable(one) for one in odd[:3])
        return f"has {named}{' and others' if len(odd) > 3 else ''}"
    return f"has {len(value)} characters" if len(value) > _IDENTIFIER_LENGTH else ""


def _fits_identifier(one: str) -> bool:
    return one.isascii() and (one.isalnum() or one in "_.-")


def number_trouble(value: object) -> str:
    """
    Return why a value is no number.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Why not, with the number that was probably meant; empty if nothing can be said.
    """
    if isinstance(value, bool):
        return "is true or false"
    if not isinstance(value, str):
        return ""
    text = value.strip()
    if NUMBER.fullmatch(text):
        return ""
    return next((told for look in _NUMBER_TROUBLES if (told := look(text))), "")


def quoted_trouble(value: object) -> str:
    """
    Return why a value of a TOML file is no number.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Why not; empty if nothing can be said.
    """
    if isinstance(value, str) and number(value) is not None:
        return f"is a number in quotation marks; write {value.strip()}"
    return number_trouble(value)


def _wide(text: str) -> str:
    """Look for digits and signs that are not those of ASCII."""
    folded = unicodedata.normalize("NFKC", text).replace("\N{MINUS SIGN}", "-")
    folded = folded.replace("\N{EN DASH}", "-")
    plain = "".join(
        str(unicodedata.digit(one)) if one.isdigit() and not one.isascii() else one
        for one in folded
    )
    if plain != text and NUMBER.fullmatch(plain):
        return f"has characters other than 0-9, '-' and '.'; write {plain}"
    return ""


def _comma(text: str) -> str:
    if re.fullmatch(r"[+-]?[0-9]{1,3}(,[0-9]{3}){2,}(\.[0-9]+)?|[+-]?[0-9,]+\.[0-9]+", text):
        return f"has commas between thousands; write {text.replace(',', '')}"
    if re.fullmatch(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}", text):
        other = text.replace(",", ".")
        return f"has a comma; write {text.replace(',', '')} or {other}, whichever is meant"
    if re.fullmatch(r"[+-]?[0-9]*,[0-9]+", text):
        return f"has a decimal comma; write {text.replace(',', '.')}"
    return ""


def _separated(text: str) -> str:
    bare = re.sub(r"(?<=[0-9])[ _'\u00a0\u2009\u202f\u2019](?=[0-9])", "", text)
    if bare != text and NUMBER.fullmatch(bare):
        return f"has separators between digits; write {bare}"
    return ""


def _unit(text: str) -> str:
    found = re.fullmatch(
        r"([+-]?[0-9]+(?:\.[0-9]+)?)\s*([^\W\d_]{1,8}\S{0,8}|[%\u2030\u00b0])", text
    )
    return f"has a unit; write {found[1]}" if found else ""


def _marks(text: str) -> str:
    bare = text.strip("\"'\u201c\u201d\u2018\u2019 ")
    if bare != text and NUMBER.fullmatch(bare):
        return f"has quotation marks; write {bare}"
    return ""


def _no_number(text: str) -> str:
    if text.lower().lstrip("+-") in {"nan", "inf", "infinity", "\u221e"}:
        return "is no finite number"
    return "is true or false" if text.lower() in {"true", "false"} else ""


_NUMBER_TROUBLES: tuple[Callable[[str], str], ...] = (
    _wide,
    _comma,
    _separated,
    _no_number,
    _marks,
    _unit,
)


def clock_trouble(value: object) -> str:
    """
    Return why a value is no time of day.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Why not; empty if nothing can be said.
    """
    if isinstance(value, date):
        return "is a date"
    if isinstance(value, time):
        return f'has no quotation marks; write "{value.isoformat()}"'
    if not isinstance(value, str):
        return ""
    return next((told for look in _CLOCK_TROUBLES if (told := look(value))), "")


def _wide_clock(value: str) -> str:
    folded = unicodedata.normalize("NFKC", value)
    if folded != value and clock(folded):
        return f"has characters other than 0-9 and ':'; write {folded}"
    return ""


def _other_clock(value: str) -> str:
    if re.fullmatch(r"[0-9:. ]+[ap]\.?m\.?", value, re.IGNORECASE):
        return "has am or pm; write hours from 0 on"
    if re.fullmatch(r"[0-9]{1,2}:[0-5][0-9]", value):
        return f"has no seconds; write {value}:00"
    if re.fullmatch(r"[0-9]{1,2}:[0-9]{2}:[0-9]{2}[.,][0-9]+", value):
        return f"has a fraction of a second; write {re.split('[.,]', value)[0]}"
    return ""


def _dated(value: str) -> str:
    begins = r"[0-9]{4}[-/.][0-9]{1,2}[-/.][0-9]{1,2}|[0-9]{1,2}[-/.][0-9]{1,2}[-/.]"
    return "has a date" if re.match(begins, value) else ""


def _clock_numbers(value: str) -> str:
    if _COLONS.fullmatch(value):
        hours = int(value.partition(":")[0])
        return "has an hour above 99" if hours > 99 else "has minutes or seconds above 59"
    if number(value) is not None:
        return "is a number, as spreadsheets keep times; format the column as HH:MM:SS"
    return ""


_CLOCK_TROUBLES = (_wide_clock, _other_clock, _dated, _clock_numbers)
