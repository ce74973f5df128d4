"""A client of Relit servers: uploads, renders, batches. Python 3.9 or newer, nothing but its standard library.

    import relit

    client = relit.Client("http://127.0.0.1:8080")
    relief = client.upload("relief.png")["id"]
    picture = client.render({"height": {"image": relief}, "preset": "bronze"})

    batch = client.submit(scene={"height": {"image": relief}}, sweep={"path": "orbit", "count": 120})
    failed = batch.save("frames", progress=lambda done, failed, total: print(done, "of", total))

Everything that a call sends may be sent twice: images have their content's name, pictures are a function of their
scene, batches carry an Idempotency-Key. So what was not answered, or answered "later", is asked again by itself.
"""

import contextlib
import hashlib
import http.client
import json
import os
import random
import re
import secrets
import ssl
import threading
import time
import urllib.parse

__all__ = ["Batch", "Client", "Problem", "RelitError", "Unreachable"]

_LATER = frozenset({429, 502, 503, 507})  # 507: images in use make room when their renders are done
_FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]*")
_UNFINISHED = re.compile(r"\.relit-[0-9a-f]{16}")
_ABANDONED_S = 60.0


class RelitError(Exception):
    """What calls of this module raise."""


class Unreachable(RelitError):
    """No answer, or none that a Relit server gives, however often it was asked."""


class Problem(RelitError):
    """A refusal: a problem document (RFC 9457) as the server sent it.

    status   the HTTP status
    code     what is wrong, for programs: "invalid-value", "not-found", ...
    detail   what is wrong, a sentence
    pointer  the field to blame, an RFC 6901 pointer; empty where there is none
    """

    def __init__(self, status, code, detail, pointer=""):
        super().__init__(detail)
        self.status, self.code, self.detail, self.pointer = status, code, detail, pointer

    @classmethod
    def from_document(cls, document, status=0):
        detail = document.get("detail") or document.get("title") or f"status {status}"
        code = document.get("type", "").rpartition("/")[2]
        return cls(document.get("status", status), code, detail, document.get("pointer", ""))


class _Reply:
    def __init__(self, response):
        self.status = response.status
        self.headers = response.headers
        self.body = response.read()

    def json(self):
        return json.loads(self.body)


class Client:
    """One server. Safe from any thread: each has a connection of its own.

    url      http or https, host, maybe a port and a path that goes before every other
    api_key  for a server that asks for one; by default the environment variable RELIT_API_KEY
    timeout  seconds that the server may be silent
    retries  how often a request is repeated that was not answered, or answered "later"
    """

    def __init__(self, url="http://127.0.0.1:8080", *, api_key=None, timeout=120.0, retries=8):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
            raise ValueError(f"'{url}' is not http://host:port or https://host")
        self.url, self.timeout, self.retries = url, timeout, retries
        self._parts, self._folder = parts, parts.path.rstrip("/")
        key = api_key or os.environ.get("RELIT_API_KEY")
        self._headers = {"Authorization": f"Bearer {key}"} if key else {}
        self._local = threading.local()

    # --- Images and pictures ---

    def upload(self, image):
        """Stores an image: a path, bytes, or a binary file. Bytes that the server has are not sent again.

        Returns what is known of it: {"id", "width", "height", ...}.
        """
        data = _bytes_of(image)
        known = f"/v1/images/{hashlib.sha256(data).hexdigest()}"
        try:
            return self._request("GET", known).json()
        except Problem as problem:
            if problem.status != 404:
                raise
        return self._request("POST", "/v1/images", data, "application/octet-stream").json()

    def render(self, scene):
        """The picture of a scene, as the bytes of its file."""
        return self._post_json("/v1/render", scene).body

    def scene(self, scene):
        """A dry run: the scene with every field filled in. Refuses what render() would refuse."""
        return self._post_json("/v1/scene", scene).json()

    def get(self, path):
        """What GET answers, as JSON: get("/v1/presets"), get("/v1/capabilities")."""
        return self._request("GET", path).json()

    def close(self):
        """Closes this thread's connection; the next call opens another."""
        if getattr(self._local, "connection", None) is not None:
            self._local.connection.close()
            self._local.connection = None

    # --- Batches ---

    def submit(self, *, scene=None, frames=None, sweep=None, scenes=None, priority=None, key=None):
        """Submits a batch: `scene` with `frames` (merge patches) or with a `sweep`; or `scenes`.

        key  submitting the same again with the same key is the same batch, also for another process: for programs
             that are to go on where they were killed. Without one each call is a batch.
        Returns when the server holds it durably.
        """
        fields = {"scene": scene, "frames": frames, "sweep": sweep, "scenes": scenes, "priority": priority}
        body = {name: value for name, value in fields.items() if value is not None}
        headers = {"Idempotency-Key": key or secrets.token_hex(16)}
        # 409: the server is still at work on this key, which it was sent before.
        reply = self._post_json("/v1/batches", body, headers, later=_LATER | {409})
        return Batch(self, reply.json()["id"])

    def batch(self, batch_id):
        """A batch that was submitted before."""
        return Batch(self, batch_id)

    def batches(self):
        """What is known of all batches, newest first."""
        after = None
        while True:
            page = self.get("/v1/batches" + (f"?after={urllib.parse.quote(after)}" if after else ""))
            yield from page["batches"]
            after = page["next"]
            if not after:
                return

    # --- Requests ---

    def _post_json(self, path, value, headers=None, later=_LATER):
        body = json.dumps(value, allow_nan=False).encode()
        return self._request("POST", path, body, "application/json", headers, later)

    def _request(self, method, path, body=None, content_type=None, headers=None, later=_LATER):
        """A whole exchange, repeated where that helps. Raises Problem, Unreachable.

        later  statuses that may be others after a while
        """
        headers = {**(headers or {}), **({"Content-Type": content_type} if content_type else {})}
        return self._patiently(lambda: self._exchange(method, path, body, headers, later))

    def _patiently(self, work):
        for attempt in range(self.retries + 1):
            wait = min(0.25 * 2**attempt, 15.0) * random.uniform(0.8, 1.2)
            try:
                return work()
            except _Later as later:
                error = later.error
                wait = max(wait, later.after)
            except _Lost as lost:
                self.close()
                error = Unreachable(f"{self.url}: {lost}")
            if attempt < self.retries:
                time.sleep(wait)
        raise error

    def _exchange(self, method, path, body, headers, later):
        with _network():
            connection = self._connection()
            connection.request(method, self._folder + path, body, {**self._headers, **headers})
            reply = _Reply(connection.getresponse())
        _check(self.url, reply, later)
        return reply

    def _connection(self):
        if getattr(self._local, "connection", None) is None:
            self._local.connection = self._new_connection()
        return self._local.connection

    def _new_connection(self):
        host, port = self._parts.hostname, self._parts.port
        if self._parts.scheme == "http":
            return http.client.HTTPConnection(host, port, timeout=self.timeout)
        return http.client.HTTPSConnection(host, port, timeout=self.timeout, context=ssl.create_default_context())

    def _stream(self, path, headers):
        """A connection of its own and the reply's head; the caller closes the connection."""
        connection = self._new_connection()
        try:
            with _network():
                connection.request("GET", self._folder + path, headers={**self._headers, **headers})
                response = connection.getresponse()
                if response.status in (200, 204):
                    return connection, response
                reply = _Reply(response)
            _check(self.url, reply, _LATER)
            raise Unreachable(f"{self.url} answers {reply.status}, as no Relit server does")
        except BaseException:
            connection.close()
            raise


