"""A client that was written from deploy/docs/protocol.md, against real servers. OSTEON_BIN: folder of the programs."""
import collections
import contextlib
import json
import os
import queue
import random
import socket
import sqlite3
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import grpc

import client
import wire
from client import CODES, FastPath, Member, Session, Surface, cutting, people, people_grpc, room, types, watch

BIN = Path(os.environ["OSTEON_BIN"])
HAPTIC, VIEWER, CONSOLE = (getattr(room, f"CLIENT_KIND_{name}") for name in ("HAPTIC", "VIEWER", "CONSOLE"))


class Server:
    """osteon-server with a phantom: a block of 20 x 20 x 10 mm whose upper face is z = 0."""

    def __init__(self, folder, *options, width=20):
        self.folder = Path(folder)
        self.case, self.journal, self.saved = (self.folder / n for n in ("case", "room.journal", "saved.vdb"))
        if not self.case.exists():
            run("osteon-import", "phantom", "block", "--layers", "5:1.9,5:0.3", "--width", width, "--out", self.case)
        self.address_file = self.folder / "address"
        self.address_file.unlink(missing_ok=True)
        self.options = options
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [BIN / "osteon-server", "--case", self.case, "--listen", "127.0.0.1:0", "--plain", "--address-file",
             self.address_file, "--summary", self.folder / "summary.json", *map(str, self.options)],
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


def run(program, *arguments):
    subprocess.run([BIN / program, *map(str, arguments)], check=True, capture_output=True, timeout=120)


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

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="osteon-protocol-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.server = Server(folder.name, *self.options(), width=self.WIDTH)
        self.addCleanup(lambda: self.server.process.poll() is None and self.server.stop())
        self.hand, self.session = self.haptic("anna")
        self.burr = self.tool("burr-round-3.2")

    def options(self):
        return ()

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


class TheSurface(Case):
    def options(self):
        return "--save", self.folder / "saved.vdb"

    def test_equals_what_the_importer_writes(self):
        run("osteon-import", "surface", self.server.case, "--out", self.folder / "bone.stl")
        triangles = self.surface().triangles()
        self.assertEqual(bag(triangles), bag(stl_triangles(self.folder / "bone.stl")))
        self.assertEqual(open_edges(triangles), [])
        self.assertAlmostEqual(volume_mm3(triangles), 20 * 20 * 10, delta=20)

    def test_follows_cuts(self):
        before = self.surface()
        decided = self.groove(self.session)
        self.assertEqual([d[0] for d in decided], ["cut"] * 4)
        after = before.read_until(decided[-1][1])
        saved = self.hand.rooms.SaveFields(room.SaveFieldsRequest(author=self.hand.author), timeout=20)
        self.assertEqual(saved.room_seq, decided[-1][1])
        run("osteon-import", "surface", self.server.case, "--fields", self.folder / "saved.vdb", "--out",
            self.folder / "cut.stl")
        self.assertEqual(bag(after.triangles()), bag(stl_triangles(self.folder / "cut.stl")))
        cut = [any(wire.decode_block(key[2:], payload, 1).cut) for key, payload in after.blocks.items()]
        self.assertIn(True, cut, "some vertices are on a cut face")
        self.assertIn(False, cut)
        summary = self.server.stop()
        self.assertEqual(after.hash().hex(), summary["mesh_hash"])


class TheCoarseSurface(Case):
    """Blocks of several levels: coarse ones, their covered groups, and seams between levels."""
    WIDTH = 120

    def options(self):
        return "--detail", "near"

    def test_is_closed_across_levels(self):
        stub = client.watch_grpc.WatchServiceStub(self.hand.channel)
        viewer = self.member(VIEWER)
        look = watch.ViewFrustum(eye_mm=types.Vector3(x=50, y=50, z=15), target_mm=types.Vector3(x=50, y=50, z=0),
                                 pixel_rad=0.01, view_rad=0.4)
        stream = stub.WatchMesh(watch.WatchMeshRequest(author=viewer.author, look=look), timeout=60)
        self.addCleanup(stream.cancel)
        messages = queue.Queue()
        threading.Thread(target=lambda: [messages.put(m) for m in until_cancelled(stream)], daemon=True).start()
        # The first surface is coarse. The server refines it where the viewer looks, and then sends nothing more.
        blocks, levels = {}, set()
        with contextlib.suppress(queue.Empty):
            while True:
                for block in messages.get(timeout=2 if len(levels) > 1 else 30).blocks:
                    blocks[(block.body, block.level, block.index.x, block.index.y, block.index.z)] = block.payload
                levels = {key[1] for key, payload in blocks.items() if payload}
        self.assertGreater(len(levels), 1, "the bone is drawn at several levels")
        self.assertTrue(any(payload and payload[0] & wire.SEAMS for payload in blocks.values()))
        triangles = []
        for (_, level, *index), payload in blocks.items():
            mesh = wire.decode_block(index, payload, viewer.joined.pitch_mm / 2.0 ** level)
            triangles += [tuple(mesh.positions[i] for i in triangle) for triangle in mesh.triangles]
        self.assertEqual(open_edges(triangles), [])
        self.assertAlmostEqual(volume_mm3(triangles), 120 * 120 * 10, delta=0.05 * 120 * 120 * 10)


