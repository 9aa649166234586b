"""
Compilation of the functions that run in every step.

A step has some thirty operations on arrays of a few dozen trains. One compiled function
costs what two or three array operations cost, so the physics is written as formulas and
loops over trains and compiled by numba; results are cached beside the source, or where
``kankaku.railway.places.cache_folder`` says.

Numba takes a cached function for fresh as long as the function's own file has not changed. Here it
is fresh as long as none of the files has changed that its code was compiled from.
"""

import hashlib
import inspect
import os
import pickle
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

import numba
from numba.core import event
from numba.core.dispatcher import Dispatcher
from numba.core.sigutils import normalize_signature
from numba.np.ufunc.dufunc import DUFunc

from kankaku.railway.arrays import FloatArray
from kankaku.railway.first_use import Compilations
from kankaku.railway.places import cache_folder

Function = TypeVar("Function", bound=Callable[..., Any])

Plain: TypeAlias = tuple[Any, ...]
"""The fields of a named tuple, from :func:`plain`."""


_SOURCES: dict[int, frozenset[str]] = {}
"""Files that each compiled function depends on, by the identity of the function."""


class _Listener(event.Listener):
    """Hears of every function that numba compiles."""

    def __init__(self) -> None:
        self._compilations = Compilations()

    def on_start(self, _: Any) -> None:  # noqa: ANN401 - numba has no types
        self._compilations.begin()

    def on_end(self, _: Any) -> None:  # noqa: ANN401 - numba has no types
        self._compilations.end()


_register: Any = event.register
_register("numba:compile", _Listener())


def compiled(function: Function) -> Function:
    """
    Compile a function of arrays and numbers at its first call.

    Parameters
    ----------
    function
        The function.

    Returns
    -------
    Function
        The same, compiled.
    """
    return cast("Function", _jitted(function, counts=True))


def formula(function: Function) -> Function:
    """
    Compile a function that makes no arrays, at its first call.

    It need not count who still uses the arrays that it is given, which in a function of many of
    them takes longer than what it works out.

    Parameters
    ----------
    function
        The function; it makes and returns no arrays, and calls formulas, numpy's functions of
        numbers, and compiled functions that return no arrays.

    Returns
    -------
    Function
        The same, compiled.
    """
    return cast("Function", _jitted(function, counts=False))


def naming(function: Function) -> Function:
    """
    Compile a function that only gives names back to fields, into each function that calls it.

    There it costs nothing, and a formula may call it although it returns arrays.

    Parameters
    ----------
    function
        The function; it calls the classes of named tuples, and others of its kind.

    Returns
    -------
    Function
        The same, compiled.
    """
    made: Any = numba.njit(inline="always", error_model="numpy")(function)
    _SOURCES[id(made)] = _sources(function)
    return cast("Function", made)


def compiled_with(function: Function, *parts: Callable[..., Any]) -> Function:
    """
    Compile a function that closes over other compiled ones, at its first call.

    Parameters
    ----------
    function
        Made anew for these parts.
    parts
        The compiled functions that it calls by names of its own.

    Returns
    -------
    Function
        The same, compiled, and cached under the names of all parts.
    """
    return _made_with(function, parts, counts=True)


def formula_with(function: Function, *parts: Callable[..., Any]) -> Function:
    """
    Compile a formula that closes over other ones, at its first call.

    Parameters
    ----------
    function
        Made anew for these parts.
    parts
        The compiled functions that it calls by names of its own.

    Returns
    -------
    Function
        The same, compiled, and cached under the names of all parts.
    """
    return _made_with(function, parts, counts=False)


