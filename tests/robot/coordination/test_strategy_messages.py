"""The bytes of a strategy's messages."""

import pytest

from desim.errors import ModelError
from desim.robot.coordination.strategy_messages import encoded


def test_json_is_a_text_with_its_length_in_front():
    """std_msgs/String: an uint32, and the bytes."""
    assert encoded({"a": [1, 2]}, None).size_bytes == 4 + len('{"a":[1,2]}')


def test_a_declared_size_holds():
    assert encoded({1, 2}, 0).size_bytes == 0 and encoded({1, 2}, 9).decoded() == {1, 2}


@pytest.mark.parametrize("size_bytes", [-1, True, 1.5, "9"])
def test_a_size_that_is_none_is_refused(size_bytes):
    with pytest.raises(ModelError, match=f"^size_bytes is an int >= 0, not {size_bytes!r}$"):
        encoded("a", size_bytes)
