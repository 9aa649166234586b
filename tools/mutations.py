"""Harm done to the files of a scenario, drawn at random."""

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

Random = np.random.Generator
VALUES = (
    *("", " ", "0", "-0", "-1", "1e-9", "1e308", "1e999", "nan", "inf", "9" * 400, "0x10", "1_0"),
    *(
        "5e-1",
        "0,5",
        "1,234",
        "+5",
        ".5",
        "5.",
        "75 km/h",
        "\uff17\uff15",
        "true",
        "'5'",
        '"5',
        "x",
    ),
    *("7:00:00", "7:00", "24:00:00", "29:59:59", "30:00:00", "99:59:59", "00:00:00", "-1:00:00"),
    *("..", ".", "a/b", "a b", "$\\frac{", "=1+1", "@x", "[red]x", "|", "\x1b[31m", "\u202e", "\0"),
    *(
        "\u666e\u901a",
        "s1",
        "t1",
        "n0",
        "unit",
        "a" * 61,
        "a" * 5000,
        "summary.csv",
        "#",
        "\n",
        ":train:",
    ),
)
TOML_VALUES = (
    *("0", "-1", "1e308", "inf", "nan", "true", '""', '"x"', "[]", "{}", "[[1]]", "1979-05-27"),
    *("07:32:00", "9" * 5000, "0x" + "f" * 5000, "[1, 2, 3]", '"\\u001b[2J"', '"$x^{"', "1", "0.5"),
    *(
        '".."',
        '"../.."',
        '"/etc"',
        "[" * 2000,
        "9223372036854775807",
        "9223372036854775808",
        "0.0333",
    ),
)


def mutate(folder: Path, random: Random) -> str:
    """
    Harm a scenario folder.

    Parameters
    ----------
    folder
        The folder; changed.
    random
        Source of chance.

    Returns
    -------
    str
        What was done.
    """
    files = sorted(path for path in folder.iterdir() if path.is_file() and not path.is_symlink())
    if not files:
        return "nothing is left"
    file = files[int(random.integers(len(files)))]
    kinds: Sequence[Callable[[Path, Random], object]] = _TABLE if file.suffix == ".csv" else _KEYS
    chance = random.random()
    if chance < 0.1:
        kinds = _BYTES
    elif chance < 0.2:
        kinds = _FILES
    harm = kinds[int(random.integers(len(kinds)))]
    harm(file, random)
    return f"{harm.__name__.strip('_')} {file.name}"


def _pick(random: Random, values: Sequence[str]) -> str:
    return values[int(random.integers(len(values)))]


def _rows(file: Path) -> list[list[str]]:
    text = file.read_bytes().decode("utf-8", "replace")
    return [line.split(",") for line in text.splitlines()] or [[""]]


def _write(file: Path, rows: Sequence[Sequence[str]]) -> None:
    text = "".join(",".join(row) + "\n" for row in rows)
    file.write_bytes(text.encode("utf-8", "replace"))


def _cell(file: Path, random: Random) -> None:
    rows = _rows(file)
    row = rows[int(random.integers(len(rows)))]
    row[int(random.integers(len(row)))] = _pick(random, VALUES)
    _write(file, rows)


def _nudged(file: Path, random: Random) -> None:
    """Change one number a little or a lot."""
    rows = _rows(file)
    places = [
        (row, column)
        for row in rows[1:]
        for column, text in enumerate(row)
        if re.fullmatch(r"-?\d+(\.\d+)?", text)
    ]
    if places:
        row, column = places[int(random.integers(len(places)))]
        change = float(random.choice([0.001, -0.001, 0.1, -0.1, 1.0, -1.0, 50.0]))
        factor = float(random.choice([1.0, 1.0, -1.0, 2.0, 0.5, 0.0]))
        row[column] = f"{float(row[column]) * factor + change:.6g}"
        _write(file, rows)


def _shifted(file: Path, random: Random) -> None:
    """Change one time of day."""
    text = file.read_bytes().decode("utf-8", "replace")
    clocks = list(re.finditer(r"\d\d:\d\d:\d\d", text))
    if clocks:
        found = clocks[int(random.integers(len(clocks)))]
        hours, minutes, rest = map(int, found.group().split(":"))
        whole = max(0, 3600 * hours + 60 * minutes + rest + int(random.integers(-200, 200)))
        told = f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}"
        file.write_bytes((text[: found.start()] + told + text[found.end() :]).encode())


def _column_cell(file: Path, random: Random) -> None:
    rows = _rows(file)
    column, value = int(random.integers(len(rows[0]))), _pick(random, VALUES)
    _write(file, [rows[0], *([*row[:column], value, *row[column + 1 :]] for row in rows[1:])])


