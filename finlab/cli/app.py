"""`finlab app`: serve the web app."""

from typing import Annotated

from tyro.conf import arg

_EXTRA = ("viser", "trimesh", "matplotlib")
"""What the extra `app` installs."""


def app(
    layout: Annotated[str, arg(metavar="LAYOUT")] = "ucat",
    checkpoint: Annotated[str, arg(metavar="NAME|FOLDER")] = "default",
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1",
    port: Annotated[int, arg(metavar="N")] = 8080,
) -> None:
    """Serve the web app until interrupted.

    Args:
        layout: layout to open first: a file or the name of a shipped one.
        checkpoint: trained checkpoint.
        host: address to listen on; the default is reachable from this machine only.
        port: port to listen on.
    """
    from finlab.errors import FinlabError

    try:
        from webapp.serving import serve
    except ModuleNotFoundError as error:
        if error.name not in _EXTRA:
            raise
        raise FinlabError(
            f"the web app needs {error.name!r}, which is not installed; run: pip install 'finlab[app]'"
        ) from error
    serve(host=host, port=port, layout=layout, checkpoint=checkpoint)