def _made_with(
    function: Function, parts: tuple[Callable[..., Any], ...], *, counts: bool
) -> Function:
    made_of: list[Any] = [*parts]
    told = "\0".join(f"{part.__module__}.{part.__qualname__}" for part in made_of)
    function.__qualname__ = f"{function.__name__}_{hashlib.sha256(told.encode()).hexdigest()[:16]}"
    made = _cached(partial(_dispatcher, function, _options(counts=counts)))
    inner = (_SOURCES.get(id(part), frozenset()) for part in parts)
    files = _SOURCES[id(made)] = _sources(function).union(*inner)
    _watch(made, files)
    kept: Any = getattr(made, "_cache", None)
    if hasattr(kept, "_index_key"):
        # What it closes over is told by its name; as bytes it is another in every process.
        kept._index_key = lambda signature, codegen: (signature, codegen.magic_tuple(), told)  # noqa: SLF001
    return cast("Function", made)


def elementwise(function: Callable[..., float]) -> Callable[..., FloatArray]:
    """
    Turn a formula of numbers into a numpy ufunc, which compiled functions may call too.

    It is compiled at its first call: whoever only imports it need not wait.

    Parameters
    ----------
    function
        A formula with float arguments only.

    Returns
    -------
    Callable[..., FloatArray]
        The ufunc: broadcasts its arguments.
    """
    made = _cached(lambda cache: _Formula(function, cache=cache))
    _SOURCES[id(made)] = _sources(function)
    return cast("Callable[..., FloatArray]", made)


class _Formula(DUFunc):
    """A ufunc of float64; other numbers are turned into it, as numpy does."""

    def _compile_for_argtys(self, _: Any, return_type: Any = None) -> Any:  # noqa: ANN401
        compile_for: Any = super()._compile_for_argtys  # type: ignore[misc]
        made = compile_for((numba.float64,) * self.ufunc.nin, return_type)
        self.disable_compile()
        return made


def plain(fields: tuple[Any, ...]) -> Plain:
    """
    Return a named tuple, and those in it, as plain ones, for a function called in every step.

    A compiled function looks up the class of a named tuple in every call, which takes longer
    than many a formula; it can give the names back to a plain one at no cost.

    Parameters
    ----------
    fields
        The named tuple.

    Returns
    -------
    Plain
        Its fields.
    """
    return tuple(plain(field) if isinstance(field, tuple) else field for field in fields)


def _dispatcher(function: Callable[..., Any], options: Mapping[str, bool], kept: bool) -> Any:  # noqa: ANN401 - numba has no types
    """Return numba's own; nobody calls it through a pointer of C."""
    njit: Any = numba.njit
    return njit(cache=kept, error_model="numpy", no_cfunc_wrapper=True, **options)(function)


def _options(*, counts: bool) -> dict[str, bool]:
    """Return how to compile with or without counts of who uses each array, whoever calls it."""
    return {"_nrt": counts, "forceinline": not counts}


def _jitted(function: Callable[..., Any], *, counts: bool) -> Any:  # noqa: ANN401 - numba has no types
    options = _options(counts=counts)
    made = _cached(partial(_dispatcher, function, options))
    files = _SOURCES[id(made)] = _sources(function)
    _watch(made, files)
    if isinstance(made, Dispatcher):
        inside = cache(partial(_inside, made, function, options, files))
        # A type of numba asks the function that it stands for.
        told: Any = made
        told.get_call_template = lambda args, kws: inside().get_call_template(args, kws)
        told.get_overload = lambda sig: inside().get_overload(sig)
    return made


def _inside(
    made: Any,  # noqa: ANN401 - numba has no types
    function: Callable[..., Any],
    options: Mapping[str, bool],
    files: frozenset[str],
) -> Any:  # noqa: ANN401 - numba has no types
    """
    Return what other compiled functions call instead of a compiled function.

    Python cannot call it: what it takes to be called from there takes as long to compile as most
    formulas do.
    """
    inner = _cached(partial(_dispatcher, function, {**options, "no_cpython_wrapper": True}))
    _watch(inner, files)
    kept, compile_anew = inner._cache, inner.compile  # noqa: SLF001 - numba has no other way in
    normalized: Any = normalize_signature
    if hasattr(kept, "_index_key"):
        key = kept._index_key  # noqa: SLF001
        kept._index_key = lambda *asked: (*key(*asked), "inside")  # noqa: SLF001

    def compile_once(sig: Any) -> Any:  # noqa: ANN401 - numba has no types
        """Take the one that Python calls where there is one already."""
        args = tuple(normalized(sig)[0])
        if args not in inner.overloads and (args in made.overloads or _is_kept(made, sig)):
            made.compile(sig)
            inner.add_overload(made.overloads[args])
        return compile_anew(sig)

    inner.compile = compile_once
    return inner


