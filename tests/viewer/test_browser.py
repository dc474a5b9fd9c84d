"""The page in a real browser: Chromium without a window, where one is installed."""

import shutil
import threading
import time

import pytest

from internav_data.viewer import ViewerServer, write_page

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None, reason="Chromium and its driver are not installed"
)
EPISODE = "#/episode/scene-000001/1"


@pytest.fixture(scope="module")
def address(viewed):
    with ViewerServer(viewed) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        yield server.url
        server.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def chromium():
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1600,1000"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture
def browser(chromium):
    """A browser at a blank page; whatever it complains about fails the test."""
    chromium.get("about:blank")
    chromium.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    yield chromium
    assert [entry for entry in chromium.get_log("browser") if entry["level"] != "INFO"] == []


def wait(browser, script, seconds=60):
    """Wait until a script returns something true, and return it."""
    end = time.monotonic() + seconds
    while not (found := browser.execute_script(f"return {script}")):
        assert time.monotonic() < end, script
        time.sleep(0.05)
    return found


def count(browser, selector):
    return browser.execute_script("return document.querySelectorAll(arguments[0]).length", selector)


def press(browser, *keys):
    from selenium.webdriver.common.action_chains import ActionChains

    chain = ActionChains(browser)
    for key in keys:
        chain.send_keys(key)
    chain.perform()


def opened(browser, url):
    browser.get(url)
    wait(browser, "document.querySelector('.transport') !== null")
    wait(browser, "document.querySelector('.screen img').naturalWidth > 0")


def shown(browser):
    return browser.execute_script("return document.querySelector('.caption b').textContent")


def test_the_gallery_shows_pictures_and_filters(browser, address):
    browser.get(address)
    wait(browser, "document.querySelector('.card img')?.naturalWidth > 0")
    wait(browser, "document.querySelector('#filter-mode-blocked') !== null")
    assert count(browser, ".card") == 24
    browser.find_element("id", "filter-mode-blocked").click()
    wait(browser, "location.hash.includes('mode=blocked')")
    wait(browser, "document.querySelector('.status').textContent.startsWith('24 episodes')")
    assert count(browser, ".chip.lengthened") == 0
    box = browser.find_element("id", "filter-distance-max")
    box.send_keys("5", "\ue007")
    wait(browser, "document.querySelectorAll('.card').length === 6")
    browser.back()
    wait(browser, "document.querySelectorAll('.card').length === 24")
    browser.find_element("css selector", ".clear").click()
    wait(browser, "document.querySelector('.status').textContent.startsWith('36 episodes')")
    assert browser.execute_script("return document.activeElement !== null")


def test_pages_turn_by_keys_and_episodes_open(browser, address):
    browser.get(address)
    wait(browser, "document.querySelectorAll('.card').length === 24")
    wait(browser, "document.querySelector('#filter-mode-blocked') !== null")
    press(browser, "j")
    wait(browser, "document.querySelectorAll('.card').length === 12")
    browser.find_element("css selector", ".card").click()
    wait(browser, "document.querySelector('.mapframe') !== null")
    wait(browser, "document.querySelector('.beside span')?.textContent === '25 of 36'")
    press(browser, "j")
    wait(browser, "document.querySelector('h1')?.textContent === 'scene-000001/0001'")
    press(browser, "\ue00c")
    wait(browser, "location.hash.startsWith('#/episodes')")


def test_the_expert_plays_and_steps_by_keys(browser, address):
    opened(browser, address + EPISODE)
    assert shown(browser) == "0/11"
    press(browser, "\ue014", "\ue014")
    wait(browser, "document.querySelector('.caption b').textContent === '2/11'")
    assert count(browser, ".agent .body") == 1
    press(browser, "\ue012")
    wait(browser, "document.querySelector('.caption b').textContent === '1/11'")
    press(browser, " ")
    wait(browser, "document.querySelector('.caption b').textContent === '4/11'")
    press(browser, " ")
    paused = shown(browser)
    time.sleep(0.6)
    assert shown(browser) == paused
    press(browser, "\ue010")
    wait(browser, "document.querySelector('.caption b').textContent === '11/11'")
    press(browser, "\ue011")
    wait(browser, "document.querySelector('.caption b').textContent === '0/11'")


def test_outcomes_show_on_focus_and_roll_when_pressed(browser, address):
    opened(browser, address + EPISODE)
    button = browser.find_element("css selector", "[data-action=push_east]")
    browser.execute_script("arguments[0].focus()", button)
    assert count(browser, ".effects .after.along") == 2
    assert count(browser, ".ghosts .ghost") == 3
    told = browser.find_element("css selector", ".told").text
    assert told.startswith(
        "push east: slides 1.20 m, takes 2 other objects along; the path is open"
    )
    press(browser, "\ue007")
    wait(browser, "document.querySelector('.screen.small img')?.naturalWidth === 320")
    wait(browser, "document.querySelectorAll('.effects .after.along').length === 2")


