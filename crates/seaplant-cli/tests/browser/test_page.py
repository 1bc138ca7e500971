"""The page in a real browser: from a log to the same numbers as the program, with no request.

`scripts/page` builds it; SEAPLANT_PAGE names its folder. Screenshots are left in target/browser.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect, sync_playwright

CRATES = Path(__file__).parents[3]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR") or CRATES.parent / "target").absolute()
PROGRAM = Path(os.environ.get("SEAPLANT_PROGRAM") or TARGET / "debug" / "seaplant")
PAGE = Path(os.environ.get("SEAPLANT_PAGE") or TARGET / "web").absolute() / "index.html"
SHOTS = TARGET / "browser"

# Of the largest number in a list or of the number itself: both compute in 64 bits, but their
# libraries' exponentials and sines differ in the last bit, and filter error takes slopes from
# differences of costs. Estimates and their intervals agree to 1e-6.
TOLERANCE = 1e-5
# Of small differences of large numbers, which have lost most digits: the masses and drags that
# trials ask for, condition numbers, and the interval of a nuisance that the data do not tell, which is the
# exponential of many standard deviations. 3e-5 was seen.
COARSE = 1e-4
IS_COARSE = re.compile(
    r"\.(likely_)?change\.(mass|drag)\.|\.condition$|\.nuisances\.\w+\.(low|high)95$"
)
# Sizes with which such differences of numbers near 1 are compared if they are smaller: ratios of
# likelihoods in logarithms, and the part of the misfit that a change explains.
LEAST = {"likelihood_ratio": 1.0, "explained": 1e-3}
# What a fit in the page may take at most, ms.
PATIENCE = 600_000
# What a server sends at most, by gzip.
MOST_SENT = 5_000_000


def run(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run([PROGRAM, *arguments], cwd=cwd, capture_output=True, text=True)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        path = os.environ["SEAPLANT_BROWSER"]
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def served() -> Iterator[str]:
    """The address at which the program serves the page."""
    command = [PROGRAM, "--json", "page", PAGE, "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        said = ""
        for line in program.stdout:
            said += line
            if line == "}\n":
                break
        yield json.loads(said)["url"]
        program.terminate()


class User:
    """Someone who has the page open, and what the browser complained of and asked for."""

    def __init__(self, browser: Browser, address: str, **context: object) -> None:
        self.context = browser.new_context(accept_downloads=True, **context)  # type: ignore[arg-type]
        self.page = self.context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.context.on("request", lambda request: self.requests.append(request.url))
        self.address = address
        self.page.goto(address)

    def __enter__(self) -> Page:
        expect(self.page.locator("#message")).to_have_text("Ready.", timeout=60_000)
        return self.page

    def __exit__(self, *error: object) -> None:
        self.context.close()
        if error[0] is None:
            assert self.complaints == []
            asked = [url for url in self.requests if not url.startswith(("blob:", "about:"))]
            assert asked == [self.address]


RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


def assert_usable(page: Page) -> None:
    """No rule of accessibility is broken, and nothing is wider than the window."""
    checked = Axe().run(page, options={"runOnly": RULES, "iframes": False})
    broken = [
        f"{rule['id']}: {rule['help']}: {node['html']}"
        for rule in checked.response["violations"]
        for node in rule["nodes"]
    ]
    assert not broken, "\n".join(broken)
    overflow = page.evaluate("document.documentElement.scrollWidth - innerWidth")
    assert overflow <= 0, "the page is wider than the window"


def settled(page: Page, what: str) -> None:
    """Waits until a job is done well."""
    pattern = re.compile(rf"^{what}: (done|failed|stopped)")
    expect(page.locator("#message")).to_have_text(pattern, timeout=PATIENCE)
    assert page.locator("#error").inner_text() == ""


def downloaded(page: Page, button: str) -> bytes:
    with page.expect_download() as download:
        page.get_by_role("button", name=button).click()
    return Path(download.value.path()).read_bytes()


def differences(one: object, other: object, place: str, scale: float = 0.0) -> Iterator[str]:
    """Where two JSON values differ by more than they may."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            size = LEAST.get(key, 0.0)
            if key != "provenance":
                yield from differences(one[key], other[key], f"{place}.{key}", size)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        sizes = [abs(x) for x in one if isinstance(x, (int, float))]
        for k, pair in enumerate(zip(one, other)):
            yield from differences(*pair, f"{place}[{k}]", max(sizes, default=0.0))
    elif isinstance(one, float) and isinstance(other, float):
        tolerance = COARSE if IS_COARSE.search(place) else TOLERANCE
        if abs(one - other) > tolerance * max(abs(one), scale):
            yield f"{place}: {one!r} and {other!r}"
    elif one != other:
        yield f"{place}: {one!r} and {other!r}"


