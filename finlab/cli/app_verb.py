"""`finlab app`: the web app."""

from __future__ import annotations

import sys
from typing import Annotated

from tyro.conf import arg

from finlab.errors import FinlabError


def app(
    layout: Annotated[str | None, arg(metavar="LAYOUT")] = None,
    checkpoint: Annotated[str, arg(metavar="NAME|FOLDER")] = "default",
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1",
    port: Annotated[int, arg(metavar="N")] = 8080,
) -> None:
    """Serve the web app until interrupted.

    Args:
        layout: layout to open first: a file or the name of a shipped one; without it a start page
            offers several.
        checkpoint: trained checkpoint, of method mdn or paper.
        host: address to listen on; the default is reachable from this machine only.
        port: port to listen on.
    """
    from finlab.assets import install_command, shipped_folder

    # In a wheel it travels inside this package: an installation has no top-level package of so
    # plain a name.
    if (home := str(shipped_folder("webapp").parent)) not in sys.path:
        sys.path.insert(0, home)
    try:
        from webapp.serving import serve
    except ModuleNotFoundError as error:
        if str(error.name).split(".")[0] in ("finlab", "webapp"):
            raise
        command = install_command("app")
        raise FinlabError(
            f"the web app needs {error.name!r}, which is not installed; run: {command}"
        ) from error
    serve(host=host, port=port, layout=layout, checkpoint=checkpoint)
