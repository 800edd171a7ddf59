"""A real browser, headless and offline, steered over the DevTools protocol."""

import asyncio
import json
import re
import shutil
import subprocess
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from tornado.httpclient import AsyncHTTPClient
from tornado.websocket import WebSocketClientConnection, websocket_connect

CHROMIUM = shutil.which("chromium")
PATIENCE = 60.0
"""s that a loaded machine may take for an answer."""


class Browser:
    """A page in Chromium.

    Attributes:
        problems: what its console said that is not mere information, exceptions, and requests that left the page.
    """

    def __init__(self, socket: WebSocketClientConnection) -> None:
        """Take a connection to the page."""
        self._socket, self._last = socket, 0
        self._loaded = False
        self.problems: list[str] = []

    async def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Answer to a method of the protocol."""
        self._last += 1
        await self._socket.write_message(json.dumps({"id": self._last, "method": method, "params": parameters}))
        while True:
            message = await self._receive()
            if message.get("id") == self._last:
                assert "error" not in message, message
                return message["result"]

    async def open(self, page: Path, width: int = 1400, height: int = 900, scheme: str = "light") -> None:
        """Load a page, without a network."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            await self.send(f"{domain}.enable")
        await self.send(
            "Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0
        )
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        await self.send("Emulation.setDeviceMetricsOverride", **metrics)
        await self.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self._loaded = False
        await self.send("Page.navigate", url=page.absolute().as_uri())
        while not self._loaded:
            await self._receive()

    async def run(self, script: str) -> Any:
        """Value of an expression in the page; a promise is awaited."""
        result = await self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    async def _receive(self) -> dict[str, Any]:
        text = await asyncio.wait_for(self._socket.read_message(), PATIENCE)
        assert text is not None, "the browser went away"
        message: dict[str, Any] = json.loads(text)
        method, about = message.get("method"), message.get("params", {})
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.problems.append(str(about["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert"):
            self.problems.append(str(about["args"]))
        elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.problems.append(str(about["entry"]))
        elif method == "Network.requestWillBeSent" and about["request"]["url"].startswith(("http", "ws")):
            self.problems.append(about["request"]["url"])
        return message


@asynccontextmanager
async def browser(profile: Path) -> AsyncIterator[Browser]:
    """A browser with a profile of its own, closed at the end."""
    flags = [
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--remote-debugging-port=0",
        f"--user-data-dir={profile}",
    ]
    flags += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run", "--hide-scrollbars"]
    process = subprocess.Popen([str(CHROMIUM), *flags, "about:blank"], stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        found = next(filter(None, (re.search(r"ws://(\S+?)/devtools", line) for line in process.stderr)))
        pages = json.loads((await AsyncHTTPClient().fetch(f"http://{found[1]}/json/list")).body)
        address = next(each["webSocketDebuggerUrl"] for each in pages if each["type"] == "page")
        socket = await websocket_connect(address, max_message_size=1 << 28)
        yield Browser(socket)
        socket.close()
    finally:
        process.terminate()
        process.wait(PATIENCE)


def in_browser(profile: Path, task: Callable[[Browser], Coroutine[Any, Any, None]]) -> None:
    """Run a task with a browser."""

    async def whole() -> None:
        async with browser(profile) as each:
            await task(each)

    asyncio.run(whole())
