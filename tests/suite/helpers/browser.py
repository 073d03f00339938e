"""Headless Chromium, driven over a pipe with its DevTools protocol: mouse, keys, screenshots."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import subprocess
from base64 import b64decode

from tests.suite.helpers.patience import soon

PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = ["--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]


class Browser:
    """One page of a browser.

    Attributes
    ----------
    errors : list of str
        What the page's console has said of errors, and exceptions that nothing caught.
    """

    def __init__(self, folder, width=1280, height=900):
        to_read, self._write = os.pipe()
        self._read, to_write = os.pipe()
        # Chromium reads descriptor 3 and writes 4, whatever this process has there
        given = [fcntl.fcntl(each, fcntl.F_DUPFD, 10) for each in (to_read, to_write)]
        args = [PROGRAM, *FLAGS, f"--user-data-dir={folder}", "--remote-debugging-pipe"]
        moved = 'exec "$@" 3<&{} 4>&{} {}<&- {}>&-'.format(*given, *given)
        self._process = subprocess.Popen(
            ["bash", "-c", moved, "bash", *args], pass_fds=given, stderr=subprocess.DEVNULL
        )
        for each in (to_read, to_write, *given):
            os.close(each)
        self.errors, self._count, self._rest, self._session = [], 0, b"", None
        page = self.send("Target.createTarget", url="about:blank")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=page, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.send(f"{domain}.enable")
        self.resize(width, height)

    def __enter__(self):
        return self

    @property
    def process_id(self):
        """Of the browser's first process, whose children are the others."""
        return self._process.pid

    def __exit__(self, *_):
        os.close(self._write)
        self._process.terminate()
        self._process.wait(20)
        os.close(self._read)

    def send(self, method, **params):
        """Send a command and return its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            found = self._next()
            if found.get("id") == self._count:
                assert "error" not in found, found
                return found["result"]

    def _next(self):
        while b"\0" not in self._rest:
            part = os.read(self._read, 2**20)
            assert part, "the browser has ended"
            self._rest += part
        text, _, self._rest = self._rest.partition(b"\0")
        found = json.loads(text)
        method, params = found.get("method"), found.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(params["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
            self.errors.append(json.dumps(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(json.dumps(params["entry"]))
        return found

    def resize(self, width, height, *, dark=False):
        """Give the page another size, and the light or the dark scheme."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        self.send("Emulation.setDeviceMetricsOverride", **size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.send("Emulation.setEmulatedMedia", features=[scheme])

    def open(self, address, ready="document.body?.dataset.shown !== undefined"):
        """Open an address, and wait until the page is ready."""
        self.send("Page.navigate", url=address)
        self.until(ready)

    def run(self, script):
        """Return the value of an expression, also of one that is awaited."""
        asked = {"expression": script, "awaitPromise": True, "returnByValue": True}
        found = self.send("Runtime.evaluate", **asked)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, script):
        """Wait until an expression is true."""
        assert soon(lambda: self.run(script)), script

    def middle(self, selector):
        """Return the place of an element's middle in the window."""
        script = f"document.querySelector('{selector}').getBoundingClientRect().toJSON()"
        box = self.run(script)
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def mouse(self, kind, x, y, *, held=True, modifiers=0):
        """Send a mouse event: mousePressed, mouseMoved or mouseReleased; modifiers as of press."""
        more = {"button": "left" if held else "none", "clickCount": int(kind != "mouseMoved")}
        more |= {"buttons": int(held and kind != "mouseReleased"), "modifiers": modifiers}
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def touch(self, kind, *place):
        """Send an event of a finger on the screen: touchStart, touchMove or touchEnd."""
        points = [dict(zip("xy", place, strict=True))] if place else []
        self.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def press(self, key, modifiers=0):
        """Press a key of the keyboard: 2 is Ctrl, 8 is shift."""
        arrows = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
        for kind in ("rawKeyDown", "keyUp"):
            self.send(
                "Input.dispatchKeyEvent", type=kind, key=key, modifiers=modifiers,
                windowsVirtualKeyCode=arrows.get(key) or ord(key.upper()),
                code=key if key in arrows else f"Key{key.upper()}",
            )  # fmt: skip

    def screenshot(self, file):
        """Write the picture of what is seen."""
        file.write_bytes(b64decode(self.send("Page.captureScreenshot")["data"]))