class TheField(Case):
    def test_hashes_of_tools(self):
        self.assertGreaterEqual(len(self.session.tools), 24)
        for digest, tool in self.session.tools.items():
            self.assertEqual(wire.tool_hash(tool.yaml), digest, tool.yaml)

    def test_leaves_give_the_hash_that_the_room_says(self):
        decided = self.groove(self.session)
        _, late = self.haptic("ben")
        self.assertGreaterEqual(late.complete.room_seq, decided[-1][1])
        self.assertGreater(len(late.leaves), 1)
        self.assertEqual(wire.field_hash(full(late.leaves), self.hand.joined.pitch_mm), self.hand.status().field_hash)

    def test_undo_sends_leaves_that_take_the_cut_away(self):
        empty = wire.field_hash({}, self.hand.joined.pitch_mm)
        self.assertEqual(self.hand.status().field_hash, empty)
        first = self.groove(self.session, 1)[0]
        self.assertNotEqual(self.hand.status().field_hash, empty)
        undone = self.hand.rooms.Undo(room.UndoRequest(author=self.hand.author, count=1), timeout=20)
        self.assertEqual(list(undone.undone), [first[1]])
        self.session.wait(lambda: any(e[0] == "change" and e[3].last for e in self.session.events))
        change = next(e[3] for e in self.session.events if e[0] == "change")
        self.assertEqual((change.kind, change.room_seq), (cutting.BONE_CHANGE_KIND_UNDO, undone.room_seq))
        self.assertGreater(change.lease_epoch, self.hand.joined.lease_epoch)
        leaves = {(f.body, f.level, f.origin.x, f.origin.y, f.origin.z): f.values for f in change.leaves}
        self.assertEqual(wire.field_hash(full(leaves), self.hand.joined.pitch_mm), empty)
        self.assertEqual(self.hand.status().field_hash, empty)


def full(leaves):
    """{key: 512 values}: a leaf of one value stands for 512."""
    out = {}
    for key, values in leaves.items():
        numbers = struct.unpack(f"<{len(values) // 2}h", values)
        out[key] = numbers * 512 if len(numbers) == 1 else numbers
    return out


