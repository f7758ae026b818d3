"""Files: open and save a layout, export the graph for deployment, copy the command line."""

import shlex
from functools import partial
from html import escape
from typing import Any

import viser

from finlab.assets import shipped_layouts
from webapp import files
from webapp.handles import on_user_click, put
from webapp.panels.host import Host
from webapp.shipped import shipped_name
from webapp.state import State


class TakeHomePanel:
    """Buttons for files, and the same question as a command."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._open = gui.add_upload_button(
            "Open a layout file", icon=viser.Icon.FOLDER_OPEN, mime_type=".yaml,.yml,.json"
        )
        self._save = gui.add_button("Save the layout", icon=viser.Icon.DOWNLOAD, hint="A YAML layout file.")
        self._export = gui.add_button(
            "Export the graph file", icon=viser.Icon.FILE_EXPORT, hint="For deployment on the robot."
        )
        self._candidates = gui.add_button("Save the candidates (CSV)", icon=viser.Icon.TABLE_EXPORT)
        self._html = gui.add_button(
            "Save the moving 3D view (HTML)", icon=viser.Icon.BRAND_HTML5, hint="One file."
        )
        self._picture = gui.add_button(
            "Save a picture (PNG)", icon=viser.Icon.PHOTO, hint="What the view shows."
        )
        on_user_click(self._html, partial(host.do, host.export_html))
        on_user_click(self._picture, host.export_picture)
        on_user_click(self._save, partial(host.do, self._send_layout))
        on_user_click(self._export, partial(host.do, host.export_graph))
        on_user_click(self._candidates, partial(host.do, self._send_candidates))
        self._command = gui.add_html("")

        @self._open.on_upload
        async def _opened(event: Any) -> None:
            upload = event.target.value
            host.do(lambda: host.session.open_layout(files.read_layout(upload.name, upload.content)))

    def _send_layout(self) -> None:
        layout = self._host.session.state.layout
        self._host.client.send_file_download(
            f"{files.file_stem(layout.name)}.yaml", files.layout_bytes(layout), save_immediately=True
        )
        self._host.session.note_saved()

    def _send_candidates(self) -> None:
        self._host.client.send_file_download(
            "candidates.csv", files.candidates_csv(self._host.answering.best), save_immediately=True
        )

    def refresh(self) -> None:
        """Write the command that asks the same question."""
        state = self._host.session.state
        known = shipped_name(state.layout)
        words = ["finlab", "allocate", known or f"{files.file_stem(state.layout.name)}.yaml", "--wrench"]
        words += [f"{value:g}" for value in state.target]
        for name in state.failed:
            words += ["--failed", name]
        if state.method != "learned":
            words += ["--method", state.method]
        shell, python = escape(shlex.join(words)), escape(_python(state, words[2]))
        put(
            self._command,
            content=f"<div class='fl'><span class='dim'>The same question on the command line:</span>"
            f"<pre class='command'>{shell}</pre><span class='dim'>And in Python:</span>"
            f"<pre class='command'>{python}</pre></div>",
        )


def _python(state: State, name: str) -> str:
    """The same question as lines of Python."""
    shipped = name in shipped_layouts()
    path = f"finlab.assets.shipped_layouts()[{name!r}]" if shipped else repr(name)
    method = "" if state.method == "learned" else f"method={state.method!r}"
    target = ", ".join(f"{value:g}" for value in state.target)
    failed = f", failed={list(state.failed)!r}" if state.failed else ""
    policy = "" if state.policy == "closest" else f", policy={state.policy!r}"
    return (
        f"import finlab{'.assets' if shipped else ''}\nlayout = finlab.load_layout({path})\n"
        f"result = finlab.load_allocator({method}).allocate(layout, [{target}]{failed}{policy})\n"
        "print(result.command, result.wrench)"
    )
