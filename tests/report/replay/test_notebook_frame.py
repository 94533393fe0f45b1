"""The replay in a notebook: a frame that may run scripts and is nobody's neighbour."""

import html
import json

from devtools import Browser

import desim

_PROBE = """<script>
const wait = () => window.desimReplay || document.body?.dataset.failed
  ? parent.postMessage(document.body.innerText, "*") : setTimeout(wait, 10);
wait();
</script>"""


def test_it_is_drawn_in_its_frame(tmp_path, hello, browser_here):
    text = desim.compare(hello, hello)._repr_html_()
    probed = text.replace('srcdoc="', 'srcdoc="' + html.escape(_PROBE))
    assert probed != text
    with Browser(tmp_path / "profile") as browser:
        said = browser.value("new Promise((resolve) => {"
                             "addEventListener('message', (event) => resolve(event.data));"
                             f"document.body.innerHTML = {json.dumps(probed)}; }})")
        assert "hello" in said and "delivered" in said
        assert not browser.complaints