def test_hidden_attributes_stand_behind_their_switch(browser, address):
    opened(browser, address + EPISODE)
    text = "return document.querySelector('.obstacles').textContent"
    assert "71.50 kg" not in browser.execute_script(text)
    assert count(browser, ".map .obstacle.push") == 1
    press(browser, "p")
    assert "71.50 kg" in browser.execute_script(text)
    assert count(browser, ".map .obstacle.fixed") == 1
    press(browser, "p")
    assert "71.50 kg" not in browser.execute_script(text)


def test_statistics_stand_beside_table_2(browser, address):
    browser.get(address + "#/statistics")
    wait(browser, "document.querySelectorAll('.chart').length >= 12")
    assert "5.45" in browser.find_element("css selector", "table").text


def test_the_house_in_3d_draws(browser, address):
    opened(browser, address + EPISODE)
    browser.find_element("css selector", ".frame3d button").click()
    browser.switch_to.frame(browser.find_element("tag name", "iframe"))
    wait(browser, "document.querySelector('canvas') !== null && typeof controls === 'object'")
    browser.switch_to.default_content()
    # Where no graphics card is, Chromium tells of its own software renderer.
    browser.get_log("browser")


@pytest.mark.parametrize("width", [400, 1600])
@pytest.mark.parametrize("page", ["#/episodes", EPISODE, "#/statistics"])
def test_no_page_is_wider_than_the_screen(browser, address, page, width):
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(address + page)
    wait(browser, "document.querySelector('.card, .transport, .chart') !== null")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width


def test_everything_has_a_name_and_can_be_reached(browser, address):
    opened(browser, address + EPISODE)
    unnamed = browser.execute_script(
        """
        const kinds = 'button, a, input, select, iframe, [role=img], img';
        const named = (e) => e.textContent.trim() || e.ariaLabel || e.title || e.alt;
        return [...document.querySelectorAll(kinds)]
          .filter((e) => e.offsetParent !== null && !named(e) && !e.labels?.length)
          .map((e) => e.outerHTML);
        """
    )
    assert unnamed == []
    reached = set()
    for _ in range(40):
        press(browser, "\ue004")
        reached.add(browser.execute_script("return document.activeElement.outerHTML.slice(0, 400)"))
    assert any('data-action="push_east"' in each for each in reached)
    assert any("privileged" in each for each in reached)
    assert any('type="range"' in each for each in reached)


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("#/episode/scene-000001/99", "no episode scene-000001/0099"),
        ("#/episode/../../x", "an episode's address looks like"),
        ("#/nowhere", "there is no page #/nowhere"),
    ],
)
def test_what_is_wrong_stands_on_the_page(browser, address, page, words):
    browser.get(address + page)
    wait(browser, "document.querySelector('.failure') !== null")
    assert words in browser.find_element("css selector", ".failure").text
    browser.get_log("browser")  # the browser tells of the answer's status


def test_a_missing_picture_says_why_in_its_place(browser, address, viewed, monkeypatch):
    from internav_data.records.errors import CorruptDataError

    def damaged(*_):
        raise CorruptDataError("train-00000.parquet: expected 9 bytes, got 7 (truncated or edited)")

    monkeypatch.setattr(type(viewed), "thumbnail", damaged)
    browser.get(address + "?fresh#/episodes?distance=4.59-4.59")
    wait(browser, "document.querySelector('.shot .failure') !== null")
    assert "truncated or edited" in browser.find_element("css selector", ".shot").text
    assert count(browser, ".card") == 1
    browser.get_log("browser")


def test_the_single_file_works_without_a_server(browser, viewed, tmp_path):
    path = tmp_path / "page.html"
    write_page(viewed, path, 3)
    browser.get(path.as_uri())
    wait(browser, "document.querySelectorAll('.card img').length === 3")
    wait(browser, "document.querySelector('.card img').naturalWidth > 0")
    shown_of = "document.querySelector('.status').textContent"
    browser.get(f"{path.as_uri()}#/episodes?split=test")
    wait(browser, f"{shown_of}.startsWith('1 episode')")
    opened(browser, path.as_uri() + "#/episode/scene-000000/6")
    press(browser, "\ue010")
    wait(browser, "document.querySelector('.caption b').textContent === '11/11'")
    browser.find_element("css selector", ".frame3d button").click()
    wait(browser, "document.querySelector('iframe')?.srcdoc.length > 700000")
    browser.get_log("browser")  # the frame tells of Chromium's software renderer
    browser.get(path.as_uri() + "#/statistics")
    wait(browser, "document.querySelectorAll('.chart').length >= 12")
