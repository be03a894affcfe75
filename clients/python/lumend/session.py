"""A session with lumend: its scene is edited, its views are looked at, light is measured in it.

A thread of its own reads what the server sends: pings are answered and frames acknowledged while a program computes.
Methods may be called from any thread. Each waits at most `timeout_s`; what grows better while it waits (a picture, a
sensor) so long for each next step.
"""
import contextlib
import json
import os
import threading
import time
from typing import Callable, Sequence

from lumend.picture import Canvas, Picture, read_tile
from lumend.records import AddRecords, Transform
from lumend.websocket import TEXT, Disconnected, WebSocket


class Refused(Exception):
    """The server refused a request: the message says why, for people.

    code: stable (`not_found`, `invalid_value`, ...; section 2 of PROTOCOL.md). path: the member that is wrong, where one
    is. min, max: its limits, where it has some.
    """

    def __init__(self, method, error):
        super().__init__(f"{method}: {error.get('message')}")
        data = error.get("data", {})
        self.code, self.path = data.get("code"), data.get("path")
        self.min, self.max = data.get("min"), data.get("max")


class Edit(AddRecords):
    """Ops that are applied together, all or none. After the `with` that it came from, `scene_rev` is that of the edit."""

    def __init__(self) -> None:
        self.ops: list[dict] = []
        self.scene_rev: int | None = None

    def add(self, type: str, id: str, **fields) -> None:
        self.ops.append({"op": "add", "type": type, "id": id, **fields})

    def set(self, id: str, **fields) -> None:
        self.ops.append({"op": "set", "id": id, "path": "", "value": fields})

    def set_part(self, id: str, path: str, value) -> None:
        """A part of a field: set_part("key", "/position/1", 2.5)."""
        self.ops.append({"op": "set", "id": id, "path": path, "value": value})

    def remove(self, id: str) -> None:
        self.ops.append({"op": "remove", "id": id})

    def load(self, id: str, asset: str, transform: Transform | None = None) -> None:
        """A model file of the server's asset folder, as the import `id`: what it makes has ids below that."""
        self.ops.append({"op": "import", "id": id, "asset": asset, **({"transform": transform} if transform else {})})


class _Edits:
    def __init__(self, session, members):
        self._session, self._members, self._edit = session, members, Edit()

    def __enter__(self) -> Edit:
        return self._edit

    def __exit__(self, kind, value, traceback) -> None:
        if kind is None and self._edit.ops:
            self._edit.scene_rev = self._session.apply(self._edit.ops, **self._members)


def _record(op):
    if op["op"] == "set":  # of settings: they are always there
        return {"type": op["id"], **op["value"]}
    return {"type": op["op"], **{k: v for k, v in op.items() if k not in ("op", "id")}}  # an import has no other type


