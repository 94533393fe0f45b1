"""Each middleware finds, loses and finds again, as the conformance kit plays it."""

import pytest
from models import MODELS

from desim.testing import check_discovery


@pytest.mark.parametrize("name", MODELS)
def test_keeps_the_contract(name):
    """The first host stops, which is the last one in the other order; the walks over outages stop
    any."""
    model = MODELS[name]
    first = model.patience.stops[:1]
    check_discovery(model.cls, model.patience._replace(stops=first), **model.params)
