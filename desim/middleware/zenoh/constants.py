"""The constants of Zenoh, with their sources."""

from __future__ import annotations

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp.constants import in_order
from desim.units import ByteSize, Duration, Pace, Period


class ZenohConstants(ports.Constants):
    """The constants of ``rmw_zenoh``. What is "measured" was seen between routers of zenoh 1.10.2.
    """

    open_timeout_ns: Period = Field("60 s", description=(
        "time that a link has to open in (zenoh transport/unicast/open_timeout: 10 s; rmw_zenoh: "
        "60 s)"))
    wait_before_close_ns: Period = Field("60 s", description=(
        "time that a message of a stream without a limit (queue: 0) may block a link before this "
        "is closed (zenoh congestion_control/block/wait_before_close: 5 s; rmw_zenoh: 60 s)"))
    wait_before_drop_ns: Duration = Field("1 ms", description=(
        "time that any other message waits for room before it is dropped, for each batch that it "
        "takes (zenoh congestion_control/drop/wait_before_drop)"))
    wait_before_drop_fragments_ns: Duration = Field("50 ms", description=(
        "most that these times add up to (zenoh "
        "congestion_control/drop/max_wait_before_drop_fragments)"))
    batch_bytes: ByteSize = Field("65535 B", ge=64, le=65535, description=(
        "largest batch (zenoh batch_size)"))
    batches: int = Field(2, ge=1, description=(
        "batches of a link, of which one may be in the socket's hands (zenoh queue/size/data; from "
        "general knowledge)"))
    scout_first_ns: Pace = Field("1 s", description=(
        "from the first scout to the second (zenoh orchestrator.rs)"))
    scout_last_ns: Pace = Field("8 s", description=(
        "to which that doubles (zenoh orchestrator.rs)"))
    open_wait_ns: Duration = Field("500 ms", description=(
        "from a host's start to its first declaration: sessions and routers look for others before "
        "they open (zenoh scouting/delay)"))
    scout_jitter_ns: Duration = Field("100 ms", description=(
        "the first scout comes at a random moment, up to that late (ours: simulated hosts start in "
        "one instant, and their scouts would collide on a radio for ever)"))
    retry_first_ns: Pace = Field("1 s", description=(
        "from the first failed connection to an endpoint to the next try (zenoh connect/retry)"))
    retry_last_ns: Pace = Field("4 s", description=(
        "to which that doubles (zenoh connect/retry)"))
    trees_ns: Duration = Field("100 ms", description=(
        "from a change of the topology to the declarations that it calls for (measured; zenoh "
        "TREES_COMPUTATION_DELAY_MS)"))
    flood_ns: Duration = Field("60 us", description=(
        "time that a router's computer works for each message of link states that it passes on: "
        "what it hears meanwhile is passed on after it (measured; about that of a core of 2024)"))

    @model_validator(mode="after")
    def _times_in_order(self) -> ZenohConstants:
        in_order("scout_first", self.scout_first_ns, "scout_last", self.scout_last_ns)
        in_order("retry_first", self.retry_first_ns, "retry_last", self.retry_last_ns)
        return self
