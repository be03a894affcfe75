"""A TCP proxy that breaks connections at a byte that the test chose, either way, or one side of them only."""
import select
import socket
import struct
import threading


class CuttingProxy:
    """With `with`. One connection after the other; each breaks once the bytes of its cut have passed."""

    def __init__(self, port):
        self.target = port
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.lock = threading.Lock()
        self.cut = None  # (direction "up" or "down", bytes from now on, keep the server's side open)
        self.kept = []  # sockets of connections that the server takes for alive
        self.n_cuts = 0
        self.threads = []
        self.accepting = threading.Thread(target=self._accept)
        self.accepting.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.accepting.join()
        for sock in self.kept:
            sock.close()
        for thread in self.threads:
            thread.join()

    def arm(self, direction, n_bytes, half_open=False):
        """Whatever passes next is counted."""
        with self.lock:
            self.cut = (direction, n_bytes, half_open)

    def disarm(self):
        with self.lock:
            self.cut = None

    def _accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            thread = threading.Thread(target=self._serve, args=(client,))
            self.threads.append(thread)
            thread.start()

    def _admitted(self, direction, n):
        """(how many of n bytes may pass, the cut that comes then or None)"""
        with self.lock:
            if self.cut is None or self.cut[0] != direction:
                return n, None
            _, left, half_open = self.cut
            if n < left:
                self.cut = (direction, left - n, half_open)
                return n, None
            cut, self.cut = self.cut, None
            self.n_cuts += 1
            return left, cut

    def _serve(self, client):
        server = socket.create_connection(("127.0.0.1", self.target))
        for sock in (client, server):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while True:
            for sock in select.select([client, server], [], [])[0]:
                up = sock is client
                try:
                    data = sock.recv(65536)
                except OSError:
                    data = b""
                n, cut = self._admitted("up" if up else "down", len(data)) if data else (0, None)
                try:
                    (server if up else client).sendall(data[:n])
                except OSError:
                    data = b""
                if cut or not data:
                    self._end(client, server, cut)
                    return

    def _end(self, client, server, cut):
        # a reset, as when a line is cut: what waits is lost
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()
        if cut and cut[2]:
            self.kept.append(server)
        else:
            server.close()
