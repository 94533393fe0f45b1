"""The scoreboard of sent bytes, by itself."""

from desim.middleware.tcp.scoreboard import Scoreboard


def test_of_what_went_again_an_early_answer_is_for_the_first_copy():
    """RFC 8985, 6.2, step 2: it was sent last only if the answer took the least round trip. That
    holds for both parts of a run that is cut, and not for what has gone once."""
    board = Scoreboard(0, [(3000, 0)])
    board.mark_lost(0)
    board.send_again(board.runs[0], 2000, 100)
    newest = []
    for una, now_ns in ((500, 109), (1000, 109), (1500, 110)):
        board.acknowledge(una, (), now_ns, 10, 0)
        newest.append((*board.rack, board.rack_rtt_ns))
    assert newest == [(-1, -1, 0), (-1, -1, 0), (100, 1500, 10)]
    once = Scoreboard(0, [(3000, 100)])
    once.acknowledge(1000, (), 109, 10, 0)
    assert (*once.rack, once.rack_rtt_ns) == (100, 1000, 9)
