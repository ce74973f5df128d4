"""clients/python/relit.py against the real server, and against one that does what a real one does seldom."""

import json
import os
import pathlib
import tarfile
import tempfile
import unittest
import unittest.mock
import zipfile

import relit
from support.servers import Relitd, Scripted

PLATO = pathlib.Path(__file__).parents[2] / "server/samples/plato.png"
PROBLEM = "application/problem+json"


def problem(status, code, detail, headers=None):
    body = json.dumps({"type": f"/problems/{code}", "title": "T", "status": status, "detail": detail})
    return status, {"Content-Type": PROBLEM, **(headers or {})}, body.encode()


def answer(value, status=200):
    return status, {"Content-Type": "application/json"}, json.dumps(value).encode()


class Keys(unittest.TestCase):
    key = "python-0123456789"

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        keys = pathlib.Path(folder.name, "keys")
        keys.touch(mode=0o600)
        keys.write_text(f"{self.key} render\n")
        self.relitd = Relitd(f"--api-keys={keys}")
        self.addCleanup(self.relitd.close)

    def client(self, **more):
        client = relit.Client(self.relitd.url, **more)
        self.addCleanup(client.close)
        return client

    def test_a_key_is_sent_with_every_request(self):
        client = self.client(api_key=self.key)
        relief = client.upload(PLATO)["id"]
        batch = client.submit(scenes=[{"height": {"image": relief}, "output": {"width": 24}}])
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(batch.save(folder), {})

    def test_it_may_come_from_the_environment(self):
        with unittest.mock.patch.dict(os.environ, RELIT_API_KEY=self.key):
            self.assertIn("presets", self.client().get("/v1/presets"))

    def test_without_one_the_refusal_says_so(self):
        with self.assertRaises(relit.Problem) as raised:
            self.client().get("/v1/presets")
        self.assertEqual((raised.exception.status, raised.exception.code), (401, "unauthorized"))


class WithServer(unittest.TestCase):
    flags = ()

    @classmethod
    def setUpClass(cls):
        cls.relitd = Relitd(*cls.flags)
        cls.addClassCleanup(cls.relitd.close)

    def setUp(self):
        self.client = relit.Client(self.relitd.url)
        self.addCleanup(self.client.close)
        self.relief = self.client.upload(PLATO)["id"]
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def scene(self, **fields):
        return {"height": {"image": self.relief}, "output": {"width": 24}, **fields}

    def orbit(self, count, **more):
        return self.client.submit(scene=self.scene(), sweep={"path": "orbit", "count": count, "elevation": 30}, **more)

    def files(self):
        return {path.name: path.read_bytes() for path in self.folder.iterdir()}


class Pictures(WithServer):
    def test_an_image_is_a_path_bytes_or_a_file(self):
        with open(PLATO, "rb") as file:
            for image in (str(PLATO), PLATO.read_bytes(), file):
                known = self.client.upload(image)
                self.assertEqual((known["id"], known["width"]), (self.relief, 512))

    def test_a_render_is_the_file_of_its_picture(self):
        picture = self.client.render(self.scene(preset="bronze"))
        self.assertEqual(picture[:8], b"\x89PNG\r\n\x1a\n")
        self.assertNotEqual(picture, self.client.render(self.scene()))

    def test_a_dry_run_fills_every_field_in(self):
        self.assertEqual(self.client.scene(self.scene())["material"]["depth"], 0.008)

    def test_a_refusal_is_a_problem_that_names_its_field(self):
        with self.assertRaises(relit.Problem) as refused:
            self.client.render(self.scene(material={"depth": 0}))
        told = refused.exception
        self.assertEqual((told.status, told.code, told.pointer), (422, "invalid-value", "/material/depth"))
        self.assertEqual(str(told), "'material.depth' must be a number above 0 and at most 10.")
        self.assertIsInstance(told, relit.RelitError)

    def test_numbers_that_are_none_are_not_sent(self):
        with self.assertRaises(ValueError):
            self.client.render(self.scene(relief=float("nan")))


