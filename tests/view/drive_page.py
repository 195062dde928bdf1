"""Opens a replay page in Chromium by WebDriver, uses it as a reader would, and prints what came of it as one JSON object.

    python3 drive_page.py PAGE.html

Standard library alone. Exit status 0: driven; 1: the page or the browser failed, with the reason on stderr.
"""
import base64
import http.client
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time
import zlib

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # WebDriver's name for a reference to an element
ARGUMENTS = [
    "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--no-first-run", "--disable-component-update", "--disable-sync",
    "--force-device-scale-factor=0.5", "--window-size=1000,720",
]


class Browser:
    def __init__(self, profile):
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in self.driver.stdout:
            found = re.search(r"started successfully on port (\d+)", line)
            if found:
                self.port = int(found.group(1))
                break
        else:
            raise RuntimeError("chromedriver did not start")
        self.session = ""
        answer = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": {"args": ARGUMENTS + [f"--user-data-dir={profile}"]},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}}})
        self.session = "/session/" + answer["sessionId"]

    def call(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        connection.request(method, self.session + path, None if method == "GET" else json.dumps(body or {}),
                           {"Content-Type": "application/json"})
        answer = json.loads(connection.getresponse().read())["value"]
        connection.close()
        if isinstance(answer, dict) and answer.get("error"):
            raise RuntimeError(f"{path}: {answer['error']}: {answer['message'].splitlines()[0]}")
        return answer

    def close(self):
        if self.session:
            self.call("DELETE", "")
        self.driver.terminate()
        self.driver.wait(10)

    def script(self, text, *arguments):
        return self.call("POST", "/execute/sync", {"script": text, "args": list(arguments)})

    def frames(self, count=2):
        """Until the page has drawn so many frames: it has answered what came before."""
        self.call("POST", "/execute/async", {"script": """
            const [count, done] = arguments;
            const next = (left) => left > 0 ? requestAnimationFrame(() => next(left - 1)) : done();
            next(count);""", "args": [count]})

    def wait_for(self, condition):
        """Until the page says so; False where it does not within half a minute, however slow the machine is."""
        for _ in range(300):
            if self.script(f"return {condition}"):
                return True
            time.sleep(0.1)
        return False

    def element(self, selector):
        return self.call("POST", "/element", {"using": "css selector", "value": selector})[ELEMENT]

    def click(self, selector):
        self.call("POST", f"/element/{self.element(selector)}/click")
        self.frames()

    def text(self, selector):
        return self.call("GET", f"/element/{self.element(selector)}/text")

    def press(self, key):
        self.call("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": [
            {"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]}]})
        self.frames()

    def drag(self, selector, start, end):
        """From one place to another, both in pixels from the element's middle."""
        origin = {ELEMENT: self.element(selector)}
        move = lambda at, wait: {"type": "pointerMove", "duration": wait, "origin": origin, "x": at[0], "y": at[1]}
        self.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            move(start, 0), {"type": "pointerDown", "button": 0}, move(end, 100), {"type": "pointerUp", "button": 0}]}]})
        self.frames()

    def picture(self, selector):
        return base64.b64decode(self.call("GET", f"/element/{self.element(selector)}/screenshot"))

    def log(self, kind):
        return self.call("POST", "/se/log", {"type": kind})


def pixels(png):
    """Rows of bytes and bytes per pixel of an 8-bit PNG."""
    at, packed = 8, b""
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data = png[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[:10])
            channels = {0: 1, 2: 3, 6: 4}[colour]
            assert depth == 8
        elif kind == b"IDAT":
            packed += data
        at += 12 + size
    raw, stride, rows = zlib.decompress(packed), width * channels, []
    before = bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left = row[x - channels] if x >= channels else 0
            corner = before[x - channels] if x >= channels else 0
            up = before[x]
            if kind == 1:
                row[x] = row[x] + left & 255
            elif kind == 2:
                row[x] = row[x] + up & 255
            elif kind == 3:
                row[x] = row[x] + (left + up) // 2 & 255
            elif kind == 4:
                guess = left + up - corner
                row[x] = row[x] + min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2] & 255
        rows.append(bytes(row))
        before = row
    return rows, channels


