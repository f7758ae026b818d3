"""Files: open and save a layout, export the graph for deployment, copy the command line."""

import shlex
from collections.abc import Callable
from html import escape
from typing import Any

import viser

from finlab.assets import shipped_layouts
from webapp import files
from webapp.handles import Changes, on_user_change, put
from webapp.panels.host import Host
from webapp.shipped import shipped_name
from webapp.state import State


class TakeHomePanel:
    """Buttons for files, and the same question as a command."""

    def __init__(self, gui: viser.GuiApi, host: Host) -> None:
        """Build the widgets."""
        self._host = host
        self._open = gui.add_upload_button(
            "Open a layout file",
            icon=viser.Icon.FOLDER_OPEN,
            mime_type=".yaml,.yml,.json",
            hint="A layout file (YAML or JSON) or a layout graph file.",
        )
        self._save = gui.add_button_group(
            "Save",
            ("Layout (YAML)", "Candidates (CSV)", "Picture (PNG)", "3D view (HTML)"),
            hint="The HTML page moves by itself and needs no server.",
        )
        on_user_change(self._save, self._press)
        self._robot = gui.add_button_group(
            "For the robot",
            ("Graph file", "Bundle (ZIP)"),
            hint="The layout graph alone, or with networks, README and checksums: what finlab export makes.",
        )
        on_user_change(self._robot, self._press)
        self._command = gui.add_html("")
        self._changes = Changes()

        @self._open.on_upload
        async def _opened(event: Any) -> None:
            upload = event.target.value
            host.do(lambda: host.session.open_layout(files.read_layout(upload.name, upload.content)))

    def _press(self, button: str) -> None:
        host = self._host
        acts: dict[str, Callable[[], object]] = {
            "Layout (YAML)": self._send_layout,
            "Candidates (CSV)": self._send_candidates,
            "Picture (PNG)": host.exports.picture,
            "3D view (HTML)": lambda: host.exports.html(host.shown),
            "Graph file": host.exports.graph,
            "Bundle (ZIP)": host.exports.bundle,
        }
        if button in acts:
            host.do(acts[button])

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
        if not self._changes(state):
            return
        known = shipped_name(state.layout)
        words = ["finlab", "allocate", known or f"{files.file_stem(state.layout.name)}.yaml", "--wrench"]
        words += [f"{value:g}" for value in state.target]
        for name in state.failed:
            words += ["--failed", name]
        if state.method != "learned":
            words += ["--method", state.method]
        export = ["finlab", "export", words[2], "-o", files.file_stem(state.layout.name), "--zip"]
        for name in state.failed:
            export += ["--failed", name]
        bundle = escape(shlex.join(export))
        shell, python = escape(shlex.join(words)), escape(_python(state, words[2]))
        put(
            self._command,
            content=f"<div class='fl'><span class='dim'>The same question on the command line:</span>"
            f"<pre class='command'>{shell}</pre><span class='dim'>And in Python:</span>"
            f"<pre class='command'>{python}</pre><span class='dim'>The bundle for the robot:</span>"
            f"<pre class='command'>{bundle}</pre></div>",
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
