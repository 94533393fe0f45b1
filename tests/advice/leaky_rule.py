"""A rule that knows which of its keys have no effect, and a twin with a typing error."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from desim import ports


class Leaky:
    """Loses nothing yet."""

    class Params(ports.Params):
        nth: int = Field(0, description="which frames are lost; 0: none (an example)")
        first: int = Field(1, description="from which on (an example)")

        def without_effect(self, scenario: object) -> Iterator[ports.UnusedKeys]:
            if not self.nth:
                yield ports.UnusedKeys(ports.changed_keys(self, "first"), "nth is 0")

    reasons = ("leaked",)

    def __init__(self, params: Params) -> None:
        self.params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self.hosts = hosts

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> None:
        return None


class Misspelt(Leaky):
    class Params(Leaky.Params):
        def without_effect(self, scenario: object) -> Iterator[ports.UnusedKeys]:
            yield ports.UnusedKeys([".second"], "nth is 0")
