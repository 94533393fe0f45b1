"""The ledger's table of small nets: when messages were read, and of runs that have no end."""

import pytest
from graphs import MS, Net, S, listener, silent, talker
from ledgers import table_of_net

import desim
from desim.errors import InputError
from desim.results.ledger import ledger_of, trace_and_ledger
from desim.results.traces import first_difference
from netmodels.ideal import Ideal


def table(nodes):
    def play(ledger):
        return Net(nodes, Ideal(Ideal.Params(delay="2 ms")), ledger=ledger).run(3 * S)

    return table_of_net(play)


def reads(found):
    return [(*row, by) for *row, by in zip(*(found[name].to_pylist() for name in (
        "destination", "born_ns", "read_ns", "by_callback")), strict=True)]


def looker(node):
    """Looks at the newest message each second."""
    latest = node.latest("/talk")
    node.timer(1, lambda _: latest.read(), "zero")


def test_each_receiver_reads_a_message_at_its_own_time():
    """b in a callback, c at its next look, where the older message has been replaced."""
    found = table({"a": talker([(100 * MS, "one"), (200 * MS, "two")]), "b": listener([]),
                   "c": looker})
    assert sorted(reads(found)) == [
        ("b", 100 * MS, 102 * MS, True), ("b", 200 * MS, 202 * MS, True),
        ("c", 100 * MS, None, None), ("c", 200 * MS, S, False)]


def test_where_nobody_reads_there_is_no_time():
    found = table({"a": talker([(100 * MS, "one")]), "b": lambda node: node.latest("/talk")})
    assert reads(found) == [("b", 100 * MS, None, None)]
    assert reads(table({"a": silent, "b": silent})) == []


def test_rows_and_ledger_that_were_not_kept_are_made_again(repository, tmp_path):
    """Both from one repetition, equal to those that another run has kept, up to an instant too."""
    kept, plain = (desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path / str(i),
                             overrides=("stop.elapsed=1 s", *more))
                   for i, more in enumerate((("trace.keep=all", "trace.ledger=true"), ())))
    for until_ns in (None, S // 2):
        (rows, ledger), (again, made) = (
            trace_and_ledger(run, tmp_path / f"{name} {until_ns}", until_ns)
            for name, run in (("kept", kept), ("made", plain)))
        own = made.column_names if until_ns is None else ["number", "end_ns", "times_ns"]
        ended = ledger.filter(ledger["end_ns"].to_numpy() <= (until_ns or S))
        assert made.select(own).to_pylist() == ended.select(own).to_pylist()
        assert made.num_rows > 50
        before = again.rows[again.rows["t_ns"] < (until_ns or S)]  # the end has rows of its own
        assert first_difference(rows.rows[:len(before)], before) is None


def test_a_run_that_failed_is_not_made_again_as_a_whole(repository, tmp_path):
    """It would fail again; until an instant before that it can be."""
    class Broken(Exception):
        pass

    def fail(simulation, folder):
        raise Broken

    with pytest.raises(Broken):
        desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path, watch=fail,
                  overrides=("stop.elapsed=1 s",))
    path, = (tmp_path / "hello").iterdir()
    run = desim.Run(path)
    for asked in (lambda: ledger_of(run), lambda: trace_and_ledger(run, tmp_path / "rows", None)):
        with pytest.raises(InputError, match="the run failed, it has no digest and no end"):
            asked()
