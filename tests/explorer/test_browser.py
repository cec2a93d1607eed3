"""The explorer in a real browser: dragged, slid, run, switched, on a desk and on a phone."""

import gzip
import io
import threading
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agents.explorer import FOLDER, make_server


@pytest.fixture(scope="module")
def address():
    with make_server(0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.fixture
def open_page(browser, address):
    """Open the explorer at a link's end; when done, nothing may have been complained about."""
    contexts, complaints = [], []

    def opened(hash="", size=(1280, 800), init="", missing="", **options):
        context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        page.add_init_script(init)
        page.on(
            "console",
            lambda message: (
                message.type not in ("error", "warning")
                or (missing and message.location["url"].endswith(missing))
                or complaints.append(message.text)
            ),
        )
        if missing:
            page.route(f"**/{missing}", not_found)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request",
            lambda request: (
                request.url.startswith((address, "data:", "blob:"))
                or complaints.append(f"a request to {request.url}")
            ),
        )
        page.goto(address + hash)
        page.wait_for_function("window.explorer?.pictures && !window.explorer.dirty")
        return page

    yield opened
    for context in contexts:
        context.close()
    # Software rendering, as on machines without a graphics card, tells of its slow read-backs.
    assert [text for text in complaints if "ReadPixels" not in text] == []


def not_found(route):
    route.fulfill(status=404, content_type="text/html", body="<!doctype html>not here")


def centre(page, selector):
    box = page.locator(selector).first.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def drag(page, start, end):
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    page.mouse.move(*end)
    page.mouse.up()


def drawn(page):
    """Return the picture in three dimensions, without what is written over it, as an array."""
    page.add_style_tag(content="#verdict, #scale { display: none }")
    page.wait_for_function("!window.explorer.dirty")
    shot = page.locator("#scene").screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def ball(page):
    """Return where the ball of the goal is on the page."""
    return page.evaluate(
        """() => {
            const { ball, camera, canvas } = window.explorer.pictures;
            const at = ball.position.clone().project(camera), box = canvas.getBoundingClientRect();
            return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
        }"""
    )


def colour_of_ball(page):
    x, y = ball(page)
    box = page.locator("#scene").bounding_box()
    return drawn(page)[round(y - box["y"]), round(x - box["x"])]


def bends(page):
    return page.evaluate("window.explorer.bends")


def moves(page):
    """Ask for another goal, or bend by hand where the hand moves it; wait until the tip follows."""
    tip = page.evaluate("window.explorer.physics.tip")
    if page.evaluate("window.explorer.mode") == "hand":
        page.locator("#disk .handle").first.press("ArrowRight")
    else:
        page.evaluate("window.explorer.anotherGoal()")
    page.wait_for_function(
        "(tip) => Math.hypot(...window.explorer.physics.tip.map((t, i) => t - tip[i])) > 0.001",
        arg=tip,
    )


