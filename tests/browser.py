"""A real browser without a window, told what to do through a pipe (Chromium's DevTools protocol)."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
SIZES = {"wide": (1280, 800), "narrow": (390, 844)}
LOOKS = ("light", "dark")


def chromium():
    """The browser's program; the test is skipped where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("Chromium is missing (Debian, Ubuntu: apt install chromium): pages were not opened")
    return found


class Browser:
    """A browser with one page, within a `with` block; what its console says is kept in `said`."""

    def __enter__(self):
        self._folder, self.said, self._numbers = tempfile.mkdtemp(), [], itertools.count(1)
        theirs, self._in = os.pipe()
        self._out, their_out = os.pipe()
        words = [chromium(), "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        words += ["--disable-dev-shm-usage", f"--user-data-dir={self._folder}"]
        shell = ["bash", "-c", f'exec "$@" 3<&{theirs} 4>&{their_out}', "bash", *words]
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(shell, pass_fds=(theirs, their_out), stdout=quiet, stderr=quiet)
        os.close(theirs)
        os.close(their_out)
        self._rest, self._session = b"", None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *error):
        self._process.terminate()
        self._process.wait()
        os.close(self._in)
        os.close(self._out)
        shutil.rmtree(self._folder, ignore_errors=True)

    def open(self, path, size, look):
        """Open a file in a window of a size, light or dark."""
        assert Path(path).is_file(), path
        width, height = size
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": look}])
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=Path(path).resolve().as_uri())
        while self.value("document.readyState + location.protocol") != "completefile:":
            pass

    def value(self, expression):
        """The value of an expression of the page's script."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def press(self, key, code):
        """Press a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def click(self, x, y):
        """Click at a pixel of the window."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def picture(self, path, whole=True):
        """Write what is seen, or the whole page, as PNG."""
        content = self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"]
        Path(path).write_bytes(base64.b64decode(content))

    def call(self, method, **parameters):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._in, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]
            if answer.get("method") in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"):
                self.said.append(answer["params"])

    def _next(self):
        while b"\0" not in self._rest:
            more = os.read(self._out, 1 << 20)
            assert more, "the browser ended"
            self._rest += more
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)


FAULTS = """(() => {
  const wide = [...document.querySelectorAll('body *')].filter((each) => {
    const box = each.getBoundingClientRect();
    if (!box.width || each.closest('.wide, nav, svg')) return false;
    return box.right > innerWidth + 1 || box.left < -1;
  });
  const named = (each) => (each.alt || each.getAttribute('aria-label') || '').length > 10;
  const pictures = [...document.querySelectorAll('img, svg')];
  return {
    overflow: Math.max(document.documentElement.scrollWidth - innerWidth, 0),
    outside: wide.map((each) => each.tagName + '.' + each.className),
    unnamed: pictures.filter((each) => !named(each)).map((each) => each.outerHTML.slice(0, 80)),
    broken: [...document.images].filter((each) => !each.naturalWidth).map((each) => each.alt),
    pictures: pictures.length,
    twice: [...document.querySelectorAll('[id]')].map((each) => each.id).filter((id, k, all) => all.indexOf(id) !== k),
    outward: [...document.querySelectorAll('[src], link')].map((each) => each.src || each.href)
      .filter((address) => !address.startsWith('data:')),
  };
})()"""


def faults_of(path):
    """What is wrong with a page at either size, light and dark, as sentences; none: nothing is."""
    found = []
    with Browser() as browser:
        for (name, size), look in itertools.product(SIZES.items(), LOOKS):
            browser.said.clear()
            browser.open(path, size, look)
            for key, value in browser.value(FAULTS).items():
                if (not value) if key == "pictures" else value:
                    found.append(f"{name}, {look}: {key}: {value}")
            found += [f"{name}, {look}: console: {said}" for said in browser.said]
    return found
