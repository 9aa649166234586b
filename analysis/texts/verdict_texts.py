"""The verdict of a study in a sentence or two, in English and in Japanese."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from kankaku.analysis.tables.across_tables import DELAY, ENERGY, STOPS
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.analysis.tables.verdict import Change, Leader, Mark, Verdict
from kankaku.analysis.texts.comparison_texts import change_text, mean_text

LANGUAGES: Final = ("en", "ja")

_WORDS: Final[Mapping[str, Mapping[str, str]]] = {
    "en": {
        "alone": "{name}: trains stand {stops} between stations, mean arrival delay {delay}, "
        "net energy {energy}.",
        "nobody": "No controller can be recommended: each one violated a safety rule, left trains "
        "under way or knows the future.",
        "baseline_best": "No controller stands less between stations than {name} ({mean}).",
        "best": "{name} stands least between stations ({mean}, {change} against {baseline})",
        "delay_alike": "costs no delay",
        "delay_better": "lowers the mean arrival delay by {difference}",
        "delay_worse": "raises the mean arrival delay by {difference}",
        "energy_alike": "takes as much energy",
        "energy_better": "takes less net energy ({change})",
        "energy_worse": "takes more net energy ({change})",
        "join": "{first}; it {second} and {third}.",
        "least_delay": "Least delayed is {name} ({mean}, {change}).",
        "least_energy": "Least net energy takes {name} ({mean}, {change}).",
        "most": "{name} stands most ({mean}).",
        "safe": "No safety rule was violated.",
        "unsafe": "Safety rules were VIOLATED under {names}: do not use their other figures.",
        "finished": "Every train finished.",
        "unfinished": "Trains were still under way at the end under {names}.",
        "between": " ",
        "comma": ", ",
    },
    "ja": {
        "alone": "{name}:駅間停車 {stops}、平均到着遅延 {delay}、正味電力量 {energy}。",
        "nobody": "推奨できる制御方式はない。いずれも安全規則に違反したか、未完了の列車を残したか、"
        "将来を知っている。",
        "baseline_best": "{name}({mean})より駅間停車の少ない制御方式はない。",
        "best": "駅間停車が最も少ないのは {name}({mean}、{baseline} 比 {change})",
        "delay_alike": "遅延は増えず",
        "delay_better": "平均到着遅延を {difference} 減らし",
        "delay_worse": "平均到着遅延が {difference} 増え",
        "energy_alike": "電力量は変わらない",
        "energy_better": "正味電力量を減らす({change})",
        "energy_worse": "正味電力量が増える({change})",
        "join": "{first}。{second}、{third}。",
        "least_delay": "遅延が最も小さいのは {name}({mean}、{change})。",
        "least_energy": "正味電力量が最も小さいのは {name}({mean}、{change})。",
        "most": "駅間停車が最も多いのは {name}({mean})。",
        "safe": "安全規則の違反はない。",
        "unsafe": "{names} で安全規則の違反があった。その他の値を使わないこと。",
        "finished": "全列車が運行を終えた。",
        "unfinished": "{names} では運行を終えていない列車がある。",
        "between": "",
        "comma": "、",
    },
}


def verdict_text(found: Verdict, language: str = "en") -> str:
    """
    Return the verdict in a sentence or two.

    Parameters
    ----------
    found
        What :func:`kankaku.analysis.tables.verdict.verdict` returned.
    language
        One of ``LANGUAGES``.

    Returns
    -------
    str
        Who stands least between stations and what that costs; who is least delayed and takes
        least energy, if others are.
    """
    words = _WORDS[language]
    if found.stops is None or found.delay is None or found.energy is None:
        return words["nobody"]
    if found.controllers == 1:
        return words["alone"].format(
            name=found.baseline,
            stops=_mean(found.stops, STOPS),
            delay=_mean(found.delay, DELAY),
            energy=_mean(found.energy, ENERGY),
        )
    told = [_best(found, found.stops, words)]
    others = (("least_delay", found.delay, DELAY), ("least_energy", found.energy, ENERGY))
    for key, leader, indicator in others:
        if leader.controller not in {found.stops.controller, found.baseline}:
            told.append(_of(words[key], leader, indicator))
    worst = found.most_stops
    if worst is not None and worst.controller != found.stops.controller:
        told.append(_of(words["most"], worst, STOPS))
    return words["between"].join(told)


def safety_text(found: Verdict, language: str = "en") -> str:
    """
    Return whether the runs were safe and came to their end.

    Parameters
    ----------
    found
        What :func:`kankaku.analysis.tables.verdict.verdict` returned.
    language
        One of ``LANGUAGES``.

    Returns
    -------
    str
        Two sentences.
    """
    words = _WORDS[language]
    names = words["comma"].join
    safe = words["unsafe"].format(names=names(found.unsafe)) if found.unsafe else words["safe"]
    left = words["finished"]
    if found.unfinished:
        left = words["unfinished"].format(names=names(found.unfinished))
    return words["between"].join([safe, left])


def _best(found: Verdict, best: Leader, words: Mapping[str, str]) -> str:
    if best.controller == found.baseline:
        return _of(words["baseline_best"], best, STOPS)
    first = _of(words["best"], best, STOPS, baseline=found.baseline)
    second = _clause(words, "delay", best.changes[DELAY])
    third = _clause(words, "energy", best.changes[ENERGY])
    return words["join"].format(first=first, second=second, third=third)


def _clause(words: Mapping[str, str], topic: str, change: Change) -> str:
    mark = Mark.ALIKE if change.mark is Mark.NONE else change.mark
    return words[f"{topic}_{mark}"].format(difference=_amount(change), change=_change(change))


def _of(template: str, leader: Leader, indicator: str, **more: str) -> str:
    change = _change(leader.changes[indicator])
    mean = _mean(leader, indicator)
    return template.format(name=leader.controller, mean=mean, change=change, **more)


def _mean(leader: Leader, indicator: str) -> str:
    unit = INDICATOR_OF[indicator].column.unit
    return f"{mean_text(leader.changes[indicator].mean)} {unit}".rstrip()


def _amount(change: Change) -> str:
    """Return how large a change is, without a sign."""
    half = change.confidence_95
    told = mean_text(abs(change.difference))
    if not np.isnan(half) and half:
        told += f" ± {mean_text(half)}"
    return f"{told} {INDICATOR_OF[change.indicator].column.unit}".rstrip()


def _change(change: Change) -> str:
    unit = INDICATOR_OF[change.indicator].column.unit
    return change_text({**change._asdict(), "unit": unit})