def test_dragging_the_dot_bends_the_robot(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0")
    first = page.evaluate("performance.getEntriesByName('first picture')[0].startTime")
    print(f"first picture after {first:.0f} ms")
    assert first < 8_000  # 2 s where nothing else runs
    x, y = centre(page, "#disk .handle")
    drag(page, (x, y), (x + 60, y - 30))
    bx, by = bends(page)
    assert bx > 0.3
    assert abs(by / bx - 0.5) < 0.05
    drag(page, (x + 60, y - 30), (x + 900, y))  # as far as the limit, and no further
    assert abs(bends(page)[0] - 1.5708) < 1e-3
    assert "bent by 90°" in page.inner_text("#numbers")


def test_dragging_is_cheap_enough_for_sixty_frames(open_page):
    """What a frame computes; drawing itself is the graphics card's, which this machine may lack."""
    page = open_page("#robot=default3&n=32&mode=hand&c=2,2,4,4,6,6")
    spent = page.evaluate(
        """() => {
            const { explorer } = window, render = explorer.pictures.renderer.render;
            explorer.pictures.renderer.render = () => {};
            const start = performance.now();
            for (let k = 0; k < 60; k++) {
                explorer.bendByHand([0.01 * k, 0, 0.2, 0.1, 0.3, 0.2]);
                explorer.draw();
            }
            explorer.pictures.renderer.render = render;
            return (performance.now() - start) / 60;
        }"""
    )
    assert spent < 12.0, f"{spent:.1f} ms a frame"


def test_a_pulled_tendon_leaves_the_manifold_and_the_projector_takes_it_back(open_page):
    page = open_page("#robot=default&n=5&mode=hand&c=0,0")
    assert page.locator("#project").is_disabled()
    x, y = centre(page, "#ring .handle")
    drag(page, (x, y), (x + 20, y))
    pulled = page.evaluate("({off: window.explorer.wanted.off, c: window.explorer.wanted.clarke})")
    assert max(map(abs, pulled["off"])) > 1e-3
    # Of a pull p, 2 p / n is on the manifold and p (1 - 2 / n) of it is off.
    assert abs(pulled["c"][0] / pulled["off"][0] - (2 / 5) / (1 - 2 / 5)) < 1e-9
    shape = bends(page)
    page.click("#project")
    assert page.evaluate("window.explorer.wanted.off") is None
    assert bends(page) == shape


def test_sliding_n_changes_the_tendons_and_not_the_shape(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=8,4")
    shape = bends(page)
    for n in (3, 32, 11):
        page.locator("#n").fill(str(n))
        page.wait_for_function(f"window.explorer.robot.counts[0] === {n}")
        page.wait_for_function("!window.explorer.dirty")
        assert page.locator("#ring .handle").count() == n
        assert max(abs(a - b) for a, b in zip(bends(page), shape, strict=True)) < 1e-9
    assert "n=11" in page.evaluate("window.explorer.hash")


@pytest.mark.parametrize("n", [3, 11, 32])
def test_the_policy_reaches_the_goal_with_any_number_of_tendons(open_page, n):
    page = open_page(f"#robot=default&n={n}&mode=hand&c=0,0&goal=60,-50,170")
    assert not page.evaluate("window.explorer.reached")
    page.locator("input[value=policy]").check()
    page.wait_for_selector("#verdict.reached")
    assert (
        page.inner_text("#verdict") == f"Policy trained with 7 tendons, here with {n}: goal reached"
    )


def test_classical_control_runs_beside_the_policy(open_page):
    page = open_page("#robot=default&n=5&mode=policy&beside=1&c=0,0&goal=-80,40,160")
    page.wait_for_selector("#verdict.reached")
    page.wait_for_function(
        """() => {
            const { ghost, goal } = window.explorer;
            return Math.hypot(...ghost.physics.tip.map((t, i) => t - goal[i])) < 0.002;
        }"""
    )


def test_gravity_and_slack(open_page):
    page = open_page("#robot=default&n=4&mode=hand&c=9,0")
    straight = page.evaluate("window.explorer.physics.tip")
    page.locator("#gravity").check()
    page.wait_for_function("window.explorer.physics.tension")
    page.wait_for_timeout(1500)
    sagging = page.evaluate("window.explorer.physics.tip")
    assert 1e-5 < sum((a - b) ** 2 for a, b in zip(straight, sagging, strict=True)) ** 0.5 < 0.01
    assert min(page.evaluate("window.explorer.physics.tension.flat()")) > 0.0
    x, y = centre(page, "#ring .handle >> nth=1")
    drag(page, (x, y), (x, y + 40))  # pay one out: it and the one opposite hang loose
    page.wait_for_function("window.explorer.physics.tension.flat().includes(0)")
    page.wait_for_function("document.getElementById('numbers').innerText.includes('slack')")
    page.locator("input[value=policy]").check()
    page.wait_for_selector("#verdict.reached")


@pytest.mark.parametrize("way", ["mode=policy", "mode=classical", "mode=hand&gravity=1"])
def test_another_robot_is_chosen_while_this_one_moves(open_page, way):
    """By the list and by a link, with its policy still to be fetched and without."""
    page = open_page(f"#robot=default&n=7&{way}&c=0,0&goal=60,-50,170")
    held = []
    page.route("**/data/policy_*.json", lambda route: held.append(route))
    before = "default"
    for robot, listed, fetched in (
        ("default2", True, True),
        ("default", False, False),
        ("default3", False, True),
        ("soft_arm", True, False),
        ("default2", False, False),
        ("hardware", True, False),
    ):
        if listed:
            page.select_option("#robot", robot)
        else:
            page.evaluate("(hash) => { location.hash = hash; }", f"#robot={robot}&n=5&{way}")
        if fetched:
            page.wait_for_timeout(300)
            assert page.evaluate("window.explorer.robot.name") == before
            moves(page)  # until the other one is there
            held.pop().continue_()
        page.wait_for_function(f"window.explorer.robot.name === '{robot}'")
        moves(page)
        assert page.input_value("#robot") == robot
        before = robot


def test_what_is_asked_for_meanwhile_is_kept(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=8,4")
    held = []
    page.route("**/data/policy_*.json", lambda route: held.append(route))
    page.evaluate("location.hash = '#robot=default2&n=4&mode=hand&c=1,2,3,4'")
    page.wait_for_timeout(1600)  # a picture that rests so long is written into the address
    assert "robot=default2" in page.evaluate("location.hash")
    page.locator("#n").fill("6")
    page.locator("input[value=classical]").check()
    page.locator("#again").check()
    page.wait_for_timeout(100)
    assert page.evaluate("window.explorer.robot.counts") == [7]
    held.pop().continue_()
    page.wait_for_function("window.explorer.robot.name === 'default2'")
    held.pop().continue_()  # what was asked for first comes last
    page.wait_for_timeout(300)
    assert page.evaluate("window.explorer.robot.counts") == [6, 6]
    assert page.evaluate("[window.explorer.mode, window.explorer.again]") == ["classical", True]


def test_without_a_policy_the_rest_goes_on(open_page):
    page = open_page("#robot=default&n=7&mode=policy&c=0,0", missing="policy_default2.json")
    assert page.locator("#trouble").is_hidden()
    page.select_option("#robot", "default2")
    page.wait_for_selector("#trouble")
    assert "data/policy_default2.json" in page.inner_text("#trouble")
    assert page.locator("input[value=policy]").is_disabled()
    page.wait_for_selector("#verdict:has-text('Classical control: ')")
    moves(page)
    page.locator("input[value=hand]").check()
    moves(page)
    page.select_option("#robot", "default3")  # whose policy is there
    page.wait_for_selector("#trouble", state="hidden")
    page.locator("input[value=policy]").check()
    moves(page)
    page = open_page("#robot=default2&n=6&mode=policy", missing="policy_default2.json")
    assert "data/policy_default2.json" in page.inner_text("#trouble")
    moves(page)


def test_without_the_simulator_the_rest_goes_on(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0", missing="mujoco.wasm.gz")
    page.locator("#gravity").check()
    page.wait_for_selector("#trouble")
    assert "mujoco.wasm.gz" in page.inner_text("#trouble")
    assert not page.locator("#gravity").is_checked()
    moves(page)


def test_a_model_that_the_simulator_refuses_is_told_and_the_rest_goes_on(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0")
    page.evaluate("window.explorer.robots.default.mjcf = { folded: '<broken', whole: '<broken' }")
    page.locator("#gravity").check()
    page.wait_for_selector("#trouble")
    assert "MuJoCo cannot simulate this robot" in page.inner_text("#trouble")
    assert not page.locator("#gravity").is_checked()
    page.locator("#n").fill("5")
    page.wait_for_function("window.explorer.robot.counts[0] === 5")
    moves(page)


def test_a_page_that_cannot_start_says_why(browser, address):
    page = browser.new_page()
    page.goto((FOLDER / "index.html").as_uri())  # browsers load no module from a file
    told = page.inner_text("#trouble")
    assert "python train.py explore" in told
    assert "python -m http.server" in told
    for path in ("src/main.js", "vendor/three.min.js", "data/robots.json"):
        page.unroute_all()
        page.route(f"**/{path}", not_found)
        page.goto("about:blank")
        page.goto(address)
        page.wait_for_selector("#trouble")
        assert path in page.inner_text("#trouble") or path.endswith(".js")
    page.close()


@pytest.mark.parametrize("draw", ["canvas", "webgl"])
def test_the_goal_is_dragged_in_three_dimensions(open_page, draw):
    page = open_page(f"?draw={draw}#robot=default&n=7&mode=hand&c=0,0&goal=60,-50,170")
    place = ball(page)
    before = page.evaluate("window.explorer.goal")
    drag(page, place, (place[0] - 60, place[1]))
    after = page.evaluate("window.explorer.goal")
    assert max(abs(a - b) for a, b in zip(before, after, strict=True)) > 0.01
    tip = page.evaluate("window.explorer.goalBends")
    assert (tip[0] ** 2 + tip[1] ** 2) ** 0.5 <= 1.5709  # it can be reached
    page.wait_for_function("!window.explorer.dirty")
    assert abs(ball(page)[0] - place[0]) > 30  # and it is drawn where it went


@pytest.mark.parametrize("draw", ["canvas", "webgl"])
def test_the_goal_turns_green(open_page, draw):
    page = open_page(f"?draw={draw}#robot=default&n=7&mode=hand&c=0,0&goal=60,-50,170")
    red, green, _ = colour_of_ball(page)
    assert red > 1.5 * green
    page.locator("input[value=policy]").check()
    page.wait_for_selector("#verdict.reached", state="attached")
    page.locator("input[value=hand]").check()  # the picture rests
    red, green, _ = colour_of_ball(page)
    assert green > 1.5 * red


@pytest.mark.parametrize(
    "hash",
    [
        "#robot=default&n=7&mode=hand&c=8,4&goal=60,-50,170",
        "#robot=default&n=32&mode=hand&c=-9,12&goal=60,-50,170&view=50,60",
        "#robot=default3&n=5&mode=hand&c=12,3,24,6,30,12&goal=60,-50,170",
        "#robot=default3&n=32&mode=hand&c=12,3,4,6,-2,12&goal=60,-50,170&view=120,40",
        "#robot=default2&n=6&mode=hand&c=8,4,-6,10&goal=60,-50,170&view=50,-25",
    ],
)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_both_rasterisers_draw_the_same_picture(open_page, hash, scheme):
    pictures = []
    for draw in ("canvas", "webgl"):
        page = open_page(f"?draw={draw}{hash}", color_scheme=scheme)
        assert page.evaluate("window.explorer.pictures.canvas.dataset.drawn") == draw
        pictures.append(drawn(page))
    painted, rendered = pictures
    apart = np.abs(painted - rendered).max(axis=2)
    robot = np.abs(rendered - rendered[5, rendered.shape[1] // 2]).max(axis=2) > 60
    assert robot.mean() > 0.005  # there is something to see
    assert (apart > 60).sum() < 0.06 * robot.sum()  # edges, and gloss


def test_without_a_graphics_card_the_painter_draws(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=8,4")
    assert page.evaluate("window.explorer.pictures.canvas.dataset.drawn") == "canvas"


def test_without_webgl_all_is_there(open_page):
    """The browser of these tests has WebGL in software; here it has none."""
    page = open_page(
        "#robot=default&n=7&mode=hand&c=8,4",
        init="""const { getContext } = HTMLCanvasElement.prototype;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
            };""",
    )
    assert page.evaluate("window.explorer.pictures.canvas.dataset.drawn") == "canvas"
    assert len(np.unique(drawn(page).reshape(-1, 3), axis=0)) > 100


def test_in_a_shared_hole_the_tendon_that_ends_first_is_seen(open_page):
    seen = "window.explorer.pictures.strands.map(({ j, from, to }) => [j, from, to])"
    page = open_page("#robot=default3&n=6&mode=hand&c=0,0,0,0,0,0")
    stretches = page.evaluate(seen)
    assert stretches == [[j, j, j + 1] for j in range(3) for _ in range(6)]
    page = open_page("#robot=hardware&n=3&mode=hand&c=0,0,0,0,0,0")  # no hole is shared
    stretches = page.evaluate(seen)
    assert stretches == [[j, 0, j + 1] for j in range(3) for _ in range(3)]


def test_keys_alone_are_enough(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0")
    page.locator("#disk .handle").focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    assert abs(bends(page)[0] - 1.5708 * 5 / 33) < 1e-3
    page.keyboard.press("+")
    page.wait_for_function("window.explorer.robot.counts[0] === 8")
    goal = page.evaluate("window.explorer.goal")
    page.keyboard.press("g")
    assert page.evaluate("window.explorer.goal") != goal
    page.keyboard.press(" ")
    page.wait_for_selector("#verdict.reached")


def test_keys_go_on_after_a_click(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0&goal=60,-50,170")
    goal = page.evaluate("window.explorer.goal")
    for clicked in ("input[value=hand]", "#beside", "#again", "#random", "#theme"):
        page.evaluate("window.explorer.takeOver()")
        page.locator(clicked).click(force=True)
        page.keyboard.press("g")
        before, goal = goal, page.evaluate("window.explorer.goal")
        assert goal != before, clicked
    page.locator("input[value=classical]").click()
    page.keyboard.press(" ")
    assert page.evaluate("window.explorer.mode") == "hand"
    page.keyboard.press(" ")
    assert page.evaluate("window.explorer.mode") == "policy"
    page.focus("#again")  # a space is the button's or the box's own
    page.keyboard.press(" ")
    assert not page.locator("#again").is_checked()
    assert page.evaluate("window.explorer.mode") == "policy"


def test_an_emptied_field_keeps_the_goal(open_page):
    page = open_page("#robot=default&n=7&mode=hand&c=0,0&goal=60,-50,170")
    goal, field = page.evaluate("window.explorer.goal"), page.locator("#goal input").first
    shown = field.input_value()
    for leave in ("Tab", "Enter"):
        field.fill("")
        field.press(leave)
        assert page.evaluate("window.explorer.goal") == goal
        page.keyboard.press("Tab")
        page.wait_for_function(f"document.querySelector('#goal input').value === '{shown}'")
    field.fill("-60")
    field.press("Tab")
    assert page.evaluate("window.explorer.goal[0]") < 0


@pytest.mark.parametrize("gravity", ["", "&gravity=1"])
def test_handles_say_what_they_go_from_and_to(open_page, gravity):
    page = open_page(f"#robot=default2&n=5&mode=hand{gravity}&c=15,0,-15,4")
    page.locator("#ring .handle").first.focus()
    for _ in range(12):
        page.keyboard.press("Shift+ArrowUp")
    page.wait_for_function("!window.explorer.dirty || window.explorer.moves")
    values = page.evaluate(
        """[...document.querySelectorAll(".handle")].map((handle) =>
            ["min", "now", "max"].map((n) => Number(handle.getAttribute(`aria-value${n}`))))"""
    )
    assert len(values) == 7
    for least, now, most in values:
        assert least <= now <= most
        assert most > 0
    assert min(now for _, now, _ in values) < 0  # paid out


def test_a_link_holds_the_picture(open_page):
    page = open_page("#robot=default3&n=4&mode=hand&c=1,2,3,4,5,6&goal=100,50,250&view=20,30")
    link = page.evaluate("window.explorer.hash")
    again = open_page(link)
    assert again.evaluate("window.explorer.hash") == link
    for name in ("none", "constructor", "__proto__"):
        broken = open_page(f"#robot={name}&n=99&mode=magic&c=a,b&goal=1&view=x")
        assert broken.evaluate("window.explorer.key") == "default"


def test_the_view_stays_where_it_was_turned_to(open_page):
    page = open_page("#robot=default&n=5&view=20,30")
    turned = page.evaluate(
        "(window.explorer.pictures.look([70, 10]), window.explorer.pictures.view)"
    )
    page.evaluate("window.explorer.build({ n: 8 })")
    page.wait_for_function("window.explorer.robot.counts[0] === 8")
    assert page.evaluate("window.explorer.pictures.view") == pytest.approx(turned, abs=1e-6)


def test_a_phone_shows_all_without_scrolling_sideways(open_page):
    page = open_page("", size=(390, 844), has_touch=True, is_mobile=True, color_scheme="dark")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    page.locator("#disk .handle").scroll_into_view_if_needed()
    x, y = centre(page, "#disk .handle")
    before = bends(page)
    session = page.context.new_cdp_session(page)
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        ("touchMove", [{"x": x - 50, "y": y}]),
        ("touchEnd", []),
    ):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    page.wait_for_function(f"window.explorer.bends[0] < {before[0] - 0.2}")


def luminance(colour):
    parts = [int(x) / 255 for x in colour[colour.index("(") + 1 : -1].split(",")[:3]]
    linear = [x / 12.92 if x <= 0.03928 else ((x + 0.055) / 1.055) ** 2.4 for x in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out(open_page, scheme):
    page = open_page("", color_scheme=scheme)
    for selector in ("body", ".hint", "dt", ".off", "legend", "button"):
        text, ground = page.evaluate(
            """(selector) => {
                let element = document.querySelector(selector);
                const text = getComputedStyle(element).color;
                let ground = "rgba(0, 0, 0, 0)";
                while (ground === "rgba(0, 0, 0, 0)" && element) {
                    ground = getComputedStyle(element).backgroundColor;
                    element = element.parentElement;
                }
                return [text, ground];
            }""",
            selector,
        )
        bright, dim = sorted((luminance(text), luminance(ground)), reverse=True)
        assert (bright + 0.05) / (dim + 0.05) >= 4.5, (selector, text, ground)


def test_weight_before_the_simulator():
    lazy = {"mujoco.min.js", "mujoco.wasm.gz"}
    files = [
        path
        for path in FOLDER.rglob("*")
        if path.suffix in (".html", ".css", ".js", ".json")
        and "node_modules" not in path.parts
        and path.name not in lazy | {"package.json", "package-lock.json", "three.entry.js"}
    ]
    assert {"index.html", "main.js", "three.min.js", "robots.json"} <= {p.name for p in files}
    weight = sum(len(gzip.compress(Path(path).read_bytes())) for path in files)
    assert weight < 1.5e6, f"{weight / 1e6:.2f} MB"
