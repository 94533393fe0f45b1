"""A Zenoh router works out for itself the ways through the network, and who listens."""

from hypothesis import given
from hypothesis import strategies as st

from desim.middleware.zenoh.registry import Declaration, DeclarationRegistry, Part
from desim.middleware.zenoh.topology import LinkState, Topology, next_hops, tree

PATH = (0b0010, 0b0101, 0b1010, 0b0100)  # 0 - 1 - 2 - 3
SQUARE = (0b0110, 0b1001, 0b1001, 0b0110)  # 0 to 1 and 2, both to 3


def test_trees_are_of_shortest_ways_by_the_lower_index():
    assert tree(PATH, 0) == {0: 0, 1: 0, 2: 1, 3: 2}
    assert tree(SQUARE, 0) == {0: 0, 1: 0, 2: 0, 3: 1}
    assert tree(SQUARE, 3) == {3: 3, 1: 3, 2: 3, 0: 1}


def test_next_hops_are_those_behind_a_router():
    assert next_hops(PATH, 0, 0) == {1: 1, 2: 1, 3: 1}
    assert next_hops(PATH, 0, 2) == {3: 3}
    assert next_hops(SQUARE, 0, 2) == {}


def test_a_link_counts_while_both_ends_say_so_and_an_own_one_at_once():
    topology = Topology(0, 3, 1)
    topology.link(1, True)
    assert list(topology.reached()) == [0, 1]
    assert topology.learn(1, LinkState(1, 2, 0b101, 3))
    assert list(topology.reached()) == [0, 1], "2 has not said that it is linked to 1"
    assert topology.learn(2, LinkState(1, 1, 0b010, 1))
    assert topology.hops(0) == {1: 1, 2: 1}
    assert not topology.learn(2, LinkState(1, 1, 0b110, 3)), "that is no news"
    assert topology.learn(2, LinkState(2, 0, 0, 0)), "2 has restarted"
    assert list(topology.reached()) == [0, 1]
    topology.link(1, False)
    assert list(topology.reached()) == [0]


@given(st.integers(1, 9), st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=20))
def test_hops_lead_from_anywhere_to_anywhere_once(routers, pairs):
    """Each router decides by itself where copies of a message go."""
    edges = [0] * routers
    for a, b in pairs:
        if a != b and max(a, b) < routers:
            edges[a] |= 1 << b
            edges[b] |= 1 << a
    edges = tuple(edges)
    for root in range(routers):
        reached, at = [], [(root, list(next_hops(edges, root, root)))]
        for router, to in at:
            hops = next_hops(edges, root, router)
            for neighbour in dict.fromkeys(hops[receiver] for receiver in to):
                behind = [receiver for receiver in to if hops[receiver] == neighbour]
                assert edges[router] >> neighbour & 1 and neighbour in behind
                reached.append(neighbour)
                at.append((neighbour, [one for one in behind if one != neighbour]))
        assert sorted(reached) == sorted(set(tree(edges, root)) - {root})


def test_what_was_declared_in_an_earlier_life_is_void():
    """Even when a neighbour that has not heard of the restart yet tells of it."""
    said = []

    class Context:
        def changed(self, topic):
            said.append(topic)

        def knows(self, *belief):
            said.append(belief)

        def sees(self, *seen):
            said.append(seen)

    registry = DeclarationRegistry(0, 1, Context())
    registry.publishes("/talk")
    registry.came_online(1)
    registry.learn(Part(1, 1, 0, [Declaration(9, None), Declaration(9, "/talk")]))
    assert registry.listeners("/talk") == [1]
    registry.begins(1, 2)
    registry.learn(Part(1, 1, 1, [Declaration(9, "/talk"), Declaration(9, "/more")]))
    assert not registry.listeners("/talk") and not registry.listeners("/more")
    assert said == [(0, 1, "online"), (0, 1, "/talk", True), "/talk", (0, 1, "/talk", False),
                    "/talk"]
    registry.learn(Part(1, 2, 0, [Declaration(9, "/talk")]))
    assert registry.beyond(1, (1, 2)) == Part(1, 2, 0, [Declaration(9, "/talk")])
    assert registry.beyond(1, (2, 1)) is None
    registry.went_offline(1)
    assert not registry.listeners("/talk")
