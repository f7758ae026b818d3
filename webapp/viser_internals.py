"""Every use of viser's private parts (of 1.1.1): look here first when viser is upgraded."""

import viser
from viser import _messages


def disable_sharing(server: viser.ViserServer) -> None:
    """Nobody may open the public share tunnel: viser lets every connected page ask for it."""
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)


def disconnect_all(server: viser.ViserServer) -> None:
    """Drop every connection, as a bad network would; for tests."""
    server._websock_server.disconnect_all_clients()
