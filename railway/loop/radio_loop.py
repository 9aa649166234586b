"""Steps between events under a protection that takes and gives its commands by radio."""

from collections.abc import Callable
from functools import cache
from typing import Any

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled_with, formula
from kankaku.railway.loop.compiled_loop import (
    BlockRows,
    Sampling,
    Watched,
    clear,
    is_event,
    keep,
    move,
    sample,
)
from kankaku.railway.plan.radio_spec import telegram_sent_s
from kankaku.railway.radio.data_link import carry
from kankaku.railway.step.bundles import Lasting, Span


@formula
def _listen(heard_s: FloatArray, heard: IntArray, cycle_s: float) -> None:
    """Record when the commands were sent that trains have."""
    for train in range(heard.size):
        heard_s[train] = telegram_sent_s(heard[train], cycle_s)


@cache
def steps_by_radio(
    protect: Callable[..., Any], advise: Callable[..., Any], command: Callable[..., Any]
) -> Callable[..., Any]:
    """
    Return the compiled loop over the steps of three layers, with the radio between them.

    Parameters
    ----------
    protect, advise, command
        Compiled steps as :mod:`kankaku.railway.step.bundles` says.

    Returns
    -------
    Callable[..., Any]
        As from :func:`kankaku.railway.loop.compiled_loop.steps_of`; instead of what belongs
        to the protection it takes, last, the radio, which it lets carry what is due, with where it
        writes what trains have heard, and fields and memory of the protection; the memory after
        the last step it returns behind its counts.
    """

    def bundle(  # noqa: PLR0913, PLR0917 - as without radio
        trains: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
        plains: tuple[Plain, Plain, Plain],
        layers: tuple[Plain, Plain],
        told_mps: FloatArray,
        kept_fields: Plain,
        sampling_fields: Plain,
        on_air: tuple[Plain, FloatArray],
        guarding: Any,  # noqa: ANN401 - plain or a box
        permitted: Any,  # noqa: ANN401 - as well
    ) -> tuple[int, int, int, Any]:
        span, watched, lasting = Span(*plains[0]), Watched(*plains[1]), Lasting(*plains[2])
        kept, sampling = BlockRows(*kept_fields), Sampling(*sampling_fields)
        (operating, planned, planned_after, advice), (driving, told) = layers
        front_m, tail_m, speed_mps, clear_to_m = trains
        whereabouts = front_m, tail_m, speed_mps, watched.present, watched.running, watched.rows
        taken, samples, until_sample = 0, 0, sampling.until_sample
        air, heard_s = on_air
        heard, until_s = air[2][2][0], min(span.until_s, watched.until_s)
        arrived = air[1][2][0], heard, air[1][2][1]
        for step in range(told_mps.shape[0]):
            now_s = span.time_s[step]
            if now_s >= until_s or is_event(span, watched, front_m, tail_m, speed_mps):
                break
            carry(now_s, watched.present, air)
            clear(watched, lasting, tail_m, clear_to_m)
            instant = now_s, whereabouts, clear_to_m, plains[2]
            authority, permitted_after, stops = protect(instant, arrived, guarding, permitted)
            if stops or advise(instant, authority, operating, planned, planned_after, advice):
                break
            command(instant, authority[:5], advice, driving, told)
            permitted = permitted_after
            planned, planned_after = planned_after, planned
            kept.time_s[kept.at + step] = now_s
            places = front_m, speed_mps, watched.rows
            keep(kept, kept.at + step, places, (authority[0], authority[2]))
            _listen(heard_s[kept.at + step], heard, air[0])
            if until_sample == 0:
                sample(sampling, samples, watched, (authority, advice, told[1]))
                samples, until_sample = samples + 1, sampling.every
            until_sample -= 1
            move(span, watched, (front_m, tail_m, speed_mps), told[0], told_mps[step])
            taken += 1
        return taken, samples, until_sample, permitted

    return compiled_with(bundle, protect, advise, command)