class Cutting(Case):
    def test_a_committed_cut_comes_to_all_as_it_was_sent(self):
        _, other = self.haptic("ben")
        sent = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -0.5), (0.5, 0, -0.5)]))
        decided = self.session.decided(sent)
        self.assertEqual(decided[0], "cut")
        other.wait(lambda: any(e[1] == decided[1] for e in other.events))
        seen = next(e for e in other.events if e[1] == decided[1])
        self.assertEqual(client.from_message(seen[3]), sent)

    def test_sequence_numbers_have_no_gap(self):
        self.groove(self.session)
        self.hand.rooms.Mark(room.MarkRequest(author=self.hand.author, label="here"), timeout=20)
        self.session.wait(lambda: any(e[0] == "noted" and e[3].mark == "here" for e in self.session.events))
        seqs = [e[1] for e in self.session.events]
        self.assertEqual(seqs, list(range(self.session.complete.room_seq + 1, seqs[-1] + 1)))

    def test_reasons(self):
        box, burr = self.hand.joined, self.burr
        far = (box.bounds_max_mm.x + 500, 0, 0)
        long = [(x, 0, 5) for x in (-8, 8) * 4]
        for code, path, options in (
                ("BODY", [(0, 0, 5)], {"body": 77}), ("LEASE", [(0, 0, 5)], {"lease": 0}),
                ("TOOL", [(0, 0, 5)], {"tool": self.tool("guide-2")}), ("PATH", [(0, 0, 5)] * 65, {}),
                ("PLACE", [far], {}),
                ("SWEEP", long, {}), ("SPINDLE", [(0, 0, 5)], {"rpm": 10 ** 6}),
                ("TIME", [(0, 0, 5)], {"us": 30 * 10 ** 6})):
            with self.subTest(code):
                options = dict(options)
                tool = options.pop("tool", burr)
                cut = self.session.send_cut(self.session.cut(tool, path, **options))
                decided = self.session.decided(cut)
                self.assertIsNotNone(decided, self.session.ended)
                self.assertEqual((decided[0], decided[3]), ("rejected", CODES[code]))
                self.assertEqual(self.session.lease, decided[4], "a rejection gives a new lease")
        self.assertEqual(self.groove(self.session, 1)[0][0], "cut", "the next cut is taken")

    def test_an_instructor_stops_a_hand(self):
        console = self.member(CONSOLE, "ada")
        stub = people_grpc.PeopleServiceStub(console.channel)

        def supervise(**restrictions):
            stub.Supervise(people.SuperviseRequest(author=console.author, subject=self.hand.author,
                                                   supervision=types.Restrictions(**restrictions)), timeout=20)
            self.session.wait(lambda: self.session.supervised == types.Restrictions(**restrictions))

        for code, restrictions in (("FROZEN", {"stopped": True}), ("TAKEN", {"taken_by": console.author}),
                                   ("FORBIDDEN_TOOL", {"tools": [self.tool("drill-3.2")]}),
                                   ("ZONE", {"zone": types.ZoneLimit(centre=[9000, 9000, 0], radius=100)})):
            with self.subTest(code):
                supervise(**restrictions)
                cut = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -0.5)]))
                self.assertEqual(self.session.decided(cut)[3], CODES[code])
        supervise()
        self.assertEqual(self.groove(self.session, 1)[0][0], "cut")

    def test_a_cut_that_comes_again_is_answered_with_its_first_decision(self):
        cut = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -0.5)]))
        first = self.session.decided(cut)
        self.session.send_cut(cut)
        self.session.wait(lambda: sum(e[2] == first[2] for e in self.session.events) == 2)
        self.assertEqual({e[1] for e in self.session.events if e[2] == first[2]}, {first[1]})
        self.assertEqual(self.hand.status().room_seq, first[1])

    def test_what_violates_the_protocol_ends_the_stream(self):
        turned_too_little = [types.QuantisedPose(position=[0, 0, 0], rotation=[0, 0, 0, 20000])]
        for change in ({"path": []}, {"path": turned_too_little}, {"author": 999}, {"tool_hash": b"short"},
                       {"level": 7}):
            with self.subTest(change):
                _, session = self.haptic()
                message = client.to_message(session.cut(self.burr, [(0, 0, 0)]))
                for name, value in change.items():
                    message.ClearField(name)
                    message.MergeFrom(types.Cut(**{name: value}))
                session.send(cutting.SessionRequest(cut=message))
                session.wait(lambda s=session: s.ended)
                self.assertEqual(session.ended.code(), grpc.StatusCode.INVALID_ARGUMENT, session.ended)


