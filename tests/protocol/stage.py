"""What the tests of this folder share: a server with a bone, clients that end after each test, and triangles.

OSTEON_BIN: folder of the programs.
"""
import atexit
import collections
import contextlib
import functools
import json
import os
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import grpc

import wire
from client import Member, Session, Surface, room

BIN = Path(os.environ["OSTEON_BIN"])
HAPTIC, VIEWER, CONSOLE = (getattr(room, f"CLIENT_KIND_{name}") for name in ("HAPTIC", "VIEWER", "CONSOLE"))


class Server:
    """osteon-server with the case of its folder, or a phantom: a block of 20 x 20 x 10 mm whose upper face is z = 0."""

    def __init__(self, folder, *options, width=20, access=("--plain",)):
        self.folder, self.access = Path(folder), access
        self.case = self.folder / "case"
        if not self.case.exists():
            shutil.copytree(block(width), self.case)
        self.address_file = self.folder / "address"
        self.address_file.unlink(missing_ok=True)
        self.options = options
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [BIN / "osteon-server", "--case", self.case, "--listen", "127.0.0.1:0", "--address-file",
             self.address_file, "--summary", self.folder / "summary.json", *map(str, (*self.access, *self.options))],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        until = time.monotonic() + 60
        while not self.address_file.exists() or not self.address_file.read_text().endswith("\n"):
            if self.process.poll() is not None or time.monotonic() > until:
                self.process.kill()
                raise AssertionError(f"the server does not start: {self.process.communicate()[1]}")
            time.sleep(0.02)
        self.address = self.address_file.read_text().strip()

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
        said = self.process.communicate(timeout=60)[1]
        assert self.process.returncode == 0, said
        self.address_file.unlink(missing_ok=True)
        return json.loads((self.folder / "summary.json").read_text())


@functools.cache
def block(width):
    """The folder of a block's case, made once."""
    folder = tempfile.TemporaryDirectory(prefix="osteon-protocol-")
    atexit.register(folder.cleanup)
    case = Path(folder.name) / "case"
    run("osteon-import", "phantom", "block", "--layers", "5:1.9,5:0.3", "--width", width, "--out", case)
    return case


def run(program, *arguments):
    subprocess.run([BIN / program, *map(str, arguments)], check=True, capture_output=True, timeout=120)


def metal_case(folder):
    """Makes the case `folder`/case: a block of 12 x 12 x 9 mm whose middle layer, z from -6 to -3, is metal."""
    run("osteon-import", "phantom", "block", "--layers", "3:0.4,3:2,3:0.4", "--width", "12", "--out",
        folder / "phantom", "--dicom", folder / "scan")
    # No phantom has metal. A scan with twice the slope has: its middle layer is above 3000 HU then.
    slope = bytes.fromhex("28005310") + b"DS\x02\x00"
    for file in (folder / "scan").iterdir():
        data = file.read_bytes()
        assert data.count(slope + b"1 ") == 1
        file.write_bytes(data.replace(slope + b"1 ", slope + b"2 "))
    run("osteon-import", "ct", folder / "scan", "--out", folder / "case")


def stl_triangles(file):
    data = Path(file).read_bytes()
    count, = struct.unpack_from("<I", data, 80)
    assert len(data) == 84 + 50 * count
    for i in range(count):
        values = struct.unpack_from("<12f", data, 84 + 50 * i)
        yield tuple(values[3:6]), tuple(values[6:9]), tuple(values[9:12])


def turned(triangle):
    """The triangle from its smallest corner on, so that equal triangles are equal tuples."""
    first = triangle.index(min(triangle))
    return triangle[first:] + triangle[:first]


def bag(triangles):
    return collections.Counter(map(turned, triangles))


def open_edges(triangles):
    """Edges that the triangles do not cross equally often in both directions: none for a closed surface."""
    edges = collections.Counter()
    for a, b, c in triangles:
        for edge in ((a, b), (b, c), (c, a)):
            edges[edge] += 1
            edges[edge[::-1]] -= 1
    return [edge for edge, count in edges.items() if count]


def volume_mm3(triangles):
    return sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]) for a, b, c in triangles) / 6


class Case(unittest.TestCase):
    """A server, a haptic client and its session, all ended after each test."""
    WIDTH = 20  # mm
    DRAIN_S = 0  # how long a server that stops waits for its clients

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="osteon-protocol-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.prepare()
        self.server = Server(folder.name, "--drain-seconds", self.DRAIN_S, *self.options(), width=self.WIDTH,
                             access=self.access())
        self.addCleanup(lambda: self.server.process.poll() is None and self.server.stop())
        self.enter()

    def enter(self):
        self.hand, self.session = self.haptic("anna")
        self.burr = self.tool("burr-round-3.2")

    def prepare(self):
        """Makes what the server needs."""

    def options(self):
        return ()

    def access(self):
        return ("--plain",)

    def member(self, kind, name="", **options):
        member = Member(self.server.address, kind, name, **options)
        self.addCleanup(member.close)
        return member

    def haptic(self, name="", **options):
        member = self.member(HAPTIC, name, **options)
        session = Session(member)
        self.addCleanup(session.close)
        return member, session

    def tool(self, name):
        return next(h for h, tool in self.session.tools.items() if wire.tool_fields(tool.yaml)["name"] == name)

    def surface(self, room_seq=0):
        surface = Surface(self.member(VIEWER))
        self.addCleanup(surface.close)
        return surface.read_until(room_seq)

    def groove(self, session, count=4, y=0.0, **options):
        """Cuts along x that overlap, 1 mm deep. Returns the decisions."""
        cuts = []
        for i in range(count):
            path = [(-2 + i, y, -1.0), (-1 + i, y, -1.0)]
            cuts.append(session.send_cut(session.cut(self.burr, path, level=2, us=50000, **options)))
            time.sleep(0.05)  # the room gives a hand no more tool time than has passed
        return [session.decided(cut) for cut in cuts]

    def refusal(self, call):
        with self.assertRaises(grpc.RpcError) as caught:
            call()
        return caught.exception.code(), caught.exception.details()


def full(leaves):
    """{key: 512 values}: a leaf of one value stands for 512."""
    out = {}
    for key, values in leaves.items():
        numbers = struct.unpack(f"<{len(values) // 2}h", values)
        out[key] = numbers * 512 if len(numbers) == 1 else numbers
    return out


def until_cancelled(stream):
    with contextlib.suppress(grpc.RpcError):
        yield from stream


def flipped(data):
    return bytes([data[0] ^ 1]) + data[1:]