class Batch:
    """A batch on a server: its `id` is all that it takes to go on with it."""

    def __init__(self, client, batch_id):
        self.client, self.id = client, batch_id
        self._path = f"/v1/batches/{urllib.parse.quote(batch_id, safe='')}"

    def status(self):
        """{"status", "total", "done", "failed", "problems", ...}."""
        return self.client.get(self._path)

    def events(self, after=0):
        """What happens to it, from an event on until its end: dicts with `id`, `event` and what the server says.

        event "frame": {"frame", "name", "status": "done", "bytes"} or {..., "status": "failed", "problem"};
        event "end": {"status": "done" or "deleted", "total", "done", "failed"}, the last one.
        A stream that is cut is taken up behind the last event: none is missed, none comes twice.
        """
        failures = 0
        while True:
            try:
                connection, response = self.client._stream(self._path + "/events", {"Last-Event-ID": str(after)})
                try:
                    if response.status == 204:
                        return
                    for event in _events_in(response):
                        failures = 0
                        after = event.get("id", after)
                        yield event
                        if event["event"] == "end":
                            return
                finally:
                    connection.close()
                wait = 0.1  # a server that stops ends its streams
            except _Later as later:
                error, wait = later.error, max(later.after, 0.5)
            except _Lost as lost:
                error, wait = Unreachable(f"{self.client.url}: {lost}"), 0.25
            else:
                error = Unreachable(f"{self.client.url}: the events end again and again")
            failures += 1
            if failures > self.client.retries:
                raise error
            time.sleep(min(wait * 2 ** (failures - 1), 15.0))

    def wait(self, progress=None):
        """Returns what it came to, when every frame is done or failed.

        progress  told (done, failed, total) after every frame
        """
        list(self._counted_events(progress))
        return self.status()

    def frame(self, number):
        """One picture. Raises Problem: why it failed; `conflict` while it is not finished."""
        return self._frame(number).body

    def save(self, folder, progress=None):
        """Writes every picture into `folder` under its name, each as soon as it is done, whole or not at all.

        Pictures that are there already with the same bytes are left alone, so that a program that was killed may
        call it again. Returns the failures: {name: Problem}.
        progress  told (done, failed, total) after every frame
        """
        os.makedirs(folder, exist_ok=True)
        _remove_abandoned(folder)
        failed = {}
        for event in self._counted_events(progress):
            if event["status"] == "failed":
                failed[event["name"]] = Problem.from_document(event["problem"])
            else:
                failed.pop(event["name"], None)
                self._save_frame(event["frame"], folder, event["name"])
        return failed

    def archive(self, path, format="tar"):
        """Writes all pictures as one file, "tar" or "zip", when they are done; failures are in its problems.json."""

        def fetch():
            connection, response = self.client._stream(f"{self._path}/archive?format={format}", {})
            try:
                _write_whole(path, _pieces_of(response))
            finally:
                connection.close()

        self.client._patiently(fetch)

    def retry(self):
        """Has the failed frames rendered again. Returns its status."""
        return self.client._request("POST", self._path + "/retry").json()

    def delete(self):
        """Stops it and removes its pictures from the server; one that is gone already is none to complain about."""
        try:
            self.client._request("DELETE", self._path)
        except Problem as problem:
            if problem.status != 404:
                raise

    def _counted_events(self, progress):
        total = self.status()["total"]
        states, failed = {}, 0  # of each frame the last: one that was retried comes twice
        for event in self.events():
            if event["event"] == "end":
                if event["status"] != "done":
                    raise RelitError(f"batch {self.id} was removed from the server")
                return
            yield event
            if states.get(event["frame"]) == "failed":
                failed -= 1
            states[event["frame"]] = event["status"]
            failed += event["status"] == "failed"
            if progress:
                progress(len(states) - failed, failed, total)

    def _frame(self, number, headers=None):
        # A failed frame answers with its own problem, whatever its status: most are not to be asked again.
        path = f"{self._path}/frames/{number}"
        return self.client._request("GET", path, headers=headers, later=frozenset({502, 503}))

    def _save_frame(self, number, folder, name):
        if not _FILE_NAME.fullmatch(name):
            raise RelitError(f"{name!r} is no name of a frame")
        path = os.path.join(folder, name)
        headers = {}
        if os.path.exists(path):  # a frame's ETag is the SHA-256 of its bytes
            headers["If-None-Match"] = f'"{hashlib.sha256(_bytes_of(path)).hexdigest()}"'
        reply = self._frame(number, headers)
        if reply.status != 304:
            _write_whole(path, [reply.body])