def assert_same(page: Page, expected: Path) -> None:
    """The page's numbers are those of the program."""
    found = json.loads(downloaded(page, "Download results.json"))
    wanted = json.loads(expected.read_text(encoding="utf-8"))
    different = list(differences(found, wanted, "results"))
    assert not different, "\n".join(different[:20])


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("demo")
    assert run("demo", "--out", "demo", cwd=folder).returncode == 0
    return folder / "demo"


def only_trials(campaign: Path, wanted: str) -> None:
    """Leaves the trials of a campaign whose names match."""
    parts = re.split(r"(?m)^(?=\[)", campaign.read_text(encoding="utf-8"))
    kept = [
        part
        for part in parts
        if not part.startswith("[[trial]]") or re.search(rf'name = "({wanted})"', part)
    ]
    campaign.write_text("".join(kept), encoding="utf-8")


def as_csv(demo: Path, folder: Path) -> None:
    made = shutil.ignore_patterns("figures", "tables", "series", "*.html", "*.json")
    shutil.copytree(demo, folder, ignore=made)


def by(script: str, *more: str) -> Callable[[Path, Path], None]:
    """Writes the demo's logs in another format."""

    def write(demo: Path, folder: Path) -> None:
        folder.mkdir()
        path = CRATES / "seaplant-cli/tests" / script
        subprocess.run([sys.executable, path, demo, folder, *more], check=True)

    return write


CONVERSIONS = {
    "csv": as_csv,
    "dataflash": by("reference/twin_to_dataflash.py"),
    "ulog": by("reference/twin_to_ulog.py"),
    "mcap": by("program/twin_as_mcap.py", "1000000000000"),
}


def test_the_demo_gives_the_programs_numbers(browser: Browser, served: str, demo: Path) -> None:
    with User(browser, served, viewport={"width": 1366, "height": 768}) as page:
        SHOTS.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=SHOTS / "page-start.png")
        assert_usable(page)
        page.get_by_role("button", name="Run the demo").click()
        settled(page, "Demo")
        assert_same(page, demo / "results.json")
        assert "surge by filter-error" in page.locator("#summary").inner_text()
        # The report's own scripts run within the page's policy.
        charts = page.frame_locator("#report iframe").locator("figure.chart")
        charts.first.scroll_into_view_if_needed()
        expect(charts.first).to_have_class(re.compile("live"))
        page.screenshot(path=SHOTS / "page-report.png")
        assert_usable(page)
        exports = zipfile.ZipFile(io.BytesIO(downloaded(page, "Download the exports")))
        assert exports.testzip() is None
        formats = {name.split("/")[1] for name in exports.namelist()}
        assert {"c", "python", "fmu", "json"} <= formats
        for name in [
            "exports/json/" + n.split("/")[-1] for n in exports.namelist() if "/json/" in n
        ]:
            json.loads(exports.read(name))
        everything = zipfile.ZipFile(io.BytesIO(downloaded(page, "Download everything")))
        assert everything.testzip() is None and "results/report.html" in everything.namelist()


@pytest.mark.parametrize("format_name", CONVERSIONS)
def test_a_campaign_gives_the_programs_numbers(
    browser: Browser, demo: Path, tmp_path: Path, format_name: str
) -> None:
    folder = tmp_path / "campaign"
    CONVERSIONS[format_name](demo, folder)
    only_trials(folder / "campaign.toml", "yaw.*")
    assert run("identify", "campaign.toml", cwd=folder).returncode == 0
    shutil.move(folder / "results", tmp_path / "results")
    expected = tmp_path / "results" / "results.json"
    with User(browser, PAGE.as_uri()) as page:
        page.locator("#folder").set_input_files(folder)
        expect(page.get_by_label("campaign.toml")).not_to_have_value("")
        page.get_by_role("button", name="Identify").click()
        settled(page, "Identifying")
        assert_same(page, expected)


