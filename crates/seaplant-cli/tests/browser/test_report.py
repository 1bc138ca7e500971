"""The report in a real browser: it draws, it can be zoomed, it asks the network for nothing.

Screenshots are left in target/browser to be looked at.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, sync_playwright

TARGET = Path(
    os.environ.get("CARGO_TARGET_DIR") or Path(__file__).parents[4] / "target"
).absolute()
PROGRAM = TARGET / "debug" / "seaplant"
SHOTS = TARGET / "browser"

MOTION = "#surge .fitted figure.chart"


def run(*arguments: str | Path) -> None:
    subprocess.run([PROGRAM, *arguments, "--quiet"], check=True)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        path = os.environ["SEAPLANT_BROWSER"]
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("demo")
    run("demo", "--out", folder)
    return folder / "report.html"


class Reader:
    """Someone who has the report open, and what the browser complained of."""

    def __init__(self, browser: Browser, report: Path, **context: object) -> None:
        self.context = browser.new_context(**context)  # type: ignore[arg-type]
        self.page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.url = report.as_uri()
        self.page.goto(self.url)

    def __enter__(self) -> Page:
        return self.page

    def __exit__(self, *error: object) -> None:
        self.context.close()
        if error[0] is None:
            assert self.complaints == []
            assert self.requests == [self.url]


def alive(chart: Locator) -> Locator:
    """A chart that has been scrolled to and has drawn itself."""
    chart.scroll_into_view_if_needed()
    chart.page.wait_for_function(
        "figure => figure.classList.contains('live')", arg=chart.element_handle()
    )
    return chart


def picture(chart: Locator, panel: int = 0) -> str:
    """The pixels of a panel."""
    return chart.locator("canvas").nth(panel).evaluate("canvas => canvas.toDataURL()")


def span(chart: Locator) -> tuple[float, float]:
    """What a chart says that it shows, on its shared axis."""
    text = chart.locator("output").inner_text().replace("−", "-")
    low, high = re.match(r"(\S+) to (\S+)", text).groups()
    return float(low), float(high)


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 1280), ("light", 390)])
def test_every_chart_is_drawn(browser: Browser, report: Path, scheme: str, width: int) -> None:
    viewport = {"width": width, "height": 900}
    with Reader(browser, report, viewport=viewport, color_scheme=scheme) as page:
        charts = page.locator("figure.chart")
        # Per degree of freedom: two trials, intervals, drag, memory, innovations, a spectrum; seven
        # steady runs.
        assert charts.count() == 4 * 7 + 7
        for k in range(charts.count()):
            chart = alive(charts.nth(k))
            for n in range(chart.locator("canvas").count()):
                inks = (
                    chart.locator("canvas")
                    .nth(n)
                    .evaluate(
                        """canvas => {
                        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                        const seen = new Map();
                        for (let k = 0; k < data.length; k += 4) {
                            const ink = data.slice(k, k + 4).join();
                            seen.set(ink, (seen.get(ink) ?? 0) + 1);
                        }
                        return [...seen.values()].filter((count) => count > 50).length;
                    }"""
                    )
                )
                assert inks >= 3, f"panel {n} of {chart.get_attribute('data-chart')} is empty"
        overflow = page.evaluate("document.documentElement.scrollWidth - innerWidth")
        assert overflow <= 0, "the page is wider than the window"
        SHOTS.mkdir(parents=True, exist_ok=True)
        page.evaluate("scrollTo(0, 0)")
        page.screenshot(path=SHOTS / f"top-{scheme}-{width}.png")
        alive(page.locator(MOTION).first)
        page.screenshot(path=SHOTS / f"motion-{scheme}-{width}.png")


def test_a_drag_zooms_every_panel_and_whole_undoes_it(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        chart = alive(page.locator(MOTION).first)
        assert span(chart) == (0, 480)
        before = [picture(chart, panel) for panel in range(3)]
        area = chart.locator(".u-over").first
        box = area.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 4, box["y"] + 20)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60, steps=5)
        page.mouse.up()
        low, high = span(chart)
        assert low == pytest.approx(120, abs=2) and high == pytest.approx(240, abs=2)
        zoomed = [picture(chart, panel) for panel in range(3)]
        assert all(one != other for one, other in zip(before, zoomed, strict=True))
        chart.get_by_role("button", name="Show all").click()
        page.mouse.move(0, 0)
        assert span(chart) == (0, 480)
        assert [picture(chart, panel) for panel in range(3)] == before


def test_the_keyboard_zooms_moves_and_switches_lines(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        chart = alive(page.locator(MOTION).first)
        chart.locator(".panels").focus()
        page.keyboard.press("+")
        assert span(chart) == (120, 360)
        page.keyboard.press("ArrowRight")
        assert span(chart) == (144, 384)
        page.keyboard.press("0")
        assert span(chart) == (0, 480)

        paper = chart.get_by_role("switch", name="the paper’s method")
        assert [paper.nth(k).get_attribute("aria-checked") for k in range(2)] == [
            "false",
            "false",
        ]
        before = [picture(chart, panel) for panel in range(3)]
        paper.first.focus()
        page.keyboard.press("Enter")
        assert [paper.nth(k).get_attribute("aria-checked") for k in range(2)] == [
            "true",
            "true",
        ]
        after = [picture(chart, panel) for panel in range(3)]
        assert after[0] != before[0] and after[1] != before[1] and after[2] == before[2]


def test_hovering_tells_what_the_series_file_says(browser: Browser, report: Path) -> None:
    rows = (
        (report.parent / "series" / "surge-1.surge.filter-error.csv").read_text().splitlines()
    )
    with Reader(browser, report) as page:
        chart = alive(page.locator(MOTION).first)
        box = chart.locator(".u-over").first.bounding_box()
        page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 30)
        legends = chart.locator(".u-legend")
        told = [
            value.replace("−", "-")
            for value in legends.first.locator(".u-value").all_inner_texts()
        ]
        time, measured, simulated = (
            float(told[0].removesuffix(" s")),
            float(told[1]),
            float(told[2]),
        )
        row = [float(cell) for cell in rows[1 + round(10 * time)].split(",")]
        assert row[0] == pytest.approx(time)
        assert (measured, simulated) == pytest.approx((row[2], row[3]), abs=3e-4)
        # The panels below tell of the same instant.
        force = legends.nth(2).locator(".u-value").all_inner_texts()
        assert force[0] == told[0].replace("-", "−")
        assert float(force[1].replace("−", "-")) == pytest.approx(row[1], rel=1e-3)


def test_what_is_shown_is_saved(browser: Browser, report: Path, tmp_path: Path) -> None:
    with Reader(browser, report, accept_downloads=True) as page:
        for place in ["#surge figure.chart", MOTION]:
            chart = alive(page.locator(place).first)
            with page.expect_download() as saved:
                chart.get_by_role("button", name="Save what is shown").click()
            assert saved.value.suggested_filename == f"{chart.get_attribute('data-chart')}.png"
            bytes_ = Path(saved.value.path()).read_bytes()
            assert bytes_.startswith(b"\x89PNG") and len(bytes_) > 10_000


def test_charts_follow_the_reader_from_day_to_night(browser: Browser, report: Path) -> None:
    with Reader(browser, report, color_scheme="light") as page:
        chart = alive(page.locator(MOTION).first)
        day = picture(chart)
        page.emulate_media(color_scheme="dark")
        page.wait_for_function(
            "day => document.querySelector('#surge .fitted canvas').toDataURL() !== day",
            arg=day,
        )


def test_tables_are_copied_as_spreadsheets_take_them(browser: Browser, report: Path) -> None:
    with Reader(browser, report, permissions=["clipboard-read", "clipboard-write"]) as page:
        page.locator("#surge .copy").first.click()
        page.get_by_text("Copied").wait_for()
        lines = page.evaluate("navigator.clipboard.readText()").splitlines()
        cells = [line.split("\t") for line in lines]
        assert cells[0][:3] == ["Axis", "Method", "Mass, kg"]
        assert cells[1][:2] == ["Surge", "Filter error"]
        assert len({len(row) for row in cells}) == 1


def test_paper_and_no_script_show_figures_that_stand_still(
    browser: Browser, report: Path
) -> None:
    with Reader(browser, report) as page:
        all_drawn(page)
        page.emulate_media(media="print")
        drawn = page.locator(".panels:visible")
        assert drawn.count() > 0
        for panels in drawn.all():
            figure = panels.locator("xpath=ancestor::figure")
            assert figure.locator(".still").count() == 0, "either a figure or its still"
        stills = page.locator(".still").count()
        assert stills == 4 + 7 and page.locator(".still:visible").count() == stills
        (SHOTS / "report.pdf").write_bytes(page.pdf())
    with Reader(browser, report, java_script_enabled=False) as page:
        page.locator("#paper .fold > summary").click()
        assert page.locator(".still:visible").count() == stills
        assert page.get_by_text("need JavaScript").is_visible()


def all_drawn(page: Page) -> None:
    """Waits until every chart that is not folded has drawn itself, wherever it is."""
    page.wait_for_function(
        """() => [...document.querySelectorAll("figure.chart")]
            .every((figure) => figure.offsetParent === null || figure.classList.contains("live"))"""
    )


def test_a_capture_of_the_whole_page_has_every_chart(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        all_drawn(page)
        assert page.evaluate("scrollY") == 0
        page.screenshot(path=SHOTS / "whole.png", full_page=True)
        screens = page.evaluate("document.documentElement.scrollHeight / innerHeight")
        page.locator("#paper .fold > summary").click()
        unfolded = page.evaluate("document.documentElement.scrollHeight / innerHeight")
        assert screens < 0.75 * unfolded, f"{screens:.0f} of {unfolded:.0f} screens"


def test_charts_fit_the_paper_and_come_back(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        chart = alive(page.locator("#surge figure.chart").first)
        width = "chart => chart.querySelector('.uplot').clientWidth"
        before = chart.evaluate(width)
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert chart.evaluate(width) <= 640
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert chart.evaluate(width) == before


def pages(pdf: bytes) -> int:
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


def test_the_summary_by_itself_is_one_page(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        page.evaluate("location.hash = 'one-page'")
        page.wait_for_function("document.documentElement.classList.contains('one-page')")
        assert page.locator(".card:visible").count() == 4
        assert page.locator("#paper:visible, #surge:visible, nav:visible").count() == 0
        page.screenshot(path=SHOTS / "one-page.png", full_page=True)
        pdf = page.pdf(path=SHOTS / "one-page.pdf", format="A4", prefer_css_page_size=True)
        assert pages(pdf) == 1


def test_a_link_to_the_tables_unfolds_them(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        table = page.get_by_text("Identified plants, as Table 5").first
        assert not table.is_visible()
        page.locator("nav a[href='#paper']").click()
        assert table.is_visible()


def test_a_stretch_of_a_log_is_zoomed_and_marked_as_a_trial(
    browser: Browser, report: Path
) -> None:
    logs = sorted((report.parent / "logs" / "surge-1").glob("*.csv"))
    look = report.parent / "look.html"
    run("plot", *logs, "--out", look)
    with Reader(browser, look) as page:
        chart = alive(page.locator("figure.chart").first)
        chart.locator(".panels").focus()
        page.keyboard.press("+")
        chart.get_by_role("button", name="Mark what is shown").click()
        entry = page.locator("#marks").inner_text()
        low, high = span(chart)
        assert f"from_s = {low:.1f}" in entry and f"to_s = {high:.1f}" in entry
        assert "thrusters.csv" in entry
        page.screenshot(path=SHOTS / "plot.png")
        chart.get_by_role("button", name="Forget the last mark").click()
        assert not page.locator("#marks").is_visible()


def test_pages_of_simulations_and_controllers_zoom(browser: Browser, report: Path) -> None:
    folder = report.parent / "made"
    motion = folder.parent / "motion.html"
    run("simulate", report.parent, "--step", "surge 200 N", "--for", "60", "--out", motion)
    run("control", report.parent, "--bandwidth", "surge 0.02 Hz", "--out", folder)
    for page_file in [motion, folder / "control.html"]:
        with Reader(browser, page_file) as page:
            chart = alive(page.locator("figure.chart").first)
            assert "axis" in chart.locator(".u-axis").first.get_attribute("class")
            before = span(chart)
            chart.locator(".panels").focus()
            page.keyboard.press("+")
            assert span(chart) != before
            page.screenshot(path=SHOTS / f"{page_file.stem}.png", full_page=True)


def test_a_day_at_ten_hertz_is_thinned_and_zoomed(browser: Browser, tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text('duration_s = 86400\nhold_out_s = 480\ndofs = ["surge"]\n')
    run("twin", spec, "--out", tmp_path / "log")
    campaign = tmp_path / "log" / "campaign.toml"
    run("identify", campaign, "--method", "equation-error", "--out", tmp_path / "found")
    report = tmp_path / "found" / "report.html"
    results = json.loads((tmp_path / "found" / "results.json").read_text())
    (trial,) = results["plants"]["surge"]["fit"]["by_trial"].values()
    assert trial["surge"]["samples"] == 864_001
    assert report.stat().st_size < 4e6
    with Reader(browser, report) as page:
        chart = alive(page.locator(MOTION).first)
        assert "Of every" in chart.locator("figcaption").inner_text()
        chart.locator(".panels").focus()
        whole = picture(chart)
        for _ in range(8):
            page.keyboard.press("+")
        low, high = span(chart)
        assert high - low == pytest.approx(86_400 / 256, rel=0.01)
        assert picture(chart) != whole


SIZES = {"laptop": (1366, 768), "desk": (1920, 1080), "phone": (390, 844)}


@pytest.mark.parametrize("size", SIZES)
def test_the_first_look(browser: Browser, report: Path, size: str) -> None:
    width, height = SIZES[size]
    with Reader(browser, report, viewport={"width": width, "height": height}) as page:
        page.screenshot(path=SHOTS / f"first-{size}.png")
        # No column is cut off, and nothing scrolls sideways but what is meant to.
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        cards = page.locator(".card")
        assert cards.count() == 4
        for card in cards.all():
            assert card.locator("svg path.simulated").count() == 1
            inside = card.evaluate("card => card.scrollWidth <= card.clientWidth")
            assert inside, card.inner_text()
        if size != "phone":
            boxes = [card.locator(".thumbnail").bounding_box() for card in cards.all()]
            assert all(box and box["y"] + box["height"] <= height for box in boxes), boxes
        # The contents stay in view.
        page.locator("#provenance").scroll_into_view_if_needed()
        nav = page.locator("nav").bounding_box()
        assert nav is not None and nav["y"] == 0.0


def test_paper_shows_motion_on_its_first_page(browser: Browser, report: Path) -> None:
    # A4 at 96 points to the inch, less margins of 15 mm.
    with Reader(browser, report, viewport={"width": 680, "height": 1009}) as page:
        page.emulate_media(media="print")
        page.screenshot(path=SHOTS / "print.png")
        boxes = [of.bounding_box() for of in page.locator(".thumbnail svg").all()]
        assert boxes and all(box and box["y"] + box["height"] < 1009 for box in boxes)
        pdf = page.pdf(path=SHOTS / "report.pdf", format="A4", prefer_css_page_size=True)
        assert pdf


def test_each_doubt_says_what_to_do(browser: Browser, report: Path) -> None:
    with Reader(browser, report) as page:
        doubts = page.locator("#summary .doubts > li")
        assert doubts.count() > 0
        for doubt in doubts.all():
            assert "What to do:" in (doubt.text_content() or "")