def variance(png):
    """Of the green channel, 0 to 16256."""
    rows, channels = pixels(png)
    values = [row[x] for row in rows[::2] for x in range(1, len(row), 2 * channels)]
    mean = sum(values) / len(values)
    return sum((value - mean) ** 2 for value in values) / len(values)


def changed(first, second):
    """Part of the pixels that differ."""
    (a, channels), (b, _) = pixels(first), pixels(second)
    differ = sum(p[x:x + channels] != q[x:x + channels] for p, q in zip(a, b) for x in range(0, len(p), channels))
    return differ * channels / sum(len(row) for row in a)


def drive(browser, page):
    reported = {}
    browser.log("performance")  # what the browser's own first page asked for
    browser.call("POST", "/url", {"url": pathlib.Path(page).resolve().as_uri()})
    is_ready = "document.documentElement.dataset.ready === 'yes'"
    browser.wait_for(f"{is_ready} || (document.querySelector('[role=alert]') !== null && !window.trocarViewer?.page)")
    ready = reported["ready"] = browser.script(f"return {is_ready}")
    reported["alerts"] = browser.script("return [...document.querySelectorAll('[role=alert]')].map((one) => one.textContent)")
    if ready:
        use(browser, reported)
    reported["errors"] = [one["message"] for one in browser.log("browser") if one["level"] == "SEVERE"]
    requests = [json.loads(one["message"])["message"] for one in browser.log("performance")]
    reported["requests"] = sorted({one["params"]["request"]["url"].split("#")[0] for one in requests
                               if one["method"] == "Network.requestWillBeSent"
                               and not one["params"]["request"]["url"].startswith(("data:", "blob:", "chrome:"))})
    return reported


def use(browser, reported):
    tick = lambda: browser.script("return trocarViewer.page.tick")
    canvas = "canvas.stage"
    reported["panels"] = browser.script("return document.querySelectorAll('.panel').length")
    reported["panel_words"] = browser.text(".panel")
    reported["first_tick"] = tick()
    at_worst = browser.picture(canvas)
    reported["variance"] = variance(at_worst)
    browser.press("\ue011")  # Home
    reported["tick_after_home"] = tick()
    at_start = browser.picture(canvas)
    reported["changed_by_tick"] = changed(at_worst, at_start)
    browser.press("\ue014")  # right
    reported["tick_after_right"] = tick()
    browser.click("#tick")  # its middle
    reported["tick_after_slider"] = tick()
    reported["slider_shows"] = browser.text(".transport output")
    browser.click(".panel .worst")
    reported["tick_after_worst"] = tick()
    browser.press("w")
    reported["tick_after_w"] = tick()
    worst = browser.picture(canvas)
    browser.click("[data-field=displacement]")
    reported["pressed"] = browser.script("return document.querySelector('[data-field=displacement]').getAttribute('aria-pressed')")
    reported["changed_by_field"] = changed(worst, browser.picture(canvas))
    reported["legend"] = browser.text(".legend")
    before = browser.picture(canvas)
    browser.drag(".surface", (0, 60), (90, 90))
    reported["changed_by_turning"] = changed(before, browser.picture(canvas))
    browser.drag("#force", (40, 0), (40, 0))
    reported["tick_after_chart"] = tick()
    browser.press("\ue011")
    browser.click("#play")
    browser.wait_for("trocarViewer.page.tick > 0")
    reported["tick_while_playing"] = tick()
    browser.click("#play")
    stopped = tick()
    browser.frames(10)
    reported["stays_when_stopped"] = tick() == stopped
    if reported["panels"] > 1:
        browser.click("[data-run='1']")
        reported["panels_after_click"] = browser.script("return document.querySelectorAll('.panel').length")
    reported["curves"] = browser.script("return [...document.querySelectorAll('.chart svg')].map((svg) => svg.querySelectorAll('path').length)")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(profile)
        try:
            print(json.dumps(drive(browser, sys.argv[1])))
        finally:
            browser.close()


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError, KeyError, AssertionError) as error:
        sys.exit(f"drive_page.py: {type(error).__name__}: {error}")