class Joining(Case):
    def options(self):
        return "--journal", self.folder / "room.journal"

    def test_versions(self):
        code, why = self.refusal(lambda: self.member(HAPTIC, version=2))
        self.assertEqual(code, grpc.StatusCode.FAILED_PRECONDITION)
        self.assertIn("version", why)
        code, _ = self.refusal(lambda: self.member(HAPTIC, kernel=client.KERNEL + 1))
        self.assertEqual(code, grpc.StatusCode.FAILED_PRECONDITION)
        self.member(VIEWER, kernel=0, version=3)

    def test_a_client_comes_back(self):
        decided = self.groove(self.session)
        durable = self.durable(decided[-1][1])
        again = self.member(HAPTIC, again=self.hand, durable=durable)
        self.assertEqual(again.author, self.hand.author)
        session = Session(again)
        self.addCleanup(session.close)
        self.assertEqual(session.complete.decided_author_seq, self.session.author_seq)
        self.assertEqual(list(session.complete.decided_room_seqs)[:4], [d[1] for d in decided])
        self.session.wait(lambda: self.session.ended)  # the new stream ends the old one
        self.assertEqual(self.groove(session, 1)[0][0], "cut")

    def test_what_a_client_says_of_durable_events_is_checked(self):
        seq, chain, seal = self.durable(self.groove(self.session, 1)[0][1])
        self.member(HAPTIC, again=self.hand, durable=(seq, chain, seal))
        for said in ((seq, flipped(chain), seal), (seq, flipped(chain), flipped(seal)), (seq + 100, chain, seal)):
            code, _ = self.refusal(lambda s=said: self.member(HAPTIC, again=self.hand, durable=s))
            self.assertEqual(code, grpc.StatusCode.INVALID_ARGUMENT)
        wrong = collections.namedtuple("Again", "author secret")(self.hand.author, flipped(self.hand.secret))
        code, _ = self.refusal(lambda: self.member(HAPTIC, again=wrong))
        self.assertEqual(code, grpc.StatusCode.INVALID_ARGUMENT)

    def test_a_room_that_has_lost_events_is_refused(self):
        self.server.stop()
        earlier = {file.name: file.read_bytes() for file in self.folder.glob("room.journal*")}
        self.server.start()
        self.hand, self.session = self.haptic("anna")
        durable = self.durable(self.groove(self.session, 1)[0][1])
        self.server.stop()
        for file in self.folder.glob("room.journal*"):
            file.unlink()
        for name, content in earlier.items():
            (self.folder / name).write_bytes(content)
        self.server.start()
        code, why = self.refusal(lambda: self.member(HAPTIC, again=self.hand, durable=durable))
        self.assertEqual(code, grpc.StatusCode.FAILED_PRECONDITION)
        self.assertIn(str(durable[0]), why)

    def test_the_chain_follows_from_the_journal(self):
        self.groove(self.session)
        self.session.send_cut(self.session.cut(self.burr, [(0, 0, 5)], body=77))
        self.hand.rooms.Mark(room.MarkRequest(author=self.hand.author, label="end"), timeout=20)
        self.groove(self.session, 1)
        told = [self.durable(self.session.events[-1][1])]
        _, late = self.haptic("ben")
        summary = self.server.stop()
        heads = self.chain_of(self.folder / "room.journal")
        for seq, chain, _ in told:
            self.assertEqual(heads[seq], chain)
        self.assertEqual(late.complete.room_seq, summary["room_seq"])

    def chain_of(self, file):
        """{sequence number: chain}, computed from the genesis and the entries."""
        with sqlite3.connect(file) as base:
            genesis, = base.execute("SELECT value FROM registers WHERE name = 'genesis'").fetchone()
            rows = base.execute("SELECT place, at_ns, bytes, chain FROM rows ORDER BY place").fetchall()
        read = client.journal.JournalGenesis.FromString(genesis)
        self.assertEqual(read.case_hash, self.hand.joined.case_hash)
        chain, heads, kinds = wire.first_chain(genesis), {}, []
        for seq, at_ns, entry, stored in rows:
            chain = wire.next_chain(chain, seq, at_ns, entry)
            self.assertEqual(chain, stored)
            heads[seq] = chain
            kinds.append(client.journal.JournalEntry.FromString(entry).WhichOneof("what"))
        self.assertEqual(kinds[:2], ["join", "cut"])
        self.assertIn("rejection", kinds)
        self.assertIn("mark", kinds)
        self.assertEqual([row[0] for row in rows], list(range(1, len(rows) + 1)))
        return heads

    def durable(self, seq):
        """What the server said to be durable, with that event in it. It says so with decided cuts."""
        until = time.monotonic() + 30
        while self.session.durable is None or self.session.durable.room_seq < seq:
            if time.monotonic() > until:
                raise AssertionError("nothing is durable")
            self.groove(self.session, 1, y=3.0)
        said = self.session.durable
        return said.room_seq, said.chain, said.seal


def until_cancelled(stream):
    with contextlib.suppress(grpc.RpcError):
        yield from stream


def flipped(data):
    return bytes([data[0] ^ 1]) + data[1:]


