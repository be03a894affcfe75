"""TLS for a line by which one thread reads while others send: Python's own sockets of TLS allow only one at a time."""
import io
import socket
import ssl
import threading

READ_BYTES = 65536


class TlsLine(io.RawIOBase):
    """`line`: a connected socket, which it takes over. `ca`: the file (PEM) of who signed the server's certificate; None:
    whom this machine trusts. Raises OSError, of which ssl's errors are, too."""

    def __init__(self, line: socket.socket, host: str, ca: str | None) -> None:
        super().__init__()
        self._line, self._came, self._to_go = line, ssl.MemoryBIO(), ssl.MemoryBIO()
        self._state = threading.Lock()    # of what is below, never held while the line is waited for
        self._sending = threading.Lock()  # what is made first goes first
        self._tls = ssl.create_default_context(cafile=ca).wrap_bio(self._came, self._to_go, server_hostname=host)
        while True:
            try:
                self._tls.do_handshake()
                break
            except ssl.SSLWantReadError:
                self._flush()
                self._more()
        self._flush()

    def readable(self) -> bool:
        return True

    def readinto(self, room) -> int:
        while True:
            try:
                with self._state:
                    return self._tls.read(len(room), room)
            except ssl.SSLWantReadError:
                self._more()
            except ssl.SSLEOFError:  # the server hung up without a word
                return 0

    def sendall(self, data: bytes) -> None:
        with self._sending:
            with self._state:
                self._tls.write(data)
                ready = self._to_go.read()
            self._line.sendall(ready)

    def shutdown(self, how: int) -> None:
        self._line.shutdown(how)

    def settimeout(self, seconds: float | None) -> None:
        self._line.settimeout(seconds)

    def close(self) -> None:
        self._line.close()
        super().close()

    def _more(self) -> None:
        data = self._line.recv(READ_BYTES)
        with self._state:
            self._came.write(data) if data else self._came.write_eof()

    def _flush(self) -> None:
        self._line.sendall(self._to_go.read())