class _Later(Exception):
    """An answer that may be another one after a while."""

    def __init__(self, error, after):
        super().__init__(str(error))
        self.error, self.after = error, after


class _Lost(Exception):
    """A connection that was refused or cut, or says what is no HTTP."""


@contextlib.contextmanager
def _network():
    try:
        yield
    except (OSError, http.client.HTTPException) as error:
        raise _Lost(str(error) or type(error).__name__) from error


def _check(url, reply, later):
    if reply.status < 300 or reply.status == 304:
        return
    if reply.headers.get("Content-Type", "").startswith("application/problem+json"):
        error = Problem.from_document(reply.json(), reply.status)
    else:
        error = Unreachable(f"{url} answers {reply.status}, as no Relit server does")
    if reply.status not in later:
        raise error
    after = reply.headers.get("Retry-After", "")
    raise _Later(error, float(after) if after.isdigit() else 0)


def _bytes_of(image):
    if isinstance(image, (bytes, bytearray, memoryview)):
        return bytes(image)
    if hasattr(image, "read"):
        return image.read()
    with open(image, "rb") as file:
        return file.read()


def _events_in(response):
    """Server-Sent Events as dicts; what is cut in the middle is none."""
    fields = {}
    while line := _read(response.readline):
        text = line.decode().rstrip("\r\n")
        if text:
            name, _, value = text.partition(":")
            fields[name] = value[1:] if value.startswith(" ") else value
            continue
        if "data" in fields:
            event = json.loads(fields["data"])
            event["event"] = fields.get("event", "message")
            if "id" in fields:
                event["id"] = int(fields["id"])
            yield event
        fields = {}


def _read(read, *size):
    with _network():
        return read(*size)


def _pieces_of(response):
    """A body to its end. Raises _Lost where it is cut short."""
    while piece := _read(response.read, 1 << 20):
        yield piece
    if response.length:
        raise _Lost(f"{response.length} bytes are missing at the end")


def _write_whole(path, pieces):
    path = os.fspath(path)
    unfinished = os.path.join(os.path.dirname(path), f".relit-{secrets.token_hex(8)}")
    try:
        with open(unfinished, "wb") as file:
            for piece in pieces:
                file.write(piece)
        os.replace(unfinished, path)
    except BaseException:
        if os.path.exists(unfinished):
            os.remove(unfinished)
        raise


def _remove_abandoned(folder):
    """Removes what a killed program left unfinished: nobody has written to it for a minute."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if _UNFINISHED.fullmatch(entry.name) and time.time() - entry.stat().st_mtime > _ABANDONED_S:
                os.remove(entry.path)
