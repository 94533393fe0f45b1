"""Nothing changes unnoticed: short runs have the digests that they had.

A failure says that behaviour changed, not that it is wrong: ``python tools/regolden.py`` renews the
digests. They are promised for one kind of machine and one set of versions; where a digest differs
on another one, nothing can be said.
"""

import pytest
import regolden  # a tool


@pytest.mark.parametrize("row", regolden.read(), ids=lambda row: " ".join(row[:3]).strip())
def test_fingerprint(row):
    now = row.current()
    if now.digest != row.digest and regolden.elsewhere():
        pytest.skip(f"another digest on another machine: {regolden.elsewhere()}")
    assert now == row, f"behaviour changed ({now.moved(row)}); see tools/regolden.py"


def test_a_change_names_its_layer():
    row = regolden.read()[0]
    now = row._replace(overrides="measure.every=3 s").current()
    assert now.moved(row) == "monitor"
