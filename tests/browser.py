# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium for tests, controlled by its DevTools protocol over two pipes; needs only Python's standard library.

    with Browser() as browser:
        page = browser.open("http://127.0.0.1:8080/", width=390, height=844)
        page.wait_for("document.title === 'Live'")
        page.value("1 + 1")
"""
import base64
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--mute-audio", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--remote-debugging-pipe"]
PATIENCE_S = 120  # a busy machine


class Browser:
    def __init__(self, flags=()):
        self.folder = tempfile.TemporaryDirectory()
        theirs_in, self.out = os.pipe()
        self.inward, theirs_out = os.pipe()

        def on_fds():  # the protocol's descriptors are 3 and 4
            a, b = os.dup(theirs_in), os.dup(theirs_out)
            os.dup2(a, 3)
            os.dup2(b, 4)

        self.process = subprocess.Popen([PROGRAM, *FLAGS, *flags, f"--user-data-dir={self.folder.name}", "about:blank"], close_fds=False,
                                        preexec_fn=on_fds, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(theirs_in)
        os.close(theirs_out)
        self.waiting, self.number, self.events = b"", 0, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        os.close(self.out)
        os.close(self.inward)
        self.folder.cleanup()

    def call(self, method, session=None, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + PATIENCE_S
        while True:
            answer = self.receive(end)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def receive(self, end):
        while b"\0" not in self.waiting:
            if not select.select([self.inward], [], [], max(0, end - time.monotonic()))[0]:
                raise TimeoutError("the browser says nothing")
            self.waiting += os.read(self.inward, 1 << 20)
        message, _, self.waiting = self.waiting.partition(b"\0")
        return json.loads(message)

    def open(self, url, width=1400, height=1000, phone=False):
        target = self.call("Target.createTarget", url="about:blank", newWindow=True)["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.call(f"{domain}.enable")
        page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone)
        page.call("Page.navigate", url=url)
        page.wait_for("location.protocol !== 'about:' && document.readyState === 'complete'")
        return page


class Page:
    def __init__(self, browser, session):
        self.browser, self.session = browser, session

    def call(self, method, **parameters):
        return self.browser.call(method, self.session, **parameters)

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def text(self, element):
        return self.value(f"document.getElementById({json.dumps(element)}).textContent")

    def click(self, element):
        self.value(f"document.getElementById({json.dumps(element)}).click()")

    def wait_for(self, expression, patience_s=PATIENCE_S):
        end = time.monotonic() + patience_s
        while not self.value(expression):
            if time.monotonic() > end:
                raise TimeoutError(f"never came true: {expression}")
            time.sleep(0.05)

    def picture(self, path):
        """A JPEG of the visible part of the page."""
        data = self.call("Page.captureScreenshot", format="jpeg", quality=85)["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def faults(self):
        """The page's errors so far, one sentence each."""
        out = []
        for event in self.browser.events:
            if event.get("sessionId") != self.session:
                continue
            what, parameters = event["method"], event["params"]
            if what == "Runtime.exceptionThrown":
                out.append(str(parameters["exceptionDetails"]))
            elif what == "Log.entryAdded" and parameters["entry"]["level"] == "error":
                out.append(f"{parameters['entry']['text']} {parameters['entry'].get('url', '')}")
        return out

    def addresses(self):
        """The addresses of all requests of the page."""
        return [e["params"]["request"]["url"] for e in self.browser.events
                if e.get("sessionId") == self.session and e["method"] == "Network.requestWillBeSent"]