class Batches(WithServer):
    def test_a_frame_is_what_render_makes_of_its_scene(self):
        batch = self.orbit(8)
        self.assertEqual(batch.wait()["done"], 8)
        sun = {"type": "directional", "azimuth": 45, "elevation": 30}
        self.assertEqual(batch.frame(2), self.client.render(self.scene(light=sun)))

    def test_all_three_ways_to_say_a_batch(self):
        patched = self.client.submit(scene=self.scene(), frames=[{"relief": 0.3}, {"name": "b.png"}])
        listed = self.client.submit(scenes=[self.scene(), self.scene(name="b.png")], priority=5)
        self.assertEqual(patched.save(self.folder), {})
        self.assertEqual(set(self.files()), {"0000.png", "b.png"})
        self.assertEqual(listed.wait()["priority"], 5)
        self.assertEqual(listed.frame(1), self.files()["b.png"])

    def test_progress_is_told_after_every_frame(self):
        told = []
        self.orbit(5).save(self.folder, progress=lambda *numbers: told.append(numbers))
        self.assertEqual(told, [(done, 0, 5) for done in range(1, 6)])
        self.assertEqual(len(self.files()), 5)

    def test_the_same_key_is_the_same_batch(self):
        one, again, other = self.orbit(2, key="a"), self.orbit(2, key="a"), self.orbit(2)
        self.assertEqual(one.id, again.id)
        self.assertNotEqual(one.id, other.id)
        with self.assertRaises(relit.Problem) as reused:
            self.orbit(3, key="a")
        self.assertEqual(reused.exception.status, 422)

    def test_saving_again_mends_what_is_missing_or_changed_and_touches_nothing_else(self):
        batch = self.orbit(4)
        batch.save(self.folder)
        whole = self.files()
        os.utime(self.folder / "0000.png", (1, 1))
        os.remove(self.folder / "0001.png")
        (self.folder / "0002.png").write_bytes(whole["0002.png"][:30])
        batch.save(self.folder)
        self.assertEqual(self.files(), whole)
        self.assertEqual((self.folder / "0000.png").stat().st_mtime, 1)

    def test_archives_hold_the_frames_under_their_names(self):
        batch = self.orbit(3)
        batch.save(self.folder)
        frames = self.files()
        for kind in ("tar", "zip"):
            batch.archive(self.folder / kind, kind)
        with tarfile.open(self.folder / "tar") as tar:
            self.assertEqual({name: tar.extractfile(name).read() for name in tar.getnames()}, frames)
        with zipfile.ZipFile(self.folder / "zip") as archive:
            self.assertEqual({name: archive.read(name) for name in archive.namelist()}, frames)

    def test_what_cannot_be_written_is_the_callers_error(self):
        with self.assertRaises(FileNotFoundError):
            self.orbit(1).archive(self.folder / "no folder" / "a.tar")

    def test_the_list_has_every_batch_once(self):
        ids = {self.orbit(1).id for _ in range(3)}
        listed = [batch["id"] for batch in self.client.batches()]
        self.assertEqual(len(listed), len(set(listed)))
        self.assertLessEqual(ids, set(listed))

    def test_a_deleted_batch_is_gone(self):
        batch = self.orbit(1)
        batch.delete()
        batch.delete()
        with self.assertRaises(relit.Problem) as gone:
            batch.status()
        self.assertEqual(gone.exception.code, "not-found")

    def test_events_are_whole_across_servers_that_are_killed(self):
        batch = self.client.submit(
            scene=self.scene(light={"type": "point"}, material={"illumination": "count"}),
            frames=[{"relief": 0.1 + 0.01 * number} for number in range(20)],
        )
        seen = []
        for event in batch.events():
            seen.append(event)
            if len(seen) in (3, 9):
                self.relitd.restart()
        self.assertEqual([event["id"] for event in seen], list(range(1, 22)))
        self.assertEqual(sorted(event["frame"] for event in seen[:-1]), list(range(20)))
        self.assertEqual((seen[-1]["event"], seen[-1]["done"]), ("end", 20))
        self.assertEqual(list(batch.events(after=21)), [])


