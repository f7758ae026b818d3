"""How the server's lines travel: over standard input and output, or as UDP datagrams on this machine."""

import socket
import threading
from typing import BinaryIO

from finlab.deploy.serve import MAX_LINE
from finlab.errors import FinlabError


class StandardStreams:
    """Requests from one stream, answers to another; the newest request wins."""

    def __init__(self, source: BinaryIO, sink: BinaryIO) -> None:
        """Start to read `source` in a thread of its own."""
        self._sink = sink
        self._news = threading.Condition()
        self._line: bytes | None = None
        self._ended = False
        threading.Thread(target=self._read, args=(source,), daemon=True).start()

    def newest(self, timeout: float | None) -> bytes | None:
        """See `Transport`."""
        with self._news:
            self._news.wait_for(lambda: self._line is not None or self._ended, timeout)
            line, self._line = self._line, None
            if line is None and self._ended:  # the end waits until the last request is answered
                raise EOFError
            return line

    def send(self, line: bytes) -> None:
        """See `Transport`."""
        self._sink.write(line)
        self._sink.flush()

    def _read(self, source: BinaryIO) -> None:
        while line := source.readline(MAX_LINE + 1):
            if line.strip():
                with self._news:
                    self._line = line
                    self._news.notify()
        with self._news:
            self._ended = True
            self._news.notify()


class LoopbackUdp:
    """Datagrams on 127.0.0.1; answers go to whoever sent last."""

    def __init__(self, port: int) -> None:
        """Listen on a port, for 0 on a free one; a `FinlabError` where the port is taken."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            raise FinlabError(f"cannot listen on 127.0.0.1:{port}: {error}") from None
        self.port = int(self._socket.getsockname()[1])
        self._sender: tuple[str, int] | None = None

    def newest(self, timeout: float | None) -> bytes | None:
        """See `Transport`."""
        self._socket.settimeout(timeout)
        try:
            line, self._sender = self._socket.recvfrom(MAX_LINE)  # no datagram is longer
        except (TimeoutError, BlockingIOError):  # the second where the time allowed was 0
            return None
        self._socket.setblocking(False)
        while True:
            try:
                line, self._sender = self._socket.recvfrom(MAX_LINE)
            except BlockingIOError:
                return line

    def send(self, line: bytes) -> None:
        """See `Transport`."""
        if self._sender is None:
            return
        try:
            self._socket.sendto(line, self._sender)
        except OSError:  # nobody there any more; the watchdog speaks to whoever comes next
            self._sender = None
