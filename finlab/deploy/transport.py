"""How the server's lines travel: over standard input and output, or as UDP datagrams on this machine."""

import queue
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
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        threading.Thread(target=self._read, args=(source,), daemon=True).start()

    def newest(self, timeout: float | None) -> bytes | None:
        """See `Transport`."""
        try:
            line = self._lines.get(timeout=timeout)
        except queue.Empty:
            return None
        while line is not None:
            try:
                following = self._lines.get_nowait()
            except queue.Empty:
                break
            if following is None:  # the end waits until the last request is answered
                self._lines.put(None)
                break
            line = following
        if line is None:
            raise EOFError
        return line

    def send(self, line: bytes) -> None:
        """See `Transport`."""
        self._sink.write(line)
        self._sink.flush()

    def _read(self, source: BinaryIO) -> None:
        while line := source.readline(MAX_LINE + 1):
            if line.strip():
                self._lines.put(line)
        self._lines.put(None)


class LoopbackUdp:
    """Datagrams on 127.0.0.1; answers go to whoever sent last."""

    def __init__(self, port: int) -> None:
        """Listen.

        Args:
            port: UDP port; 0 takes a free one.

        Raises:
            FinlabError: the port is taken.
        """
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
            line, self._sender = self._socket.recvfrom(MAX_LINE + 1)
        except (TimeoutError, BlockingIOError):  # the second where the time allowed was 0
            return None
        self._socket.setblocking(False)
        while True:
            try:
                line, self._sender = self._socket.recvfrom(MAX_LINE + 1)
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