class Session:
    """`url`: as the server prints it. `client`: a name for people; `name` is what others know this session by.
    `project`: of a server with many scenes, the id of the one that this is about; default: that of `url?project=ID`. Without
    one such a server answers `project.list` and the like alone. `ca`: of an https URL, the file (PEM) of who signed the server's
    certificate; default: whom this machine trusts."""

    def __init__(self, url: str, client: str = "python", timeout_s: float = 60.0, project: str | None = None,
                 ca: str | None = None) -> None:
        self.timeout_s = timeout_s
        self._news = threading.Condition()  # all below is read and written with this held
        self._last_id, self._watching = 0, False
        self._waiting: set[int] = set()
        self._replies: dict[int, dict] = {}
        self._views: dict[int, View] = {}
        self._sensors: dict[str, dict] = {}
        self._broken = self._opening = None
        self.scene_rev = 0  # the newest that is known
        self._socket = WebSocket(url, timeout_s, ca)
        self._reader = threading.Thread(target=self._read, name="lumend", daemon=True)
        self._reader.start()
        try:
            given = {"token": self._socket.token, "project": project or self._socket.project}
            hello = self.call("session.hello", client=client, **{k: v for k, v in given.items() if v})
        except BaseException:
            self.close()
            raise
        self.name, self.limits, self.saved = hello["session"], hello["limits"], hello["saved"]
        self.project: dict | None = hello["project"]
        if hello["scene_rev"] is not None:
            self._rev_of(hello)

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, kind, value, traceback) -> None:
        self.close()

    def close(self) -> None:
        self._socket.shut()
        self._reader.join()

    # ---- messages ----

    def call(self, method: str, /, *, timeout_s: float | None = None, **params) -> dict:
        """Any request of PROTOCOL.md: its result. Raises Refused, Disconnected, TimeoutError."""
        with self._news:
            self._last_id += 1
            request = self._last_id
            self._waiting.add(request)
        try:
            self._send(method, params, id=request)
            reply = self._wait(lambda: self._replies.pop(request, None), f"no answer to {method}", timeout_s, lambda: self._opening)
        finally:
            with self._news:
                self._waiting.discard(request)
                self._replies.pop(request, None)
        if "error" in reply:
            raise Refused(method, reply["error"])
        return reply["result"]

    def _send(self, method, params, **request):
        message = {"jsonrpc": "2.0", "method": method, "params": params, **request}
        self._socket.send(json.dumps(message, allow_nan=False, separators=(",", ":")).encode())

    def _wait(self, ready, what, timeout_s=None, progress=lambda: None):
        """What `ready` returns once that is not None. The time begins anew whenever `progress` returns another object."""
        limit_s = self.timeout_s if timeout_s is None else timeout_s
        end_s, step = time.monotonic() + limit_s, None
        with self._news:
            while True:
                found = ready()
                if found is not None:
                    return found
                if self._broken:
                    raise Disconnected(str(self._broken), self._broken.code)
                if progress() is not step:
                    step, end_s = progress(), time.monotonic() + limit_s
                left_s = end_s - time.monotonic()
                if left_s <= 0:
                    raise TimeoutError(f"{what} within {limit_s:g} s")
                self._news.wait(left_s)

    def _read(self):
        try:
            while True:
                kind, message = self._socket.receive()
                if kind == TEXT:
                    self._take_text(json.loads(message))
                else:
                    self._take_tile(message)
        except Disconnected as error:
            broken = error
        except Exception as error:  # what is no message of lumend's: nothing after it can be trusted
            broken = Disconnected(f"the server sent what this client cannot read: {error}")
        with self._news:
            self._broken = broken
            self._news.notify_all()
        self._socket.close()

    def _take_text(self, message):
        with self._news:
            if "method" not in message:
                if message.get("id") in self._waiting:
                    self._replies[message["id"]] = message
            elif message["method"] == "scene.changed":
                self.scene_rev = max(self.scene_rev, message["params"]["scene_rev"])
            elif message["method"] == "project.opening":
                self._opening = message["params"]  # the answer to session.hello is on its way
            elif message["method"] == "sensors":
                for sensor in message["params"]["sensors"]:
                    self._sensors[sensor["id"]] = sensor
            elif message["method"] == "frame.stats":
                view = self._views.get(message["params"]["view_id"])
                if view:
                    view._stats[message["params"]["frame_seq"]] = message["params"]
            self._news.notify_all()

    def _take_tile(self, message):
        tile = read_tile(message)
        if not tile:
            return
        with self._news:
            view = self._views.setdefault(tile.view_id, View(self, tile.view_id))
            whole = view._take(tile)
            self._news.notify_all()
        if whole:
            self._send("frame.ack", {"view_id": tile.view_id, "frame_seq": tile.frame_seq})

    # ---- the scene ----

    def scene(self) -> dict[str, dict]:
        """Every record as it is now, by id: its `type` and fields, null where they are left out. Arrays in bulk are counts."""
        return {op["id"]: _record(op) for op in self.call("scene.get", expand=True)["ops"]}

    def ops(self) -> list[dict]:
        """The ops that rebuild the scene from nothing: one a line they are a scene file, after its header."""
        return self.call("scene.get", expand=False)["ops"]

    def save_scene(self, path: str | os.PathLike) -> None:
        """The scene with all edits, as a file that `lumend --scene` opens: `.jsonl`, lumend's own, or `.glb`, glTF with the lamps'
        photometry in it, for other programs, too. Until it is whole the file stands beside, as `path.part`."""
        kind, part = os.path.splitext(os.fspath(path))[1].lower(), f"{os.fspath(path)}.part"
        if kind not in (".jsonl", ".glb"):
            raise ValueError(f"{path}: scenes are saved as .jsonl or .glb")
        try:
            with open(part, "wb") as file:
                if kind == ".glb":
                    self._socket.fetch(self.call("scene.export")["get"], file)
                else:
                    for line in ({"lumend": 1, "kind": "scene"}, *self.ops()):
                        file.write(json.dumps(line, allow_nan=False, separators=(",", ":")).encode() + b"\n")
            os.replace(part, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.remove(part)
            raise

    def edit(self, **members) -> _Edits:
        """`with session.edit() as edit: edit.set("key", flux_lm=400)`: one transaction, applied at the end of the block.
        members: of scene.apply: undo_group, base_rev, op_id."""
        return _Edits(self, members)

    def apply(self, ops: list[dict], **members) -> int:
        """The revision of the scene that has these ops in it. Raises Refused, and the scene is as it was."""
        return self._rev_of(self.call("scene.apply", ops=ops, **members))

    def undo(self) -> int:
        return self._rev_of(self.call("scene.undo"))

    def redo(self) -> int:
        return self._rev_of(self.call("scene.redo"))

    def _rev_of(self, result):
        with self._news:
            self.scene_rev = max(self.scene_rev, result["scene_rev"])
        return result["scene_rev"]

    # ---- light ----

    def view(self, width: int, height: int, linear: bool = False, **members) -> "View":
        """A view, rendered until it is closed. linear: its pixels are in cd/m2. members: of view.open: camera, camera_id,
        method, spp, exposure_ev, effects, overlay, budget, solo ..."""
        codec = "half_deflate" if linear else "rgba8"
        view_id = self.call("view.open", size=[width, height], codec=codec, **members)["view_id"]
        with self._news:  # frames may be there already
            return self._views.setdefault(view_id, View(self, view_id))

    def probe(self, point: Sequence[float], normal: Sequence[float], samples: int = 4096) -> dict:
        """Illuminance there by path tracing: `illuminance_lx`, `stderr_lx` and what else PROTOCOL.md tells."""
        return self.call("probe", point=list(point), normal=list(normal), samples=samples)

    def report(self) -> str:
        """A page to print, as HTML: what the sensors show, pictures, luminaires. It takes a while."""
        return self.call("report.get", timeout_s=600)["html"]  # it measures, and takes pictures

    def sensor(self, id: str, enough: Callable[[dict], bool] = lambda value: value["settled"],
               timeout_s: float | None = None) -> dict:
        """What a sensor says of the scene as it is: the members of `sensors` in PROTOCOL.md, as soon as they are `enough`;
        when nothing else is said: as exact as they get. Raises Refused where there is no such sensor."""
        self.call("sensor.read", id=id)
        with self._news:
            rev, watching = self.scene_rev, self._watching
        if not watching:
            self.call("sensor.watch", on=True, points=True)
            with self._news:
                self._watching = True

        def known():
            value = self._sensors.get(id)
            return value if value and value["scene_rev"] >= rev and (value["settled"] or enough(value)) else None
        return self._wait(known, f"sensor {id} was not measured", timeout_s, lambda: self._sensors.get(id))


class View:
    """Of Session.view()."""

    def __init__(self, session, view_id):
        self.view_id = view_id
        self._session, self._canvas, self._stats, self._camera_seq, self._last = session, Canvas(), {}, 0, None

    def __enter__(self) -> "View":
        return self

    def __exit__(self, kind, value, traceback) -> None:
        self.close()

    def _take(self, tile):
        whole = self._canvas.take(tile)
        if whole:
            self._last = tile
            self._stats = {seq: stats for seq, stats in self._stats.items() if seq >= tile.frame_seq}
        return whole

    def picture(self, converged: bool = True, timeout_s: float | None = None) -> Picture:
        """The picture of the scene as it is, and of what update() asked for. converged: nothing more will come; else the
        first whole one, which may be rough (`stats["spp"]` 0)."""
        with self._session._news:
            rev, camera_seq = self._session.scene_rev, self._camera_seq

        def shown():
            tile = self._last
            if not tile or tile.scene_rev < rev or tile.camera_seq < camera_seq or (converged and not tile.flags & 4):
                return None
            return self._canvas.picture(tile.scene_rev, bool(tile.flags & 4), self._stats.get(tile.frame_seq, {}))
        return self._session._wait(shown, f"view {self.view_id} got no such picture", timeout_s, lambda: self._last)

    def update(self, **members) -> None:
        """Members of view.update: size, camera, method, effects, overlay ..."""
        with self._session._news:
            self._camera_seq += 1
            seq = self._camera_seq
        self._session.call("view.update", view_id=self.view_id, camera_seq=seq, **members)

    def read(self, x: int, y: int) -> dict:
        """What the picture has there: `value` in `unit`, cd/m2 or lx, and its `error`, each None where it is not known."""
        return self._session.call("view.read", view_id=self.view_id, x=x, y=y)

    def pick(self, x: int, y: int) -> dict:
        """What is under a pixel: `id` (None: nothing), `point`, `normal`, `distance`."""
        return self._session.call("pick", view_id=self.view_id, x=x, y=y)

    def close(self) -> None:
        self._session.call("view.close", view_id=self.view_id)
        with self._session._news:
            self._session._views.pop(self.view_id, None)
