"""An orbit through the Python client into a folder, to be killed and called again.

Usage: sweep.py FOLDER COUNT URL
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[3] / "clients/python"))
import relit  # noqa: E402

folder, count, url = sys.argv[1:]
client = relit.Client(url)
plato = next(sample for sample in client.get("/v1/samples")["samples"] if sample["name"] == "plato")
batch = client.submit(
    scene={"height": {"image": plato["id"]}, "output": {"width": 96}},
    sweep={"path": "orbit", "count": int(count)},
    key=f"orbit-{count}",
)
failed = batch.save(folder)
if failed:
    sys.exit(f"failed: {failed}")
batch.delete()
