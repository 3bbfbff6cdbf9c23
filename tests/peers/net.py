"""The network of a visitor, the same for all who are compared: Chromium slows itself down."""

from __future__ import annotations

from playwright.sync_api import CDPSession, Page

MBIT_S = 10.0
LATENCY_MS = 40.0
TOLD = f"{MBIT_S:.0f} Mbit/s, {LATENCY_MS:.0f} ms"


def slowed(page: Page) -> CDPSession:
    """Have a page's requests take their time, with nothing cached from before."""
    session = page.context.new_cdp_session(page)
    session.send("Network.enable")
    bytes_s = MBIT_S * 1e6 / 8
    session.send(
        "Network.emulateNetworkConditions",
        {
            "offline": False,
            "latency": LATENCY_MS,
            "downloadThroughput": bytes_s,
            "uploadThroughput": bytes_s,
        },
    )
    return session
