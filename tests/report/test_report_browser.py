"""The page in a browser without a network: nothing is missing, nothing complains, tables sort."""

import re
import shutil
import subprocess

import pytest
from devtools import Browser, load
from synthetic import campaign, design, timed

from desim.report.campaign.campaign_report import write

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


PHONE = """<script>
const root = document.documentElement;
const off = [...document.querySelectorAll("body *")].filter((element) => {
  const scrolls = element.closest(".wide, .plot, pre");
  return !scrolls && element.getBoundingClientRect().right > root.clientWidth + 1;
});
document.body.dataset.probe = JSON.stringify([
  root.scrollWidth - root.clientWidth, off.map((element) => element.outerHTML.slice(0, 90))]);
</script></body>"""


def test_a_phone_shows_it_without_scrolling_sideways(tmp_path):
    """390 px wide, in a frame: a window is never so narrow."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("there is no Chromium")
    axes = {"strategy": ["nearest_frontier", "a_strategy_with_a_very_long_name"],
            "robots": [1, 2, 4, 8, 16]}
    campaign(tmp_path, axes, 3, lambda levels, k: timed(
        100.0 / levels["robots"] + k, map_age_s=1.0 + k, messages_dropped_queue_full=k))
    page = write(tmp_path, design(axes, iterations=3, report={
        "metrics": ["exploration_time_s", "map_age_s", "messages_dropped_queue_full"]}))
    phone = page.with_name("phone.html")
    phone.write_text(page.read_text().replace("</body>", PHONE))
    frame = page.with_name("frame.html")
    frame.write_text('<body style="margin:0"><iframe id="phone" src="phone.html" width="390" '
                     'height="3000" style="border:0"></iframe><script>onload = () => {'
                     "document.body.dataset.probe = document.getElementById('phone')"
                     ".contentDocument.body.dataset.probe; };</script></body>")
    done = subprocess.run([browser, *FLAGS, "--allow-file-access-from-files",
                           f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom",
                           frame.as_uri()], capture_output=True, text=True, timeout=120)
    found = re.search(r'data-probe="([^"]*)"', done.stdout)[1].replace("&quot;", '"')
    assert found == "[0,[]]", found


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
    assert found == '[["10","2","1"],"descending",[true,true]]'
    assert "CONSOLE" not in done.stderr


FIRST = """new Promise((resolve) => { const wait = () => {
    if (!document.querySelector(".lead figure") || document.readyState !== "complete") {
      setTimeout(wait, 10); return; }
    const box = (what) => document.querySelector(what).getBoundingClientRect();
    const root = document.documentElement, svg = document.querySelector(".lead svg");
    resolve({ heading: document.querySelector("h1").textContent,
      sentences: document.querySelectorAll(".answer li").length,
      figures: document.querySelectorAll("header figure").length,
      seen: box("header").bottom <= innerHeight, sideways: root.scrollWidth - root.clientWidth,
      beside: box(".lead figure").left > box(".answer").right,
      letters_px: Math.min(...[...svg.querySelectorAll("text")].map(
        (text) => parseFloat(getComputedStyle(text).fontSize)))
        * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width }); };
    wait(); })"""


@pytest.mark.parametrize("width, height", [(1280, 800), (1920, 1080), (390, 844)])
def test_the_first_screen_answers_the_question(browser_here, tmp_path, width, height):
    """On a busy computer: the question, its answer and one figure, which can be read."""
    axes = {"robots": [1, 2, 4, 8], "strategy": ["near", "far"]}
    campaign(tmp_path, axes, 3, lambda levels, k: timed(
        None if levels["robots"] == 1 and k == 0 else 100.0 / levels["robots"] + k,
        map_age_s=1.0 + k))
    page = write(tmp_path, design(axes, iterations=3, report={
        "metrics": ["exploration_time_s", "map_age_s"]}))
    with load(), Browser(tmp_path / "profile", width, height, touch=width < 400) as browser:
        browser("Page.navigate", url=page.as_uri())
        seen = browser.value(FIRST)
        assert browser.complaints == []
    assert seen.pop("letters_px") > 8
    wide = width > 400
    assert seen == {"heading": "Does <it> pay off & when?", "sentences": 4, "figures": 1,
                    "seen": wide, "sideways": 0, "beside": wide}
