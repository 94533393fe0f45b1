"""The page in a browser without a network: nothing is missing, nothing complains, tables sort."""

import re
import shutil
import subprocess

import pytest
from synthetic import campaign, design, timed

from desim.report.campaign.writing import write

FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr",
         "--virtual-time-budget=2000")
# Sorts the last table by its second column, downwards, and measures every figure.
PROBE = """<script>
const head = [...document.querySelectorAll("table.sortable")].at(-1).tHead.rows[0].cells[1];
head.firstElementChild.click(); head.firstElementChild.click();
const column = [...head.closest("table").tBodies[0].rows].map((row) => row.cells[1].textContent);
const sizes = [...document.querySelectorAll("figure svg")].map((svg) => {
  const box = svg.getBoundingClientRect();
  return box.width > 300 && box.height > 100 && svg.querySelectorAll("path").length > 5;
});
document.body.dataset.probe = JSON.stringify([column, head.ariaSort, sizes]);
</script></body>"""


@pytest.mark.parametrize("scheme", [(), ("--blink-settings=preferredColorScheme=0",)],
                         ids=["light", "dark"])
def test_a_browser_shows_it(tmp_path, scheme):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("there is no Chromium")
    robots = {"robots": [2, 10, 1]}
    campaign(tmp_path, robots, 3, lambda levels, k: timed(100.0 / levels["robots"] + k))
    page = write(tmp_path, design(robots, iterations=3))
    probe = page.with_name("probe.html")
    probe.write_text(page.read_text().replace("</body>", PROBE))
    done = subprocess.run([browser, *FLAGS, *scheme, f"--user-data-dir={tmp_path / 'profile'}",
                           "--dump-dom", probe.as_uri()], capture_output=True, text=True,
                          timeout=120)
    found = re.search(r'data-probe="([^"]*)"', done.stdout)[1].replace("&quot;", '"')
    assert found == '[["10","2","1"],"descending",[true]]'
    assert "CONSOLE" not in done.stderr
