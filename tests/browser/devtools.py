"""Chromium without a window, driven through the DevTools protocol on two pipes. Standard library only."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars", "--window-size=1280,1500",
    "--remote-debugging-pipe",
]


class Browser:
    """One browser with one page. `faults`: errors of the page and requests it made to anything but files."""

    def __init__(self, patience=30.0):
        self.patience = patience
        self.faults = []
        self._events = []
        self._count = 0
        self._session = None
        self._rest = b""
        self._profile = tempfile.mkdtemp(prefix="browser-")
        command = shutil.which("chromium")
        if command is None:
            raise SystemExit("chromium is not installed: apt-get install chromium")
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        # Chromium reads commands from descriptor 3 and answers on 4.
        shell = f'exec "$@" 3<&{theirs_in} 4>&{theirs_out}'
        self._process = subprocess.Popen(
            ["bash", "-c", shell, "chromium", command, *FLAGS, f"--user-data-dir={self._profile}", "about:blank"],
            pass_fds=(theirs_in, theirs_out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        try:
            self._attach()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        os.close(self._out)  # Chromium leaves when its pipe closes.
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._in)
        shutil.rmtree(self._profile, ignore_errors=True)

    def _attach(self):
        targets = self.send("Target.getTargets")["targetInfos"]
        page = next(t for t in targets if t["type"] == "page")
        reply = self.send("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self._session = reply["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(domain + ".enable")

    def send(self, method, **params):
        """Sends a command and returns its result."""
        number = self._post(method, params)
        deadline = time.monotonic() + self.patience
        while True:
            reply = self._receive(deadline, method)
            if reply.get("id") == number:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']['message']}")
                return reply["result"]

    def _post(self, method, params):
        self._count += 1
        number = self._count
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        return number

    def _receive(self, deadline, wanted):
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(0.0, deadline - time.monotonic()))
            chunk = os.read(self._in, 1 << 20) if ready else b""
            if not chunk:
                raise RuntimeError(f"the browser did not answer: {wanted}")
            self._rest += chunk
        text, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(text)
        if "method" in message:
            self._note(message["method"], message["params"])
        return message

    def _note(self, method, params):
        self._events.append(method)
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.faults.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
            self.faults.append("console: " + " ".join(str(a.get("description", a.get("value"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.faults.append("log: " + params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            address = params["request"]["url"]
            if not address.startswith(("file:", "data:", "blob:", "about:")):
                self.faults.append("request: " + address)

    def open(self, path):
        """Opens a file and waits until it has loaded."""
        self._events.clear()
        self.send("Page.navigate", url="file://" + os.path.abspath(path))
        deadline = time.monotonic() + self.patience
        while "Page.loadEventFired" not in self._events:
            self._receive(deadline, "load " + path)

    def evaluate(self, expression):
        """Value of a JavaScript expression; promises are awaited."""
        reply = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in reply:
            details = reply["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]) + "\n" + expression)
        return reply["result"].get("value")

    def wait_for(self, expression, what):
        """Waits until an expression is true."""
        deadline = time.monotonic() + self.patience
        while not self.evaluate(f"Boolean({expression})"):
            if self.faults or time.monotonic() > deadline:
                raise AssertionError("\n".join([f"in vain waited for: {what}", *self.faults]))
            time.sleep(0.05)

    def mouse(self, kind, at, button="none"):
        self.send("Input.dispatchMouseEvent", **_mouse_event(kind, at, button))

    def click(self, at):
        self.mouse("mouseMoved", at)
        self.mouse("mousePressed", at, "left")
        self.mouse("mouseReleased", at, "left")

    def double_click(self, at):
        self.mouse("mouseMoved", at)
        # Without waiting for answers: a slow machine must not make two clicks of it.
        for kind in ("mousePressed", "mouseReleased") * 2:
            self._post("Input.dispatchMouseEvent", _mouse_event(kind, at, "left"))

    def drag(self, start, end):
        self.mouse("mouseMoved", start)
        self.mouse("mousePressed", start, "left")
        for share in (0.3, 0.6, 1.0):
            self.mouse("mouseMoved", [a + share * (b - a) for a, b in zip(start, end)], "left")
        self.mouse("mouseReleased", end, "left")

    def key(self, name):
        """Presses a key by its name, such as ArrowRight."""
        codes = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Enter": 13, "Tab": 9}
        for kind in ("rawKeyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=codes[name])

    def screenshot(self, path):
        data = base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])
        with open(path, "wb") as file:
            file.write(data)
        return data


def _mouse_event(kind, at, button):
    held = 1 if button == "left" and kind != "mouseReleased" else 0
    clicks = 1 if kind in ("mousePressed", "mouseReleased") else 0
    return {"type": kind, "x": at[0], "y": at[1], "button": button, "buttons": held, "clickCount": clicks}