# Inspects files with the page's program, each by itself; a reader that breaks leaves the page whole.
INSPECT = """async (files) => {
    const told = [];
    for (const [path, text] of files) {
        const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
        const job = { files: [{ path, file: new File([bytes], path) }], commands: [["inspect", "--json", path]] };
        const { results: [result] } = await program.run(job);
        told.push(result);
    }
    return told;
}"""


def test_damaged_logs_are_answered_as_by_the_program(browser: Browser, tmp_path: Path) -> None:
    corpus = CRATES / "seaplant-log/fuzz/corpus"
    logs = sorted(path for path in corpus.rglob("*") if path.is_file())
    names = [f"{k}-{path.parent.name}.log" for k, path in enumerate(logs)]
    for name, path in zip(names, logs):
        shutil.copy(path, tmp_path / name)
    files = [
        (name, base64.b64encode(path.read_bytes()).decode()) for name, path in zip(names, logs)
    ]
    with User(browser, PAGE.as_uri()) as page:
        told = page.evaluate(INSPECT, files)
    assert len(told) == len(logs) > 200
    for name, path, page_says in zip(names, logs, told):
        program_says = run("inspect", "--json", name, cwd=tmp_path)
        place = f"{path.parent.name}/{path.name}"
        if page_says.get("broken"):
            # A reader of others that panics: the page cannot go on after it, the program can.
            assert program_says.returncode == 1, place
            assert "panicked" in page_says["said"], place
            continue
        assert page_says["code"] == program_says.returncode, f"{place}: {page_says}"
        if program_says.returncode == 0:
            found, wanted = json.loads(page_says["printed"]), json.loads(program_says.stdout)
            different = list(differences(found, wanted, place))
            assert not different, "\n".join(different[:20])
        else:
            assert "error" in page_says["said"], place


MARKUP = "<img src=x onerror=document.title='run'>"


def test_names_with_markup_are_text(browser: Browser, tmp_path: Path) -> None:
    name = f"{MARKUP.replace('/', '')}.csv"
    rows = "\n".join(f"{k / 10},{k % 7},{k % 5}" for k in range(400))
    (tmp_path / name).write_text(
        f"time [s],{MARKUP} [rpm],</script><script>document.title='run'</script>\n{rows}\n"
    )
    with User(browser, PAGE.as_uri()) as page:
        page.locator("#files").set_input_files(tmp_path / name)
        settled(page, "Reading the logs")
        assert MARKUP in page.locator("#channels").inner_text()
        page.get_by_role("button", name="Draw these columns").click()
        settled(page, "Drawing")
        expect(
            page.frame_locator("#chart iframe").locator("figure.chart").first
        ).to_be_visible()
        page.get_by_role("button", name="Propose both files").press("Enter")
        settled(page, "Proposing")
        assert page.locator("img").count() == 0
        assert page.title() == "Seaplant: from log to verdict"


def test_a_log_becomes_trials_and_a_vehicle(browser: Browser, demo: Path) -> None:
    logs = sorted((demo / "logs" / "yaw-1").glob("*.csv"))
    with User(browser, PAGE.as_uri(), viewport={"width": 390, "height": 844}) as page:
        page.locator("#files").set_input_files(logs)
        settled(page, "Reading the logs")
        page.get_by_role("button", name="Draw these columns").click()
        settled(page, "Drawing")
        chart = page.frame_locator("#chart iframe")
        chart.locator("figure.chart").first.scroll_into_view_if_needed()
        chart.get_by_role("button", name="Mark").first.click()
        page.get_by_label("Axis of trial 1").select_option("yaw")
        assert_usable(page)
        page.get_by_label("Vehicle", exact=True).select_option("preset:bluerov2")
        # By the keyboard: the chart above is in a process of its own and takes clicks beside it
        # while the page scrolls.
        page.get_by_role("button", name="Propose both files").press("Enter")
        settled(page, "Proposing")
        page.get_by_role("button", name="Write them into").press("Enter")
        campaign = page.get_by_label("campaign.toml").input_value()
        assert campaign.count("[[trial]]") == 1 and 'dof = ["yaw"]' in campaign
        # The picture shows each thruster's way; a reversed one turns about.
        above = page.locator("#drawing svg").first
        expect(above.locator("g")).to_have_count(6)
        before = above.locator("g").first.text_content()
        page.get_by_label("Reversed").first.press("Space")
        expect(page.get_by_label("vehicle.toml")).to_have_value(
            re.compile(r"motor 1[\s\S]*reversed = true")
        )
        expect(above.locator("g").first).not_to_have_text(before)
        # What was written stays when the tab is closed.
        written = page.get_by_label("vehicle.toml").input_value()
        SHOTS.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=SHOTS / "page-390.png", full_page=True)
        assert page.evaluate("JSON.parse(localStorage.getItem('seaplant')).vehicle") == written
        assert_usable(page)