class Relay:
    """Passes datagrams on both ways, and loses, repeats and reorders them by a fixed seed."""

    def __init__(self, port, seed, loss=0.25):
        self._random, self._loss, self._to = random.Random(seed), loss, ("127.0.0.1", port)
        self._front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._front.bind(("127.0.0.1", 0))
        self._back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._back.bind(("127.0.0.1", 0))
        self.port, self._client, self._over = self._front.getsockname()[1], None, False
        self.lost = self.repeated = self.passed = 0
        self._held, self._lock = {}, threading.Lock()
        self._threads = [threading.Thread(target=self._pass, args=(way,), daemon=True) for way in ("up", "down")]
        for thread in self._threads:
            thread.start()

    def _pass(self, way):
        source = self._front if way == "up" else self._back
        source.settimeout(0.05)
        while not self._over:
            try:
                data, sender = source.recvfrom(2048)
            except (socket.timeout, ConnectionRefusedError):
                continue
            if way == "up":
                self._client = sender
            with self._lock:
                chance = self._random.random()
                if chance < self._loss:
                    self.lost += 1
                    continue
                out = [data]
                if chance > 0.9:
                    self.repeated += 1
                    out.append(data)
                if way in self._held:
                    out.append(self._held.pop(way))
                elif chance > 0.8:
                    self._held[way] = out.pop()
                self.passed += len(out)
            for one in out:
                if way == "up":
                    self._back.sendto(one, self._to)
                elif self._client:
                    self._front.sendto(one, self._client)

    def close(self):
        self._over = True
        for thread in self._threads:
            thread.join(10)
        self._front.close()
        self._back.close()


class Datagrams(Case):
    def open(self, session, port=None):
        path = FastPath(session, port)
        self.addCleanup(path.close)
        return path

    def cut_by(self, path, session, count, y=0.0):
        cuts = []
        for i in range(count):
            at = -4 + 8 * i / count
            cuts.append(path.send_cut(session.cut(self.burr, [(at, y, -0.5), (at + 0.3, y, -0.5)], us=20000)))
            time.sleep(0.025)
        return cuts

    def test_cuts_are_decided_without_the_stream(self):
        cuts = self.cut_by(self.open(self.session), self.session, 5)
        decided = [self.session.decided(cut) for cut in cuts]
        self.assertEqual([d[0] for d in decided], ["cut"] * 5)

    def test_others_read_the_cuts_from_datagrams(self):
        _, other = self.haptic("ben")
        path = self.open(other)
        cuts = self.cut_by(self.open(self.session), self.session, 20)
        self.session.decided(cuts[-1])
        other.wait(lambda: sum(e[0] == "cut" for e in other.events) == 20)
        self.assertEqual([client.from_message(e[3]) for e in other.events if e[0] == "cut"], cuts)
        self.assertGreater(path.entries, 10, "read from datagrams, not from the stream")

    def test_a_bad_network_changes_nothing(self):
        relay = Relay(self.session.offer.udp_port, seed=20)
        self.addCleanup(relay.close)
        _, other = self.haptic("ben")
        path = self.open(other, relay.port)
        cuts = self.cut_by(self.open(self.session, relay_of(self, self.session, 21)), self.session, 40)
        decided = [self.session.decided(cut) for cut in cuts]
        self.assertEqual([d[0] for d in decided], ["cut"] * 40)
        other.wait(lambda: sum(e[0] == "cut" for e in other.events) == 40)
        self.assertEqual([client.from_message(e[3]) for e in other.events if e[0] == "cut"], cuts)
        self.assertGreater(relay.lost, 10)
        self.assertGreater(relay.repeated, 2)
        self.assertGreater(path.entries, 10)
        _, late = self.haptic()
        self.assertEqual(wire.field_hash(full(late.leaves), self.hand.joined.pitch_mm), self.hand.status().field_hash)

    def test_a_changed_bit_is_not_opened(self):
        offer = self.session.offer
        datagram = wire.seal(offer.session, 0, 1, bytes(offer.key_up), b"osteon")
        self.assertEqual(wire.open_sealed(datagram, bytes(offer.key_up)), (offer.session, 0, 1, b"osteon"))
        for bit in range(8 * len(datagram)):
            broken = bytearray(datagram)
            broken[bit // 8] ^= 1 << bit % 8
            with self.assertRaises(wire.Broken):
                wire.open_sealed(bytes(broken), bytes(offer.key_up))


def relay_of(case, session, seed):
    relay = Relay(session.offer.udp_port, seed)
    case.addCleanup(relay.close)
    return relay.port


if __name__ == "__main__":
    unittest.main()
