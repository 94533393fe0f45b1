"""A plug-in's block that is set where its name belongs: it can mean only one thing."""

import pytest

from desim.errors import InputError
from desim.scenario.load import from_mapping


def loaded(setting):
    return from_mapping({"name": "s", "fleet": {"size": 2}}, [setting]).scenario


@pytest.mark.parametrize("inner, outer", [
    ("coordination.strategy={strategy: market, price_m_per_m2: 0}",
     "coordination={strategy: market, price_m_per_m2: 0}"),
    ("coordination.exchange.model={model: own_maps, period: 3 s}",
     "coordination.exchange={model: own_maps, period: 3 s}"),
])
def test_a_block_in_place_of_the_name_is_the_block(inner, outer):
    assert loaded(inner) == loaded(outer) != loaded("seed=1")


def test_an_error_in_it_names_the_key_where_it_belongs():
    with pytest.raises(InputError) as caught:
        loaded("coordination.strategy={strategy: market, price_per_m2: 0}")
    assert str(caught.value) == (
        "--set coordination.strategy={strategy: market, price_per_m2: 0}: "
        "coordination.price_per_m2: unknown key (did you mean 'price_m_per_m2'?); allowed: "
        "strategy, exchange, team_state, lost_after, lots, price_m_per_m2, wait, hold, "
        "failsafe_after")