class FramesThatFail(WithServer):
    flags = ("--batch-frame-timeout=1",)

    def test_are_told_by_name_and_rendered_again_on_request(self):
        slow = {"light": {"type": "point"}, "material": {"illumination": "count", "steps": 10000}, "output": None}
        batch = self.client.submit(scene=self.scene(), frames=[{}, slow, {}])
        failed = batch.save(self.folder)
        self.assertEqual(set(self.files()), {"0000.png", "0002.png"})
        self.assertEqual({name: told.code for name, told in failed.items()}, {"0001.png": "timed-out"})
        with self.assertRaises(relit.Problem) as told:
            batch.frame(1)
        self.assertEqual(told.exception.code, "timed-out")
        self.assertEqual(batch.retry()["failed"], 0)
        self.assertEqual(batch.wait()["failed"], 1)


class Trouble(unittest.TestCase):
    def client(self, *replies, **settings):
        self.server = Scripted(*replies)
        self.addCleanup(self.server.close)
        client = relit.Client(self.server.url + "/base", **settings)
        self.addCleanup(client.close)
        return client

    def test_busy_answers_and_none_are_asked_again_with_the_same_key(self):
        busy = problem(503, "queue-full", "All places are taken.", {"Retry-After": "1"})
        at_work = problem(409, "conflict", "A request with this Idempotency-Key is being worked on.")
        client = self.client(busy, (0, {}, b""), at_work, answer({"id": "b"}, 202))
        self.assertEqual(client.submit(scenes=[{}]).id, "b")
        self.assertEqual([request[:2] for request in self.server.requests], [("POST", "/base/v1/batches")] * 4)
        self.assertEqual(len({request[2]["Idempotency-Key"] for request in self.server.requests}), 1)

    def test_patience_has_an_end(self):
        client = self.client(*[problem(507, "storage-full", "There is no room left.")] * 2, retries=1)
        with self.assertRaises(relit.Problem) as full:
            client.render({})
        self.assertEqual((full.exception.code, len(self.server.requests)), ("storage-full", 2))

    def test_refusals_are_not_asked_again(self):
        client = self.client(problem(422, "invalid-value", "No."))
        with self.assertRaises(relit.Problem):
            client.render({})
        self.assertEqual(len(self.server.requests), 1)

    def test_what_is_no_relit_server_is_said_to_be_none(self):
        client = self.client((500, {"Content-Type": "text/html"}, b"<html>"))
        with self.assertRaisesRegex(relit.Unreachable, "answers 500, as no Relit server does"):
            client.get("/v1/presets")

    def test_no_server_is_unreachable(self):
        with self.assertRaisesRegex(relit.Unreachable, "refused"):
            relit.Client("http://127.0.0.1:1", retries=1).get("/v1/presets")
        with self.assertRaises(ValueError):
            relit.Client("relit.example.org")

    def test_names_of_frames_lead_nowhere_else(self):
        events = b'id: 1\nevent: frame\ndata: {"frame": 0, "name": "../a.png", "status": "done"}\n\n'
        client = self.client(answer({"total": 1}), (200, {"Content-Type": "text/event-stream"}, events))
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(relit.RelitError, "no name of a frame"):
            client.batch("b").save(folder)

    def test_an_archive_that_is_cut_is_fetched_again(self):
        cut = (200, {"Content-Type": "application/x-tar", "Content-Length": 9}, b"half")
        whole = (200, {"Content-Type": "application/x-tar"}, b"the whole")
        client = self.client(cut, whole)
        with tempfile.TemporaryDirectory() as folder:
            client.batch("b").archive(folder + "/a.tar")
            self.assertEqual(os.listdir(folder), ["a.tar"])
            self.assertEqual(pathlib.Path(folder, "a.tar").read_bytes(), b"the whole")


if __name__ == "__main__":
    unittest.main()
