"""Each middleware finds, loses and finds again, as the conformance kit plays it."""

import pytest
from models import MODELS

from desim.testing import check_discovery


@pytest.mark.parametrize("name", MODELS)
def test_keeps_the_contract(name):
    model = MODELS[name]
    check_discovery(model.cls, model.patience, **model.params)