def _row(file: Path, random: Random) -> None:
    rows = _rows(file)
    at, other = (int(value) for value in random.integers(len(rows), size=2))
    kind = int(random.integers(4))
    if kind == 0:
        rows.insert(at, list(rows[other]))
    elif kind == 1:
        del rows[at]
    elif kind == 2:
        rows[at], rows[other] = rows[other], rows[at]
    else:
        rows = rows[: at + 1]
    _write(file, rows)


def _column(file: Path, random: Random) -> None:
    rows = _rows(file)
    at, kind = int(random.integers(len(rows[0]))), int(random.integers(4))
    if kind == 0:
        rows = [row[:at] + row[at + 1 :] for row in rows]
    elif kind == 1:
        rows = [[*row, row[at] if at < len(row) else ""] for row in rows]
    elif kind == 2:
        rows[0][at] = _pick(random, (rows[0][at].upper(), f" {rows[0][at]} ", "", "x", rows[0][0]))
    else:
        rows = [row[at:] + row[:at] for row in rows]
    _write(file, rows)


def _lines(file: Path) -> list[str]:
    return file.read_bytes().decode("utf-8", "replace").splitlines()


def _value(file: Path, random: Random) -> None:
    lines = _lines(file)
    places = [at for at, line in enumerate(lines) if "=" in line]
    if places:
        at = places[int(random.integers(len(places)))]
        lines[at] = f"{lines[at].partition('=')[0]}= {_pick(random, TOML_VALUES)}"
        file.write_bytes("\n".join(lines).encode())


def _number(file: Path, random: Random) -> None:
    """Multiply one number of a file with keys."""
    text = file.read_bytes().decode("utf-8", "replace")
    found = list(re.finditer(r"(?<== )\d+(\.\d+)?(?=\n)", text))
    if found:
        one = found[int(random.integers(len(found)))]
        value = float(one.group()) * float(random.choice([0.0, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0]))
        told = f"{value:g}" if "." not in one.group() else f"{value:.4f}"
        file.write_bytes((text[: one.start()] + told + text[one.end() :]).encode())


def _key(file: Path, random: Random) -> None:
    lines = _lines(file)
    if lines:
        at, kind = int(random.integers(len(lines))), int(random.integers(5))
        if kind == 0:
            del lines[at]
        elif kind == 1:
            lines.insert(at, lines[int(random.integers(len(lines)))])
        elif kind == 2:
            lines[at] = "x" + lines[at]
        elif kind == 3:
            lines.insert(at, "a." * 40 + "a = 1")
        else:
            lines.insert(at, _pick(random, ('[controllers.".."]', '["\\u001b"]', "[x]", "[[x]]")))
        file.write_bytes("\n".join(lines).encode())


def _bytes(file: Path, random: Random) -> None:
    content = bytearray(file.read_bytes())
    for _ in range(int(random.integers(1, 5))):
        at = int(random.integers(len(content) + 1))
        content[at : at + int(random.integers(3))] = random.bytes(int(random.integers(3)))
    file.write_bytes(bytes(content))


def _cut(file: Path, random: Random) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(random.integers(len(content) + 1))])


def _encoded(file: Path, random: Random) -> None:
    text = file.read_bytes().decode("utf-8", "replace")
    encoding = _pick(random, ("utf-16", "latin-1", "shift_jis", "utf-8-sig", "utf-32", "utf-7"))
    file.write_bytes(text.replace("\n", "\r\n").encode(encoding, "replace"))


def _separated(file: Path, random: Random) -> None:
    text = file.read_bytes().decode("utf-8", "replace")
    file.write_bytes(text.replace(",", _pick(random, (";", "\t", ", ", ",,", "|"))).encode())


def _removed(file: Path, _: Random) -> None:
    file.unlink()


def _renamed(file: Path, random: Random) -> None:
    name = _pick(random, (file.name.upper(), f"{file.stem}s{file.suffix}", f"{file.name}.bak"))
    file.rename(file.with_name(name))


def _swapped(file: Path, random: Random) -> None:
    others = sorted(path for path in file.parent.iterdir() if path.is_file())
    other = others[int(random.integers(len(others)))]
    file.write_bytes(other.read_bytes())


def _linked(file: Path, random: Random) -> None:
    file.unlink()
    target = _pick(random, ("nowhere", ".", file.name, "/dev/zero", "/dev/null", "/proc/self/mem"))
    file.symlink_to(target)


def _pipe(file: Path, _: Random) -> None:
    file.unlink()
    os.mkfifo(file)


def _folder(file: Path, _: Random) -> None:
    file.unlink()
    file.mkdir()


def _repeated(file: Path, random: Random) -> None:
    content = file.read_bytes()
    file.write_bytes(content * int(random.integers(2, 200)))


_BYTES = (_bytes, _cut, _encoded, _separated)
_FILES = (_removed, _renamed, _swapped, _linked, _pipe, _folder, _repeated)
_TABLE = (_cell, _nudged, _nudged, _shifted, _column_cell, _row, _column)
_KEYS = (_value, _number, _number, _key)
