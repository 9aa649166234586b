"""Agreements between files and layers: what happens to whoever breaks one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.railway.loop.agreements import AgreementError
from kankaku.railway.motion import traction_table
from kankaku.railway.step.reasons import ReasonError
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Advice, Authority, LineState, Whereabouts
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import controller_of, run
from tests.states import behind

STEP_S = 0.1
SCENARIO = two_station_scenario(2, 90.0, step_s=STEP_S)
WORLD = world_of(SCENARIO)


class Broken:
    """A protection that answers as another one does, but for what is done to its answer."""

    def __init__(self, spoil: Any) -> None:  # noqa: ANN401
        self._inner: Any = controller_of(WORLD).protection
        self._spoil = spoil

    def initial(self) -> Any:  # noqa: ANN401
        return self._inner.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Any, Any]:  # noqa: ANN401
        authority, memory = self._inner.authorise(state, memory)
        return self._spoil(state, authority), memory


def run_with(spoil: Any) -> RunRecord:  # noqa: ANN401
    controller = replace(controller_of(WORLD), protection=Broken(spoil))
    return run(SCENARIO, controller=controller)[0]


def test_a_protection_that_keeps_its_agreements_runs() -> None:
    assert run_with(lambda _, authority: authority).completed.all()


@pytest.mark.parametrize("field", Authority._fields)
def test_a_field_of_an_authority_that_is_left_empty_is_named(field: str) -> None:
    with pytest.raises(AgreementError, match=rf"Broken of controller test .*Authority\.{field}"):
        run_with(lambda _, authority: authority._replace(**{field: None}))


def test_fields_of_an_authority_in_another_order_are_named() -> None:
    with pytest.raises(AgreementError, match=r"Authority\.delay_s .* agreed: float64"):
        run_with(
            lambda _, authority: authority._replace(
                delay_s=authority.eoa_by, eoa_by=authority.delay_s
            )
        )


def test_an_authority_for_too_few_trains_is_refused() -> None:
    with pytest.raises(AgreementError, match=r"Authority\.eoa_m .*shape \(1,\)"):
        run_with(lambda _, authority: authority._replace(eoa_m=authority.eoa_m[:1]))


def test_a_layer_that_writes_to_the_state_is_told_at_once() -> None:
    def writes(state: LineState, authority: Authority) -> Authority:
        state.clear_to_m[:] += 1.0
        return authority

    with pytest.raises(AgreementError, match=r"writes to LineState\.clear_to_m"):
        run_with(writes)


class Unexplained:
    """An operation that lowers a speed for a reason that it has not declared."""

    reasons = ("known",)

    def initial(self) -> None:
        """Remember nothing."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        size = state.front_m.size
        return Advice(np.full(size, 5.0), np.ones(size, dtype=np.intp), authority.eoa_by), memory


def test_a_reason_that_is_not_declared_is_told_at_once() -> None:
    controller = replace(controller_of(WORLD), operation=Unexplained())
    with pytest.raises(ReasonError, match="gives reason 1"):
        run(SCENARIO, controller=controller)


def test_compiled_functions_read_trains_under_their_names() -> None:
    state = behind(WORLD, 900.0, 500.0)
    trains = Whereabouts(*state.whereabouts)
    for name in Whereabouts._fields[:-1]:
        assert getattr(trains, name) is getattr(state, name)
    assert trains.rows.tolist() == np.flatnonzero(state.present).tolist()


def arrivals_and_work(controller: str) -> tuple[Any, Any]:
    protection, operation = controller.split("+")
    built = controller_of(world_of(SCENARIO), operation, protection)
    record, _ = run(SCENARIO, controller=built, delay_s=np.array([[0.0, 40.0], [0.0, 0.0]]))
    assert record.violations == ()
    return record.arrival_s, record.energy.traction_j


@pytest.mark.parametrize("cells_per_mps", [50.0, 200.0])
def test_how_finely_traction_is_tabulated_stands_in_one_place(
    monkeypatch: pytest.MonkeyPatch, cells_per_mps: float
) -> None:
    """Whoever reads the table with another size in mind runs at quite another speed."""
    arrival_s, traction_j = arrivals_and_work("moving_block+close_up")
    monkeypatch.setattr(traction_table, "CELLS_PER_MPS", cells_per_mps)
    other_s, other_j = arrivals_and_work("moving_block+close_up")
    assert np.nanmax(np.abs(other_s - arrival_s)) <= STEP_S + 1e-6
    assert other_j == pytest.approx(traction_j, rel=2e-3)