def focus_order(page: Page, most: int) -> list[str]:
    """What the tab key leads to, by name, until it leaves the page."""
    name = """() => {
        const at = document.activeElement;
        if (at === document.body || at.tagName === "IFRAME") return at.tagName;
        const { outlineStyle } = getComputedStyle(at);
        return `${at.id || at.dataset.save || at.textContent}${outlineStyle === "none" ? " unseen" : ""}`;
    }"""
    order: list[str] = []
    for _ in range(most):
        page.keyboard.press("Tab")
        order.append(page.evaluate(name))
        if order[-1] == "BODY":
            break
    return order


def test_every_control_is_reached_by_the_keyboard(browser: Browser, tmp_path: Path) -> None:
    rows = "\n".join(f"{k / 10},{k % 7},{k % 5}" for k in range(400))
    (tmp_path / "log.csv").write_text(f"time [s],u [m/s],thrust [N]\n{rows}\n")
    with User(browser, PAGE.as_uri()) as page:
        page.locator("#files").set_input_files(tmp_path / "log.csv")
        settled(page, "Reading the logs")
        page.evaluate("document.activeElement.blur(); scrollTo(0, 0)")
        order = focus_order(page, 60)
        visible = "[...document.querySelectorAll('button, input, select, textarea, [tabindex=\"0\"]')]"
        wanted = page.evaluate(
            f"{visible}.filter((e) => e.checkVisibility() && !e.disabled).length"
        )
        # The link that skips is one more, and the end of the page another.
        assert order[0] == "Skip to the logs" and order[-1] == "BODY"
        assert len(order) >= wanted, order
        assert not [name for name in order if "unseen" in name]
        steps = ["demo", "files", "folder", "look", "filter", "draw", "preset", "propose"]
        steps += ["vehicle", "campaign", "identify"]
        assert [name for name in order if name in steps and order.count(name) == 1] == [
            name for name in steps if order.count(name) == 1
        ]
        # Progress is read aloud where it begins and ends, and not every second.
        expect(page.get_by_role("status").first).to_have_text(
            re.compile("^Reading the logs: done")
        )


def test_a_fit_can_be_stopped_and_the_page_goes_on(browser: Browser) -> None:
    with User(browser, PAGE.as_uri()) as page:
        page.get_by_role("button", name="Run the demo").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("button", name="Stop")).to_be_visible()
        expect(page.locator("#message")).to_contain_text("fit ", timeout=60_000)
        page.get_by_role("button", name="Stop").press("Enter")
        expect(page.locator("#message")).to_have_text(re.compile("^Demo: stopped"))
        result = page.evaluate("program.run({ files: [], commands: [['--version']] })")
        assert result["results"][0]["printed"].startswith("seaplant")
        refused = page.evaluate(
            "program.run({ files: [], commands: [['export', 'none', '--to', 'none', '--out', 'x']] })"
        )
        # The page offers every format that there is.
        formats = re.search(r"possible values: (.+?)\]", refused["results"][0]["said"]).group(1)
        assert page.evaluate("FORMATS") == formats.split(", ")


