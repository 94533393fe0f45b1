"""A function becomes a rule: how often it is asked, with what, and what its answers mean."""

import pytest

from desim.errors import InputError, ModelError
from desim.ports import PASS, Deliver, Drop, Duplicate, Frame, function_rule, rule_of

FRAME = Frame(1, 0, (1, 2), 100, 1, True)


def judged(function, context="context"):
    """Verdicts for two receivers, by an object of the function's class."""
    rule = function_rule(function)()
    rule.start(context, ("a", "b", "c"))
    return rule.judge(FRAME, (1, 2))


def seen(answer):
    def rule(*given):
        assert given == (FRAME, (1, 2))
        return answer
    return rule


@pytest.mark.parametrize("verdict", [PASS, Deliver(5), Duplicate(7)])
def test_one_verdict_is_that_of_each_receiver(verdict):
    assert judged(lambda frame, receivers: verdict) == [verdict, verdict]


def test_a_list_has_one_verdict_for_each_and_nothing_means_that_all_pass():
    assert judged(seen([PASS, Drop()])) == [PASS, Drop("rule")]
    assert judged(seen(None)) is None
    assert judged(seen(Drop(packets=(3,)))) == [Drop("rule", (3,)), Drop("rule", (3,))]


def test_a_context_is_given_to_who_asks_for_it_only():
    asked = []

    def curious(frame, receivers, context):
        asked.append((frame, receivers, context))

    def modest(frame, receivers, context="none"):
        asked.append((frame, receivers, context))

    judged(curious), judged(modest)
    assert asked == [(FRAME, (1, 2), "context"), (FRAME, (1, 2), "none")]


@pytest.mark.parametrize("function", [lambda frame: None, lambda a, b, c, d: None])
def test_a_function_of_other_arguments_is_no_rule(function):
    with pytest.raises(InputError, match=r"; a function that is a rule takes \(frame, receivers\) "
                                         r"or \(frame, receivers, context\)$"):
        function_rule(function)


def test_a_drop_carries_the_name_of_its_function_alone():
    with pytest.raises(ModelError, match="dropped for 'rain'; the drops of a function carry its "
                                         r"name, 'rule': write Drop\(\)$"):
        judged(seen(Drop("rain")))


def test_an_object_is_a_rule_itself():
    rule = object()
    assert rule_of(rule) is rule
    assert rule_of(seen(None)).reasons == ("rule",)
