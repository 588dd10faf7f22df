"""A long connection. Passes on TCP data after a fixed time, and limits neither rate nor bytes under way.

osteon-impair cannot be used here: it holds 256 KiB of each direction, less than a fast long connection does."""
import queue
import socket
import threading
import time


class DelayLine:
    """Listens on a port that the system chooses, for connections to `target` (host, port)."""

    def __init__(self, target, one_way_s):
        self._target, self._one_way_s = target, one_way_s
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listening.getsockname()[1]}"
        self._start(self._accept)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._listening.close()

    @staticmethod
    def _start(what, *arguments):
        threading.Thread(target=what, args=arguments, daemon=True).start()

    def _accept(self):
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return  # it was closed
            far = socket.create_connection(self._target)
            for source, sink in ((near, far), (far, near)):
                sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                under_way = queue.SimpleQueue()
                self._start(self._read, source, under_way)
                self._start(self._write, sink, under_way)

    def _read(self, source, under_way):
        more = b"."
        while more:
            try:
                more = source.recv(1 << 18)
            except OSError:
                more = b""
            under_way.put((time.monotonic() + self._one_way_s, more))

    @staticmethod
    def _write(sink, under_way):
        while True:
            when, what = under_way.get()
            time.sleep(max(0.0, when - time.monotonic()))
            try:
                if not what:
                    sink.shutdown(socket.SHUT_WR)
                    return
                sink.sendall(what)
            except OSError:
                return
