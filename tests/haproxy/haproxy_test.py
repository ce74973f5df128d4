"""docker/haproxy.cfg: TLS, slow clients, idle ones, a queue, an address's share."""

import concurrent.futures
import http.client
import json
import os
import pathlib
import resource
import socket
import ssl
import subprocess
import tempfile
import time
import unittest

from support.servers import Relitd

ROOT = pathlib.Path(__file__).parents[2]
PLATO = ROOT / "server/samples/plato.png"
PLATO_ID = "c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908"
SCENE = json.dumps({"height": {"image": PLATO_ID}, "output": {"width": 32}})


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


class Haproxy:
    """HAProxy with the configuration that ships; `settings` are its variables."""

    def __init__(self, folder, server, **settings):
        self.port = free_port()
        certificate = pathlib.Path(folder, "relit.pem")
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
             "-addext", "subjectAltName=DNS:localhost", "-keyout", certificate, "-out", f"{certificate}.crt"],
            check=True, capture_output=True,
        )
        self.authority = f"{certificate}.crt"
        with open(certificate, "a", encoding="ascii") as file:
            file.write(pathlib.Path(self.authority).read_text(encoding="ascii"))
        variables = {
            "RELIT_BIND": f"127.0.0.1:{self.port}",
            "RELIT_SERVER": server.url.removeprefix("http://"),
            "RELIT_CERTIFICATE": str(certificate),
            "RELIT_ADDRESS_CONNECTIONS": "5000",
            "RELIT_ADDRESS_REQUESTS": "100000",
            **settings,
        }
        self._process = subprocess.Popen(
            ["haproxy", "-db", "-f", ROOT / "docker/haproxy.cfg"], env={**os.environ, **variables},
            stderr=subprocess.DEVNULL,
        )
        for _ in range(100):
            try:
                if self.get("/readyz")[0] == 200:
                    return
            except OSError:
                pass
            time.sleep(0.05)
        raise RuntimeError("haproxy does not answer")

    def close(self):
        self._process.kill()
        self._process.wait()

    def connection(self):
        context = ssl.create_default_context(cafile=self.authority)
        return http.client.HTTPSConnection("localhost", self.port, timeout=60, context=context)

    def ask(self, method, path, body=None):
        connection = self.connection()
        try:
            connection.request(method, path, body)
            reply = connection.getresponse()
            return reply.status, reply.headers, reply.read()
        finally:
            connection.close()

    def get(self, path):
        return self.ask("GET", path)

    def raw(self):
        context = ssl.create_default_context(cafile=self.authority)
        plain = socket.create_connection(("127.0.0.1", self.port), timeout=30)
        return context.wrap_socket(plain, server_hostname="localhost")


class BehindHaproxy(unittest.TestCase):
    def start(self, *flags, **settings):
        self.relitd = Relitd(*flags)
        self.addCleanup(self.relitd.close)
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        haproxy = Haproxy(folder.name, self.relitd, **settings)
        self.addCleanup(haproxy.close)
        return haproxy

    def test_what_it_passes_on_is_what_relitd_says(self):
        haproxy = self.start()
        status, headers, body = haproxy.ask("POST", "/v1/images", PLATO.read_bytes())
        self.assertIn(status, (200, 201))
        self.assertEqual(json.loads(body)["id"], PLATO_ID)
        status, headers, body = haproxy.ask("POST", "/v1/render", SCENE)
        self.assertEqual((status, headers["Content-Type"]), (200, "image/png"))
        self.assertIn("Strict-Transport-Security", headers)
        self.assertEqual(haproxy.get("/metrics")[0], 404)
        status, headers, _ = haproxy.get("/v1/nothing")
        self.assertEqual((status, headers["Content-Type"]), (404, "application/problem+json"))

    def test_three_hundred_slow_heads_are_given_up_and_keep_nobody_waiting(self):
        haproxy = self.start("--max-connections=64", RELIT_HEAD_TIMEOUT="2s", RELIT_SERVER_CONNECTIONS="50")
        slow = [haproxy.raw() for _ in range(300)]
        begin = time.monotonic()
        for client in slow:
            client.sendall(b"GET /v1/version HTTP/1.1\r\nHost: a\r\nX-Slow: ")
        self.assertEqual(haproxy.get("/v1/version")[0], 200)
        for client in slow:
            self.assertIn(client.recv(100)[:12], (b"HTTP/1.1 408", b""))
            client.close()
        self.assertLess(time.monotonic() - begin, 10)

    def test_two_thousand_idle_clients_cost_relitd_nothing(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        haproxy = self.start()
        idle = [socket.create_connection(("127.0.0.1", haproxy.port)) for _ in range(2000)]
        begin = time.monotonic()
        self.assertEqual(haproxy.ask("POST", "/v1/render", SCENE)[0], 200)
        self.assertLess(time.monotonic() - begin, 3)
        for client in idle:
            client.close()

    def test_more_than_relitd_takes_wait_and_none_fails(self):
        haproxy = self.start("--max-connections=16", RELIT_SERVER_CONNECTIONS="12")
        with concurrent.futures.ThreadPoolExecutor(128) as pool:
            replies = list(pool.map(lambda _: haproxy.ask("POST", "/v1/render", SCENE)[0], range(256)))
        self.assertEqual(replies, [200] * 256)

    def test_requests_that_could_be_read_twice_are_refused(self):
        haproxy = self.start()
        for framing in (b"Content-Length: 5\r\nContent-Length: 6\r\n", b"Content-Length: five\r\n",
                        b"Transfer-Encoding: gzip, chunked\r\nContent-Length: 5\r\n"):
            client = haproxy.raw()
            client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: a\r\n" + framing + b"\r\nGET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n")
            answer = b""
            while piece := client.recv(10000):
                answer += piece
            client.close()
            self.assertEqual(answer.count(b"HTTP/1.1 "), 1, answer)
            self.assertNotIn(b"HTTP/1.1 200", answer)

    def test_an_address_has_its_share(self):
        haproxy = self.start(RELIT_ADDRESS_REQUESTS="50")
        replies = [haproxy.get("/v1/version") for _ in range(70)]
        self.assertEqual(replies[0][0], 200)
        status, headers, _ = replies[-1]
        self.assertEqual((status, headers["Retry-After"]), (429, "10"))


if __name__ == "__main__":
    unittest.main()