def _is_kept(made: Any, sig: Any) -> bool:  # noqa: ANN401 - numba has no types
    """Return whether a function is compiled for arguments in the cache."""
    kept = made._cache  # noqa: SLF001 - numba has no other way in
    if not hasattr(kept, "_cache_file"):
        return False
    key = kept._index_key(sig, made.targetctx.codegen())  # noqa: SLF001
    return key in kept._cache_file._load_index()  # noqa: SLF001


def _cached(make: Callable[[bool], Any]) -> Any:  # noqa: ANN401 - numba has no types
    """Compile with the cache beside the source or in the user's home; else with one elsewhere."""
    try:
        return make(True)
    except RuntimeError:
        # Neither place can be written.
        elsewhere = cache_folder()
    if elsewhere is None:
        return make(False)
    os.environ["NUMBA_CACHE_DIR"] = str(elsewhere / "numba")
    reload_config: Any = numba.config.reload_config
    reload_config()
    return make(True)


def _sources(function: Callable[..., Any]) -> frozenset[str]:
    """Return the files of a function, of what it calls and of the tuples it takes."""
    used = [function.__globals__.get(name) for name in function.__code__.co_names]
    used += function.__annotations__.values()
    files = {inspect.getfile(function)}
    for value in used:
        files |= _SOURCES.get(id(value), frozenset())
        if isinstance(value, type) and issubclass(value, tuple) and value is not tuple:
            files.add(inspect.getfile(value))
    return frozenset(files)


@cache
def _digest(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def _watch(made: Any, files: frozenset[str]) -> None:  # noqa: ANN401 - numba has no types
    """Let numba compile anew when any of the files has changed."""
    kept: Any = getattr(made, "_cache", None)
    if not hasattr(kept, "_cache_file"):
        return  # Compilation is switched off.
    index = kept._cache_file  # noqa: SLF001 - numba has no other way in
    index._source_stamp = (index._source_stamp, *map(_digest, sorted(files)))  # noqa: SLF001
    load = index._load_index  # noqa: SLF001

    def load_index() -> dict[Any, str]:
        try:
            found: dict[Any, str] = load()
        except (AttributeError, ImportError, EOFError, ValueError, pickle.UnpicklingError):
            # It names a class that is gone, or was cut off.
            return {}
        return found

    save = kept.save_overload

    def save_overload(*arguments: Any) -> None:  # noqa: ANN401 - numba has no types
        with suppress(OSError):
            # A full disk: it is compiled again next time.
            save(*arguments)

    index._load_index = load_index  # noqa: SLF001
    kept.save_overload = save_overload


@formula
def count_up_to(rising: FloatArray, value: float) -> int:
    """
    Count the values of a rising array that are not above another.

    Parameters
    ----------
    rising
        Sorted values. shape (n,)
    value
        The other.

    Returns
    -------
    int
        How many; the place after the last of them.
    """
    low, high = 0, rising.size
    while low < high:
        middle = (low + high) // 2
        if rising[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low


@formula
def interpolated(values: FloatArray, place: float) -> float:
    """
    Interpolate between the values of a table.

    Parameters
    ----------
    values
        The table. shape (n,)
    place
        Where, from 0 on and before the last value.

    Returns
    -------
    float
        The value there.
    """
    cell = int(place)
    part = place - cell
    value: float = values[cell] + part * (values[cell + 1] - values[cell])
    return value
