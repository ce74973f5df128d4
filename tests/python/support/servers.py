"""Servers to talk to: the real one, and one that answers what it is told to."""

import http.server
import os
import signal
import subprocess
import tempfile
import threading


class Relitd:
    """The real program with a data folder of its own; after restart() it is where it was."""

    def __init__(self, *flags):
        self._flags = flags
        self._folder = tempfile.TemporaryDirectory()
        self._port = 0
        self._start()

    @property
    def url(self):
        return f"http://127.0.0.1:{self._port}"

    def restart(self, number=signal.SIGKILL):
        self._process.send_signal(number)
        self._process.wait()
        self._process.stdout.close()
        self._start()

    def close(self):
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()
        self._folder.cleanup()

    def _start(self):
        command = [os.environ["RELITD"], "--port", str(self._port), "--data-dir", self._folder.name + "/data"]
        self._process = subprocess.Popen(
            [*command, *self._flags], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        words = self._process.stdout.readline()
        if "listens on" not in words:
            raise RuntimeError(f"relitd said {words!r}")
        self._port = int(words.rpartition(":")[2])


class Scripted:
    """Answers one reply after the other, (status, headers, body), and remembers what it was asked."""

    def __init__(self, *replies):
        self.requests = []  # (method, path, headers)
        left = list(replies)
        requests = self.requests

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def answer(self):
                self.rfile.read(int(self.headers.get("Content-Length", 0)))
                requests.append((self.command, self.path, dict(self.headers)))
                status, headers, body = left.pop(0)
                if status == 0:  # no answer at all
                    self.close_connection = True
                    return
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                promised = headers.get("Content-Length", len(body))
                if "Content-Length" not in headers:
                    self.send_header("Content-Length", str(promised))
                self.close_connection = promised != len(body)
                self.end_headers()
                self.wfile.write(body)

            do_GET = do_POST = do_DELETE = answer

            def log_message(self, *_):
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02})
        self._thread.start()

    @property
    def url(self):
        return f"http://127.0.0.1:{self._server.server_port}"

    def close(self):
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
