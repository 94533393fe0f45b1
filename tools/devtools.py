"""Chromium without a window, driven over a pipe with the DevTools protocol, for tools and tests."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager

FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--hide-scrollbars",
         "--mute-audio", "--disable-dev-shm-usage")


def chromium():
    """The browser's path, or None."""
    return shutil.which("chromium") or shutil.which("google-chrome")


@contextmanager
def load(count=2):
    """Processes that take all of a small computer."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for each in busy:
            each.kill()
            each.wait()


class Browser:
    """One page in a browser of its own: ``with Browser(profile) as page``."""

    def __init__(self, profile, width=1280, height=800, scheme="light", touch=False):
        self.complaints = []
        self._numbers = itertools.count(1)
        out_read, out_write = os.pipe()
        in_read, in_write = os.pipe()
        # The browser reads commands from descriptor 3 and writes answers to 4.
        self._process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{out_read} 4>&{in_write}', "bash", chromium(), *FLAGS,
             f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank"],
            pass_fds=(out_read, in_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(out_read)
        os.close(in_write)
        self._to = os.fdopen(out_write, "wb", buffering=0)
        self._from = os.fdopen(in_read, "rb")
        self._session = None
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self(f"{domain}.enable")
        self("Emulation.setDeviceMetricsOverride", width=width, height=height,
             deviceScaleFactor=2 if touch else 1, mobile=touch)
        if touch:
            self("Emulation.setTouchEmulationEnabled", enabled=True)
        self("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": scheme}])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._to.close()
        self._from.close()

    def __call__(self, method, **params):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        self._to.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def open(self, page):
        """Load a file or an address, and wait until the replay is drawn."""
        self("Page.navigate", url=page if isinstance(page, str) else page.as_uri())
        self.value("""new Promise((resolve) => {
            const wait = () => window.desimReplay || document.body?.classList.contains("failed")
                ? requestAnimationFrame(() => resolve(true)) : setTimeout(wait, 10);
            wait(); })""")

    def value(self, expression):
        """The JSON value of a JavaScript expression; a promise is awaited."""
        found = self("Runtime.evaluate", expression=expression, awaitPromise=True,
                     returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def key(self, key, shift=False):
        text = key if len(key) == 1 else ""
        for kind in ("keyDown", "keyUp"):
            self("Input.dispatchKeyEvent", type=kind, key=key, modifiers=8 if shift else 0,
                 **({"text": text} if kind == "keyDown" and text else {}))

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def picture(self, file):
        file.write_bytes(base64.b64decode(self("Page.captureScreenshot", format="png")["data"]))

    def _next(self):
        line = bytearray()
        while (byte := self._from.read(1)) != b"\0":
            assert byte, "the browser has gone"
            line += byte
        answer = json.loads(line)
        if answer.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
            self.complaints.append(answer["params"])
        if answer.get("method") == "Runtime.consoleAPICalled":
            self.complaints.append(answer["params"]["args"])
        return answer
