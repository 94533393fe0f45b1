"""One radio on a ladder of models, from ideal to faithful."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from netmodels.ideal import Ideal
from netmodels.multihop import Multihop
from netmodels.multihop.hop_choice import as_fast
from netmodels.radio import Radio
from netmodels.radio.uncontended import Uncontended

_RUNGS = {
    "ideal": lambda params: Ideal(Ideal.Params()),
    "disk": lambda params: Uncontended(params, open_air=True),
    "walls": lambda params: Uncontended(params, open_air=False),
    "multihop": lambda params: Multihop(Multihop.Params(), Radio(as_fast(params))),
}


class Ladder(Radio):
    """Wi-Fi without an access point (802.11a, b or g), from the same parameters on each rung of a
    ladder:

    ``multihop``: ``mac``, and hosts relay frames for others, along routes that a protocol finds on
    the same air (``netmodels.multihop``, with its defaults). ``mac``: the whole radio, ``Radio``
    (``desim describe netmodels.radio:Radio`` says what it does and leaves out): contention,
    collisions, retries, and walls that weaken signals. ``walls``: each radio has the air to itself,
    and a frame arrives where 90 % of full packets would at its received power, through walls.
    ``disk``: the same without walls and shadowing; its range is where ``mac`` delivers 90 % in the
    open, computed from path loss and errors. Like ``walls`` it learns no rates: all go at ``rate``.
    ``ideal``: everything arrives at once and everywhere.

    Times of a sender alone are the same on all of them but ``ideal``. Where there are no attempts,
    a unicast frame is lost beyond the range (``out_of_range``).
    """

    class Params(Radio.Params):
        fidelity: Literal["ideal", "disk", "walls", "mac", "multihop"] = Field("mac", description=(
            "the rung; network.fidelity sets it for all media (the whole model)"))

    reasons = (*Radio.reasons, "out_of_range", "hop_limit", "no_path", "relay_down",
               "relay_no_path", "relay_queue_full")
    refuses = Radio.refuses

    def __new__(cls, params: Params) -> Any:
        """The model of the rung. (Any: a type checker expects a Ladder from here.)"""
        if params.fidelity == "mac":
            return super().__new__(cls)
        return _RUNGS[params.fidelity](params)