def test_a_tab_that_is_closed_loses_nothing_that_was_written(
    browser: Browser, demo: Path
) -> None:
    context = browser.new_context()
    page = context.new_page()
    page.goto(PAGE.as_uri())
    page.locator("#files").set_input_files(
        [*sorted((demo / "logs" / "yaw-1").glob("*.csv")), demo / "vehicle.toml"]
    )
    settled(page, "Reading the logs")
    page.evaluate(
        """() => {
            marks = [{ dof: "yaw", role: "fit", from: 10, to: 400 }];
            showMarks();
            useMarks();
        }"""
    )
    written = page.get_by_label("campaign.toml").input_value()
    assert "to_s = 400" in written
    page.get_by_role("button", name="Identify").press("Enter")
    page.close(run_before_unload=False)
    again = context.new_page()
    again.goto(PAGE.as_uri())
    expect(again.get_by_label("campaign.toml")).to_have_value(written)
    expect(again.get_by_label("vehicle.toml")).to_have_value(
        (demo / "vehicle.toml").read_text()
    )
    expect(again.get_by_label("Axis of trial 1")).to_have_value("yaw")
    # Marks without the logs that they are on are kept, and said to lack them.
    again.get_by_role("button", name="Write them into").press("Enter")
    expect(again.get_by_role("alert")).to_contain_text("Choose the logs again")
    context.close()


def test_a_log_of_two_gigabytes_has_an_answer(browser: Browser, tmp_path: Path) -> None:
    """A line that does not end within what a browser gives a page; and the page goes on."""
    log = tmp_path / "huge.csv"
    rows = "".join(f"{k / 10:.1f},{k % 7 / 10:.4f},{k % 50:.2f}\n" for k in range(20_000))
    log.write_text(f"time [s],surge [m/s],thrust [N]\n{rows}")
    with log.open("r+b") as file:
        file.truncate(2_000_000_000)
    with User(browser, PAGE.as_uri()) as page:
        page.get_by_label("vehicle.toml").fill("name = 'kept'\n")
        page.locator("#files").set_input_files(log)
        message = page.locator("#message")
        expect(message).to_have_text(re.compile(": (done|failed)"), timeout=PATIENCE)
        said = page.get_by_role("alert").inner_text()
        assert "huge.csv" in said and "more memory than a browser gives" in said, said
        assert page.get_by_label("vehicle.toml").input_value() == "name = 'kept'\n"
        result = page.evaluate("program.run({ files: [], commands: [['--version']] })")
        assert result["results"][0]["printed"].startswith("seaplant")


def test_the_page_is_small_and_soon_there(browser: Browser, served: str) -> None:
    sent = len(gzip.compress(PAGE.read_bytes(), compresslevel=6))
    assert sent <= MOST_SENT, f"a server sends {sent} bytes"
    context = browser.new_context()
    page = context.new_page()
    start = time.monotonic()
    page.goto(served, wait_until="commit")
    page.get_by_role("button", name="Run the demo").wait_for()
    print(f"sent {sent} bytes; first view in {time.monotonic() - start:.2f} s")
    context.close()


VEHICLE = """name = 'sub' # mine
size_m = [
  1, 2, 3]

[[thruster]]
name = "motor 1"
# position_m = [x, y, z]  # measure
[thruster.curve]
kind = "estimate"
[[thruster]]
name = 'motor 10'
reversed = true
"""


def test_the_form_changes_one_line_and_leaves_the_rest(browser: Browser) -> None:
    def with_key(place: dict[str, str], key: str, value: str) -> str | None:
        with_key = "([text, place, key, value]) => withKey(text, place, key, value)"
        return page.evaluate(with_key, [VEHICLE, place, key, value])

    with User(browser, PAGE.as_uri()) as page:
        first = {"header": "[[thruster]]", "name": "motor 1"}
        hint, given = "# position_m = [x, y, z]  # measure", "position_m = [1, 2, 3]"
        assert with_key(first, "position_m", "[1, 2, 3]") == VEHICLE.replace(hint, given)
        tenth = {"header": "[[thruster]]", "name": "motor 10"}
        turned = VEHICLE.replace("reversed = true", "reversed = false")
        assert with_key(tenth, "reversed", "false") == turned
        # A value over several lines is for the user to change.
        assert with_key({}, "size_m", "[1, 1, 1]") is None
        added = with_key({"header": "[sensor.dvl]"}, "position_m", "[0, 0, 1]")
        assert added == f"{VEHICLE}\n[sensor.dvl]\nposition_m = [0, 0, 1]\n"
