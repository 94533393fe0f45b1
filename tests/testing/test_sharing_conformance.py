"""The kit's check of map sharing: ours pass, and what breaks the contract is named."""

import random

import pytest

from desim import plugins
from desim.ports.sharing import Contribution
from desim.robot.sharing.kinds.own_maps import OwnMaps
from desim.robot.sharing.kinds.scans import Scans
from desim.testing import check_sharing

# registered_maps fits walls on walls; the kit's robots see none (tests/system/test_unknown_starts).
KINDS = sorted((set(plugins.available("sharing")) - {"registered_maps"}) | {
    "own_maps", "mrs_testbed", "frontiers", "scans", "relayed", "submaps"})


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_keeps_its_contract(name):
    check_sharing(plugins.load("sharing", name))


@pytest.mark.parametrize("params", [
    {"content": "changed_tiles", "encoding": "zlib"}, {"content": "full", "encoding": "zlib"},
    {"via": "broadcast", "period": "1 s"}])
def test_own_maps_keep_it_in_every_form(params):
    check_sharing(OwnMaps, **params)


class Deaf(OwnMaps):
    def _merge(self, context):
        self._updates.news()


class Thief(OwnMaps):
    """Takes its own map for a teammate's."""

    def _merge(self, context):
        context.take_in(Contribution(message.source, message.content.version, None, context.own())
                        for message in self._updates.news())


class Timeless(OwnMaps):
    """Does not say which of two updates is the newer one."""

    def _merge(self, context):
        context.take_in(Contribution(message.source, 1, None, message.content.layer)
                        for message in self._updates.news())


class Forgetful(Scans):
    """Counts on, as if the teammate had not started again."""

    def _on_batch(self, context, message):
        known = self._teammates.get(message.source)
        if known is not None:
            message = message._replace(content=message.content._replace(session=known.session))
        super()._on_batch(context, message)


class Rooted(OwnMaps):
    """Merges only when its own map has grown."""

    def _merge(self, context):
        if len(context.own().filled()):
            super()._merge(context)


class Global(OwnMaps):
    def _on_period(self, context):
        if random.random() < 2.0:
            super()._on_period(context)


@pytest.mark.parametrize(("cls", "says"), [
    (Deaf, "hand to the map in 90 s what a teammate has sent: context.take_in$"),
    (Thief, "hand to the map what its source knows, under the source's name$"),
    (Timeless, "forget what a robot said before it started again with empty memory; tiles "),
    (Forgetful, "forget what a robot said before it started again with empty memory; tiles "),
    (Rooted, "hand to the map of a host without a body, a coordinator, what a robot has sent; or "
             "declare traits = SharingTraits.needs_body=True.$"),
    (Global, "draw from context.stream.* only, not from random or numpy.random$"),
])
def test_the_kit_names_what_is_wrong(cls, says):
    with pytest.raises(AssertionError, match=rf"{cls.__name__} must {says}"):
        check_sharing(cls)
