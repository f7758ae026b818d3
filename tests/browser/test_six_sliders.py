"""The site's page whose answers the core gives as WebAssembly, in a real browser beside the
library."""

import http.server
import shutil
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab

ROOT = Path(__file__).resolve().parents[2]
pytest.importorskip("mkdocs")
ROBOTS = "A", "catamaran"
"""Robots of the page that are asked."""
ANSWERS_SCRIPT = """async ([name, lost, wrenches, policy]) => {
  const { loadCore, prepare } = await import("./core.js");
  const robot = (await (await fetch("robots.json")).json()).find((each) => each.name === name);
  const block = new Float64Array(await (await fetch(`${name}.bin`)).arrayBuffer());
  const ask = prepare(await loadCore("finlab.wasm"), block, robot.actuators.length);
  return wrenches.map((wrench) => ask(wrench, policy, robot.groups, lost));
}"""
"""Script: answers of the page's core to wrenches, for a robot with losses and by a policy."""


@pytest.fixture(scope="module")
def six_sliders(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The page without the site's looks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools" / "site"))
        from demo import demo_files

    folder = tmp_path_factory.mktemp("demo")
    for name, content in demo_files(ROBOTS).items():
        (folder / name).write_bytes(content)
    for script in (ROOT / "docs" / "demo").glob("*.js"):
        shutil.copy(script, folder)
    page = (ROOT / "docs" / "demo" / "index.md").read_text().replace("---", "")
    (folder / "index.html").write_text(f'<meta charset="utf-8"><body class="md-typeset">{page}')
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_selector("#demo td")
        yield page
        page.close()
        server.shutdown()


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("lost", [-1, 1])
def test_the_browser_answers_as_the_library_does(six_sliders: Any, name: str, lost: int) -> None:
    layout = finlab.load_layout(name)
    names = [layout.names[lost]] if lost >= 0 else []
    allocator = finlab.Allocator(layout)
    rng = np.random.default_rng(5)
    wrenches = (
        rng.normal(size=(12, 6))
        * allocator.scale
        * np.tile([[0.3], [3.0]], (6, 1))
        * layout.commanded
    )
    for policy in ("closest", "direction", "priority"):
        answers = six_sliders.evaluate(ANSWERS_SCRIPT, [name, lost, wrenches.tolist(), policy])
        for wrench, answer in zip(wrenches, answers, strict=True):
            own = allocator.allocate(wrench, lost=names, policy=policy)
            missing = (own.wrench - answer["wrench"]) * layout.commanded / allocator.scale
            assert np.linalg.norm(missing) < 1e-6
            assert sum(power or 0.0 for power in answer["power"]) == pytest.approx(
                own.power, rel=1e-3
            )


def test_a_slider_and_a_lost_actuator_change_the_verdict(six_sliders: Any) -> None:
    six_sliders.select_option("[name=robot]", "A")
    six_sliders.wait_for_function(
        "document.querySelector('#demo th button').textContent === 'front_right'"
    )
    assert six_sliders.inner_text(".verdict").startswith("Exact. ")
    six_sliders.focus("input[aria-label^=Fx]")
    six_sliders.keyboard.press("End")
    assert six_sliders.inner_text(".verdict").startswith("Out of reach; missing Fx ")
    six_sliders.click("[name=rest]")
    six_sliders.click("th button >> nth=1")
    assert six_sliders.inner_text("tr >> nth=2").split()[:2] == ["front_left", "lost"]
