"""What is put in place of viser's private parts gives what viser gives."""

import gzip
from urllib.request import Request, urlopen
from zipfile import ZipFile

import pytest
import viser
from viser import _icons

from webapp.viser_internals import start_server, stop_server


def test_icons_and_properties_are_viser_s_own_and_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    server = start_server()
    opened: list[str] = []
    begin = ZipFile.__init__

    def noted(self: ZipFile, file: object, *rest: object, **more: object) -> None:
        opened.append(str(file))
        begin(self, file, *rest, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(ZipFile, "__init__", noted)
    drawn = [
        _icons.svg_from_icon(icon) for icon in (viser.Icon.ANCHOR, viser.Icon.FISH, viser.Icon.SUBMARINE)
    ]
    assert len(opened) <= 1
    with ZipFile(_icons.ICONS_DIR / "tabler-icons.zip") as archive:
        names = ("anchor", "fish", "submarine")
        assert drawn == [archive.read(f"{name}.svg").decode() for name in names]
    box, sphere = server.scene.add_box("/box"), server.scene.add_icosphere("/sphere")
    box.dimensions, sphere.radius = (1.0, 2.0, 3.0), 0.5
    assert (box.dimensions, sphere.radius) == ((1.0, 2.0, 3.0), 0.5)
    assert "dimensions" not in sphere._prop_hints and "dimensions" in box._prop_hints
    stop_server(server)


def test_the_first_page_has_our_name_and_icon() -> None:
    server = start_server()
    for encoding in ("gzip", "identity"):
        request = Request(f"http://127.0.0.1:{server.get_port()}/", headers={"Accept-Encoding": encoding})
        with urlopen(request) as answer:
            body = answer.read()
            page = gzip.decompress(body) if answer.headers["Content-Encoding"] == "gzip" else body
        assert page.count(b"<title>") == 1 and b"<title>finlab</title>" in page
        assert page.count(b'rel="icon"') == 1
    stop_server(server)
