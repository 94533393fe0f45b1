"""The ship's log and its digests."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.engine import trace
from desim.engine.trace import Names, Trace, bits, real
from desim.errors import InputError

INT = st.integers(-2**63, 2**63 - 1)
HOSTS = ("robot_1", "robot_2", "base")
ROWS = st.lists(st.tuples(st.integers(0, 2**63 - 1), st.integers(0, 2**32 - 1),
                          st.sampled_from(HOSTS), INT, INT, INT), max_size=60)


def packed(names, rows):
    return b"".join(struct.pack("<qIIqqq", t, kind, names.id(host), a, b, c)
                    for t, kind, host, a, b, c in rows)


def mix(key, counter):
    """splitmix64, as published: the output of a generator that starts at ``key``."""
    z = (key + (counter + 1) * 0x9E3779B97F4A7C15) % 2**64
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
    return z ^ z >> 31


def summed(data):
    """The digest of packed rows, word by word."""
    sums = [0, 0]
    for row in struct.iter_unpack("<5Q", data):
        for half, value in enumerate((0x243F6A8885A308D3, 0x13198A2E03707344)):
            for word in row:
                value = mix(value, word)
            sums[half] += value
    return "".join(f"{half % 2**64:016x}" for half in sums)


def write(rows, sink=None):
    log = Trace(Names(), sink)
    for t, kind, host, a, b, c in rows:
        log.row(t, kind, log.names.id(host), a, b, c)
    return log


@given(ROWS, st.integers(1, 10))
def test_the_digest_is_the_sum_of_hashes_wherever_batches_end(rows, batch):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace, "_BATCH", batch)
        log = write(rows)
        assert log.digest() == summed(packed(log.names, rows))
        assert log.digest() == write(rows[::-1]).digest()
        assert log.digest_by_entity() == {
            host: summed(packed(log.names, [row for row in rows if row[2] == host]))
            for host in sorted({row[2] for row in rows})}


@given(ROWS, ROWS)
def test_an_entity_digest_feels_nobody_elses_rows(own, others):
    own = [(t, kind, "robot_7", a, b, c) for t, kind, _, a, b, c in own] or [
        (0, 0, "robot_7", 0, 0, 0)]
    alone = write(own).digest_by_entity()["robot_7"]
    mixed = [row for two in zip(own, others, strict=False) for row in two]
    mixed += own[len(others):] + others[len(own):]
    assert write(mixed).digest_by_entity()["robot_7"] == alone


@given(ROWS, st.integers(1, 10))
def test_a_sink_gets_every_row_once_in_order_of_time(rows, batch):
    """If none is later than its batch."""
    rows = sorted(rows, key=lambda row: row[0])
    late = [rows[i + 1] if i % 2 == 0 else rows[i - 1] for i in range(len(rows) // 2 * 2)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace, "_BATCH", batch)
        kept = []
        log = write(rows, kept.append)
        assert log.digest() == write(rows).digest()
        assert b"".join(rows.tobytes() for rows in kept) == packed(log.names, rows)
    kept.clear()
    assert write(late, kept.append).digest() == write(rows[:len(late)]).digest()
    assert (np.diff([t for rows in kept for t in rows["t_ns"]]) >= 0).all()


@given(ROWS, st.lists(st.booleans(), min_size=60, max_size=60), st.integers(1, 10))
def test_rows_that_are_put_are_rows(rows, put, batch):
    """``put`` leaves the look at the batch to the next ``row``; nothing else differs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trace, "_BATCH", batch)
        log = Trace(Names())
        for (t, kind, host, a, b, c), unchecked in zip(rows, put, strict=False):
            row = (t, kind, log.names.id(host), a, b, c)
            log.put(trace.pack(*row)) if unchecked else log.row(*row)
        assert log.digest() == write(rows).digest()
        assert log.digest_by_entity() == write(rows).digest_by_entity()


def test_every_field_and_the_number_of_equal_rows_count():
    rows = [(1, 2, "base", 3, 4, 5), (1, 2, "base", 3, 4, 6)]
    digests = {write(rows).digest(), write([*rows, rows[0]]).digest(), write(rows[:1]).digest()}
    for field, value in enumerate((9, 9, "robot_1", 9, 9, 9)):
        changed = list(rows[0])
        changed[field] = value
        digests.add(write([tuple(changed), rows[1]]).digest())
    assert len(digests) == 9


@given(ROWS)
def test_the_digests_of_kinds_add_up(rows):
    log = write(rows)
    for kind in {row[1] for row in rows}:
        log.names._name.setdefault(kind, str(kind))
    by_kind = log.digest_by_kind()
    assert trace.together(by_kind.values()) == log.digest()
    assert by_kind == {str(kind): summed(packed(log.names, [row for row in rows if row[1] == kind]))
                       for kind in sorted({row[1] for row in rows}, key=str)}


def test_a_table_of_many_entities_grows():
    rows = [(k, 1, f"robot_{k % 700}", k, 0, 0) for k in range(2000)]
    log = write(rows)
    assert log.digest() == summed(packed(log.names, rows))
    assert len(log.digest_by_entity()) == 700


@pytest.mark.parametrize("wrong", [0.5, float("nan"), 2**63, "5", None])
def test_a_row_holds_ints(wrong):
    with pytest.raises(struct.error):
        Trace(Names()).row(0, 0, 0, wrong)


@given(st.floats())
def test_a_float_goes_in_and_out_without_loss(value):
    assert struct.pack("<d", real(bits(value))) == struct.pack("<d", value)


def test_ids_come_from_the_name_alone():
    first, second = Names(), Names()
    assert [first.id(name) for name in HOSTS] == [second.id(name) for name in HOSTS[::-1]][::-1]
    assert first[first.id("base")] == "base"
    assert first.items() == {first.id(name): name for name in HOSTS}


def test_two_names_with_one_id_are_refused(monkeypatch):
    class Same:
        def digest(self):
            return b"\1\2\3\4"

    monkeypatch.setattr(trace.hashlib, "blake2b", lambda *_, **__: Same())
    names = Names()
    names.id("robot_1")
    with pytest.raises(InputError, match="'robot_1' and 'robot_2' have the same 32-bit id"):
        names.id("robot_2")


def test_rows_of_a_batch_are_typed(monkeypatch):
    kept = []
    log = write([(7, 1, "base", -1, 0, bits(0.25))], kept.append)
    log.flush()
    (row,) = kept[0]
    assert kept[0].dtype == trace.ROW == np.dtype(trace.ROW)
    assert (row["t_ns"], row["a"], real(int(row["c"]))) == (7, -1, 0.25)
