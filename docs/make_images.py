"""Draws the pictures of README.md and docs/ that need one run each; with a browser also the page of `watch`.

    python docs/make_images.py [NAME ..]

The tutorials and the page of the papers draw theirs themselves.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from inputdesign_cli import load_spec, solve
from inputdesign_cli.figures.plots import draw
from inputdesign_cli.figures.style import BLUE, DASHED, GREY, ORANGE, frequency_axis, rendered
from inputdesign_cli.outcome.run_directory import replace_text

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
SPECS = ROOT / "specs"
# Image -> spec, figure.
PICTURES = {
    "heater_loop_nyquist": ("heater_loop", "nyquist"),
    "limited_signal": ("limited_signal", "signal"),
    "robust_fan": ("robust_first_order", "fan"),
}
SAVED = (
    ("max_sensitivity_db: 6", "max_sensitivity_db: 5.5"),
    ("max_sensitivity_db: 5.5", "max_sensitivty_db: 5.5"),
)


def pictures(names: list[str]) -> None:
    """Solve each spec once, and draw what is asked of it."""
    for stem in dict.fromkeys(spec for name, (spec, _) in PICTURES.items() if name in names):
        results = solve(load_spec(SPECS / f"{stem}.yaml"))
        for name in names:
            if name in PICTURES and PICTURES[name][0] == stem:
                content = draw(results.curves[PICTURES[name][1]], results.time_unit)
                (IMAGES / f"{name}.png").write_bytes(content)


def hero() -> None:
    """What the design of the first spec gains over white excitation: of its power, and of its accuracy."""
    results = solve(load_spec(SPECS / "first_order.yaml"))
    table, white = results.bound, results.result["baseline"]["white"]
    w, admitted = table["frequency_rad_per_s"], np.asarray(table["r_adm"])
    designed, flat = np.asarray(table["r_u"]) / admitted, np.asarray(table["r_u_equal"]) / admitted

    def paint(page: Figure) -> None:
        page.set_size_inches(9.0, 3.9)
        error, power = page.subplots(1, 2, width_ratios=[3, 2])
        error.axhspan(1.0, 3.0, color=ORANGE, alpha=0.08, linewidth=0)
        error.plot(w, flat, color=GREY, linewidth=2.0)
        error.plot(w, designed, color=BLUE, linewidth=2.8)
        error.axhline(1.0, color=ORANGE, linestyle=DASHED)
        error.text(0.004, 2.75, "too inaccurate", color=ORANGE)
        error.text(0.012, 1.08, "what you asked for", color=ORANGE)
        error.text(1.0, flat.max() - 0.38, "white noise", color="#555555")
        error.text(0.006, designed[0] - 0.2, "designed", color=BLUE)
        frequency_axis(error, w, "s")
        error.set_ylim(0.0, 3.0)
        error.set_ylabel("error of the model / admitted error")
        error.set_title(f"Same power: white noise errs {flat.max():.2g} times too much", loc="left")
        ratio = white["ratio"]
        power.barh(["white noise", "designed"], [ratio, 1.0], color=[GREY, BLUE], height=0.55)
        power.text(ratio - 0.1, 0, f"{ratio:.2g} times", ha="right", va="center", color="white")
        power.text(1.1, 1, "1", va="center", color=BLUE)
        power.grid(False, axis="y")
        power.set_xlabel("power of the input")
        power.set_title("Same accuracy: what it costs", loc="left")

    (IMAGES / "hero.png").write_bytes(rendered(paint))


def watch_page(browser: str) -> None:
    """A spec is solved, changed, and broken: what the page shows then."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        spec = Path(folder) / "heater_loop.yaml"
        shutil.copy(SPECS / "heater_loop.yaml", spec)
        command = [sys.executable, "-m", "inputdesign_cli", "watch", str(spec), "-o", f"{folder}/run"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            page = driver.chromium.launch(executable_path=browser, args=["--no-sandbox"]).new_page(
                viewport={"width": 1400, "height": 950}
            )
            page.goto(process.stdout.readline().strip())
            for ready, (old, new) in zip(("#design-1", "#design-2"), SAVED, strict=True):
                page.wait_for_selector(f".state.done ~ .columns {ready}", timeout=300_000)
                replace_text(spec, spec.read_text(encoding="utf-8").replace(old, new))
            page.wait_for_selector("mark", timeout=300_000)
            page.screenshot(path=IMAGES / "watch.png")
            process.terminate()


def main(names: list[str]) -> None:
    """All pictures, or those that are named."""
    pictures(names or list(PICTURES))
    if not names or "hero" in names:
        hero()
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser and (not names or "watch" in names):
        watch_page(browser)


if __name__ == "__main__":
    main(sys.argv[1:])
