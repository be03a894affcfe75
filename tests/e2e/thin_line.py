"""A line between a client and a daemon that brings so many bytes a second to the client, and no more."""
import socket
import threading
import time

PIECE = 1400  # bytes that go at once: a packet


class ThinLine:
    """with ThinLine(port, bytes_s) as line: a client connects to line.port. line.bytes_s may be changed at any time."""

    def __init__(self, port, bytes_s):
        self.upstream_port, self.bytes_s = port, bytes_s
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.sockets, self.threads = [self.listener], []
        self.lock = threading.Lock()
        self.closed = False  # guarded by lock, as sockets and threads are: nothing is added once it is set

    def __enter__(self):
        self._begin(self._accept)
        return self

    def __exit__(self, *_):
        with self.lock:
            self.closed = True
            for sock in self.sockets:
                try:
                    sock.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass  # it is closed, or was never connected
        for thread in self.threads:
            thread.join()
        for sock in self.sockets:
            sock.close()

    def _begin(self, what, *arguments):
        thread = threading.Thread(target=what, args=arguments)
        self.threads.append(thread)
        thread.start()

    def _accept(self):
        while True:
            try:
                client = self.listener.accept()[0]
            except OSError:
                return
            upstream = socket.socket()
            upstream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)  # what the line holds is little
            upstream.connect(("127.0.0.1", self.upstream_port))
            for sock in (client, upstream):
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self.lock:
                if self.closed:
                    client.close()
                    upstream.close()
                    return
                self.sockets += [client, upstream]
                self._begin(self._pass, client, upstream, False)
                self._begin(self._pass, upstream, client, True)

    def _pass(self, source, sink, thin):
        free_s = time.monotonic()
        try:
            while piece := source.recv(PIECE):
                if thin:  # a packet takes its time on the line
                    free_s = max(free_s, time.monotonic()) + len(piece) / self.bytes_s
                    time.sleep(max(0.0, free_s - time.monotonic()))
                sink.sendall(piece)
            sink.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # either end is gone
