"""Each middleware finds, loses and finds again, as the conformance kit plays it."""

import pytest
from models import MODELS

from desim.testing import check_discovery


@pytest.mark.parametrize("name", MODELS)
def test_keeps_the_contract(name):
    """The first host stops and the last one, which are the other way round in the other order; the
    walks over outages stop any."""
    model = MODELS[name]
    first, *_, last = model.patience.stops
    check_discovery(model.cls, model.patience._replace(stops=(first, last)), **model.params)
