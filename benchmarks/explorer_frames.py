"""How many frames a second the explorer draws while its dot is dragged.

python -m benchmarks.explorer_frames

docs/results/measured/explorer_frames.json keeps what was found.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import threading
from collections import defaultdict
from typing import Any

from agents.explorer import make_server
from benchmarks.measured import keep

CASES = {
    "desk_one_segment_7_tendons": ((1280, 800), "#robot=default&n=7&mode=hand&c=0,0"),
    "desk_three_segments_32_tendons": (
        (1280, 800),
        "#robot=default3&n=32&mode=hand&c=8,2,4,6,9,9",
    ),
    "phone_one_segment_7_tendons": ((390, 844), "#robot=default&n=7&mode=hand&c=0,0"),
}
"""Size of the window, and what it shows."""

RASTERISERS = ("canvas", "webgl")

DRAGGED = """async ([warmUp, seconds]) => {
    const handle = document.querySelector("#disk .handle"), box = handle.getBoundingClientRect();
    const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
    const { explorer } = window, { draw } = explorer;
    let drawn = 0;
    explorer.draw = () => { drawn++; draw.call(explorer); };
    const until = (end) => new Promise((resolve) => {
        const frame = (now) => {
            const clientX = x + 50 * Math.sin(now / 400), clientY = y + 50 * Math.cos(now / 400);
            const moved = new PointerEvent("pointermove", { pointerId: 1, clientX, clientY });
            handle.dispatchEvent(moved);
            if (now < end) requestAnimationFrame(frame);
            else resolve(now);
        };
        requestAnimationFrame(frame);
    });
    const start = await until(performance.now() + 1e3 * warmUp);
    drawn = 0;
    const end = await until(start + 1e3 * seconds);
    return (1e3 * drawn) / (end - start);
}"""
"""Frames a second while a pointer that has hold of the dot moves with every frame."""


def _measured(
    browser: Any, address: str, size: tuple[int, int], seconds: float
) -> tuple[float, float, str]:
    """Return frames a second, the time of the first picture [ms] and what drew."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.goto(address)
    page.wait_for_function("window.explorer?.pictures && !window.explorer.dirty")
    first = page.evaluate("performance.getEntriesByName('first picture')[0].startTime")
    page.locator("#disk .handle").first.hover()
    page.mouse.down()
    frames = page.evaluate(DRAGGED, [0.3 * seconds, seconds])
    drawn = page.evaluate("window.explorer.pictures.canvas.dataset.drawn")
    page.close()
    return frames, first, drawn


def measure(browser: Any, rounds: int, seconds: float) -> dict[str, Any]:
    """Return the medians over rounds, each of which takes every case in turn."""
    found = defaultdict(list)
    with make_server(0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        for _ in range(rounds):
            for case, (size, shown) in CASES.items():
                for rasteriser in RASTERISERS:
                    frames, first, drawn = _measured(
                        browser, f"{address}?draw={rasteriser}{shown}", size, seconds
                    )
                    assert drawn == rasteriser, drawn
                    found[f"{case}_{rasteriser}_frames_per_s"].append(frames)
                    found[f"{case}_{rasteriser}_first_picture_ms"].append(first)
        chosen = _measured(browser, address, (1280, 800), seconds=0.1)[2]
        server.shutdown()
    return {
        **{name: round(statistics.median(values), 1) for name, values in found.items()},
        "graphics card": chosen == "webgl",
        "chromium": browser.version,
    }


def main() -> None:
    """Run the command line."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=3.0, help="of dragging, a case and round")
    options = parser.parse_args()
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium)
        measured = measure(browser, options.rounds, options.seconds)
        browser.close()
    for name, value in measured.items():
        print(f"{name}: {value}")
    keep("explorer_frames", measured)


if __name__ == "__main__":
    main()
