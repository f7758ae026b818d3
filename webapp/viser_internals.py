"""Every use of viser's private parts (of 1.1.1), and its habits: look here first when viser is upgraded."""

import contextlib
import io

import viser
from viser import _messages


def start_server(host: str, port: int) -> viser.ViserServer:
    """A server that does not print a banner of its own; `verbose=False` alone leaves it."""
    with contextlib.redirect_stdout(io.StringIO()):
        return viser.ViserServer(host=host, port=port, label="finlab", verbose=False)


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server, silently."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def disable_sharing(server: viser.ViserServer) -> None:
    """Nobody may open the public share tunnel: viser lets every connected page ask for it."""
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)


def disconnect_all(server: viser.ViserServer) -> None:
    """Drop every connection, as a bad network would; for tests."""
    server._websock_server.disconnect_all_clients()
