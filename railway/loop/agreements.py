"""What layers have agreed to tell, looked at in the first step of every run."""

from typing import Any, get_type_hints

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.step.control import Command
from kankaku.railway.step.state import Advice, Authority, LineState, Orders

KINDS: tuple[tuple[Any, str, str], ...] = (
    (FloatArray, "f", "float64"),
    (IntArray, "i", "whole numbers"),
    (BoolArray, "b", "true or false"),
)


class AgreementError(TypeError):
    """A layer that does not tell what it has agreed to, or writes to what it is only shown."""


class FirstStep:
    """
    Looks at what each layer makes of the first state.

    Parameters
    ----------
    controller
        Name of the controller.
    state
        The state, before any layer has seen it.
    """

    def __init__(self, controller: str, state: LineState) -> None:
        self._controller, self._state = controller, state
        fields = state._asdict().items()
        self._kept = {name: v.copy() for name, v in fields if isinstance(v, np.ndarray)}

    def look_at(self, layer: object, told: Authority | Advice | Command | Orders) -> None:
        """
        Refuse a layer that tells too little, or writes to what it is shown.

        Parameters
        ----------
        layer
            Protection, supervision, operation or drive.
        told
            What it made of the state.

        Raises
        ------
        AgreementError
            With the name of the layer and of the field.
        """
        who = f"{type(layer).__name__} of controller {self._controller}"
        _refuse_unlike(who, type(told).__name__, told, self._state.front_m.size)
        for name, value in self._kept.items():
            if not _same(value, getattr(self._state, name)):
                msg = f"{who} writes to LineState.{name}, which it is only shown"
                raise AgreementError(msg)


def _same(one: Any, other: Any) -> bool:  # noqa: ANN401 - arrays of any kind
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))


def _refuse_unlike(who: str, name: str, fields: Any, size: int) -> None:  # noqa: ANN401 - any layer's
    for field, hint in get_type_hints(type(fields)).items():
        value, where = getattr(fields, field), f"{name}.{field}"
        if isinstance(hint, type) and issubclass(hint, tuple):
            if not isinstance(value, hint):
                msg = f"{who} leaves {where} empty: it tells {value!r}"
                raise AgreementError(msg)
            _refuse_unlike(who, where, value, size)
            continue
        if hint is float:
            if not isinstance(value, float):
                msg = f"{who} tells {where} as {value!r}; agreed: a float"
                raise AgreementError(msg)
            continue
        _, kind, words = next(known for known in KINDS if known[0] == hint)
        if not isinstance(value, np.ndarray):
            msg = f"{who} leaves {where} empty: it tells {value!r}"
            raise AgreementError(msg)
        # What is told of several bounds has a row for each of them.
        if value.shape[-1:] != (size,) or value.dtype.kind != kind:
            msg = (
                f"{who} tells {where} as {value.dtype} of shape {value.shape}; "
                f"agreed: {words} for each of {size} trains"
            )
            raise AgreementError(msg)
