"""Writes vectors.json: what a real server said, for vectors_test.py. OSTEON_BIN and OSTEON_SOURCE_DIR as for the tests.

    OSTEON_BIN=build/dev/bin OSTEON_SOURCE_DIR=. python3 -B tests/protocol/make_vectors.py

Each expected value comes from the server, from osteon-import or from libsodium, not from wire.py. Only a
block's normals, cut faces and tissue are as wire.py reads them, and so is all of the two vectors of noise, which no
server sends, and of the state of a tool. The programs' code confirms them (vectors_test.cpp).
"""
import base64
import contextlib
import ctypes
import json
import random
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

import client
import wire
from client import Member, Session, Surface, room
from stage import BIN, HAPTIC, VIEWER, Server, metal_case, run, stl_triangles, turned


def in_lines(value):
    """Long texts as lists of short ones, for a file of narrow lines."""
    if isinstance(value, dict):
        return {name: in_lines(one) for name, one in value.items()}
    if isinstance(value, list):
        return [in_lines(one) for one in value]
    if isinstance(value, str) and len(value) > 80 and "\n" not in value:
        return {"text": [value[i:i + 80] for i in range(0, len(value), 80)]}
    if isinstance(value, str) and "\n" in value:
        return {"lines": value.splitlines()}
    return value


def smallest(tools):
    """The cutting tool with the smallest diameter."""
    fields = {digest: wire.tool_fields(tool.yaml) for digest, tool in tools.items()}
    return min((f for f in fields if fields[f]["kind"] == "round-burr"), key=lambda f: float(fields[f]["diameter_mm"]))


def text_of(key):
    return " ".join(map(str, key))


def main():
    vectors = []

    def add(name, check, given, expected):
        vectors.append(in_lines({"name": name, "check": check, "given": given, "expected": expected}))

    with tempfile.TemporaryDirectory(prefix="osteon-vectors-") as name:
        folder = Path(name)
        server = Server(folder, "--journal", folder / "room.journal")
        hand = Member(server.address, HAPTIC, "anna")
        session = Session(hand)
        watcher = Session(Member(server.address, HAPTIC, "ben"))
        path = CapturingPath(watcher)
        tools = {wire.tool_fields(tool.yaml)["name"]: (digest, tool.yaml) for digest, tool in session.tools.items()}
        for tool in ("burr-round-3.2", "saw-oscillating-1", "drill-3.2", "pin-3", "guide-2"):
            digest, definition = tools[tool]
            add(f"tool {tool}", "tool_hash", {"yaml": definition}, digest.hex())
        burr, small = tools["burr-round-3.2"][0], smallest(session.tools)
        session.decided(session.send_cut(session.cut(small, [(0, 0, 0)], level=0)))
        first = Session(Member(server.address, HAPTIC, "cleo"))
        add("field of one small cut", "field_hash",
            {"pitch_mm": hand.joined.pitch_mm,
             "leaves": {text_of(key): base64.b64encode(zlib.compress(values, 9)).decode()
                        for key, values in sorted(first.leaves.items())}}, hand.status().field_hash.hex())
        cuts = []
        for i in range(12):
            ends = [((i - 6) / 2, 0.1 * i, -1.0), ((i - 5) / 2, 0.1 * (i + 1), -1.0)]
            middle = [tuple(a + (b - a) * k / 4 for a, b in zip(*ends)) for k in (1, 2, 3)]
            cut = session.cut(burr, [ends[0], *middle, ends[1]], level=2, us=9000 + i // 4, rpm=20000 + 7 * (i // 2))
            cuts.append(session.send_cut(cut))
            time.sleep(0.01)
        decided = [session.decided(cut) for cut in cuts]
        session.decided(session.send_cut(session.cut(burr, [(0, 0, 5)], body=77)))
        hand.rooms.Mark(room.MarkRequest(author=hand.author, label="end"), timeout=20)
        watcher.wait(lambda: path.packets and sum(e[0] == "cut" for e in watcher.events) == 1 + len(cuts))
        time.sleep(0.2)
        surface = Surface(Member(server.address, VIEWER)).read_until(decided[-1][1])
        path.close()
        for one in (session, watcher, first):
            one.close()
        surface.close()
        summary = server.stop()
        keys = {key: wire.sha256(payload).hex() for key, payload in surface.blocks.items()}
        add(f"surface of {1 + len(cuts)} cuts", "surface_hash",
            {"blocks": {text_of(k): d for k, d in sorted(keys.items())}},
            summary["mesh_hash"])
        blocks(add, folder, server, surface, hand.joined.pitch_mm)
        metal(add, folder / "metal")
        chain(add, folder / "room.journal")
        signatures(add, folder, watcher.durable)
        datagrams(add, path, watcher)
        add("block of noise", "block", *noise_block())
        add("datagram of noise", "datagram", *noise_datagram())
        add("state of a broach", "tool_state", *broach_state())
        key = bytes(range(32))
        out = ctypes.create_string_buffer(32)
        wire.sodium().crypto_kdf_derive_from_key(out, ctypes.c_size_t(32), ctypes.c_uint64(1), b"osteonUD", key)
        add("key of the next generation", "next_key", {"key": key.hex()}, out.raw.hex())
    target = Path(__file__).with_name("vectors.json")
    target.write_text(json.dumps(vectors, indent=1) + "\n")
    print(f"{len(vectors)} vectors, {target.stat().st_size} bytes")


class CapturingPath(client.FastPath):
    """Keeps what arrived."""

    def __init__(self, session):
        self.packets = []
        super().__init__(session)

    def _receive(self, datagram):
        self.packets.append(datagram)
        super()._receive(datagram)


def blocks(add, folder, server, surface, pitch_mm):
    """Blocks of different kinds, whose triangles are those that osteon-import writes."""
    run("osteon-server", "replay", folder / "room.journal", "--case", server.case, "--fields", folder / "cut.vdb")
    run("osteon-import", "surface", server.case, "--fields", folder / "cut.vdb", "--out", folder / "cut.stl")
    add_blocks(add, surface, pitch_mm, folder / "cut.stl", set())


def metal(add, folder):
    """The same of a bone with metal."""
    folder.mkdir()
    metal_case(folder)
    run("osteon-import", "surface", folder / "case", "--out", folder / "bone.stl")
    server = Server(folder)
    viewer = Member(server.address, VIEWER)
    surface = Surface(viewer).read_until(0)
    surface.close()
    server.stop()
    # A block with metal: its kinds without metal are there already.
    surface.blocks = {key: payload for key, payload in surface.blocks.items() if payload[0] & wire.TISSUE}
    add_blocks(add, surface, viewer.joined.pitch_mm, folder / "bone.stl", set())


def add_blocks(add, surface, pitch_mm, stl, seen):
    written = {turned(triangle) for triangle in stl_triangles(stl)}
    for key, payload in sorted(surface.blocks.items(), key=lambda item: len(item[1])):
        mesh = wire.decode_block(key[2:], payload, pitch_mm / 2 ** key[1])
        triangles = [turned(tuple(mesh.positions[i] for i in t)) for t in mesh.triangles]
        kind = (key[1], payload[0])
        if kind in seen or not triangles or not set(triangles) <= written:
            continue
        seen.add(kind)
        add(f"block of level {key[1]} with flags {payload[0]}", "block",
            {"index": list(key[2:]), "level_pitch_mm": pitch_mm / 2 ** key[1], "payload": payload.hex()},
            block_result(payload, mesh))


def block_result(payload, mesh):
    """What a vector says of a block: digests of its bytes, of its triangles and of what belongs to its vertices."""
    triangles = [turned(tuple(mesh.positions[i] for i in t)) for t in mesh.triangles]
    # In steps of 1/20, so that the last bits of a square root do not count.
    normals = b"".join(struct.pack("<3b", *(round(20 * n) for n in normal)) for normal in mesh.normals)
    return {"mesh_hash": wire.sha256(payload).hex(), "triangles": triangles_hash(triangles),
            "normals": wire.sha256(normals).hex(), "cut": wire.sha256(bytes(mesh.cut)).hex(),
            "tissue": wire.sha256(bytes(mesh.tissue)).hex()}


def noise_block():
    """A block of random samples, where lines cross seams of all kinds. Most of its cells are covered."""
    chance = random.Random(20)
    rows = [[chance.getrandbits(wire.SAMPLES) for _ in range(wire.SAMPLES)] for _ in range(wire.SAMPLES)]
    covered = sum(1 << i for i in range(64) if chance.random() < 0.8)
    coarser = [0 if wire.is_inner(i) else chance.randrange(4) for i in range(64)]
    for i in (5, 6, 9, 10):  # the face towards −x: one neighbour as large as four such blocks
        coarser[i] = 4
    known = [i for i in range(64) if coarser[i]]
    steps = [coarser[i] for i in known] + [0] * (len(known) % 2)
    payload = bytes([wire.COVERED | wire.SEAMS | wire.SOME_CUT | wire.TISSUE]) + struct.pack("<Q", covered)
    payload += struct.pack("<Q", sum(1 << i for i in known))
    payload += bytes(low | high << 4 for low, high in zip(steps[::2], steps[1::2])) + wire.coded_rows(rows)
    count = len(wire.Contour(rows, covered, wire.SeamRule(coarser)).edges)
    payload += bytes(chance.randrange(wire.PLACES + 1) for _ in range(count)) + chance.randbytes(2 * count)
    payload += packed([chance.randrange(2) for _ in range(count)], 1)
    payload += packed([chance.randrange(3) for _ in range(count)], 2)
    index, level_pitch_mm = [3, -2, -7], 0.4
    mesh = wire.decode_block(index, payload, level_pitch_mm)
    return ({"index": index, "level_pitch_mm": level_pitch_mm, "payload": payload.hex()}, block_result(payload, mesh))


def packed(values, bits):
    """The values in so many bits each, the lowest bits of a byte first."""
    each = 8 // bits
    values = values + [0] * (-len(values) % each)
    return bytes(sum(value << bits * i for i, value in enumerate(values[at:at + each]))
                 for at in range(0, len(values), each))


def noise_datagram():
    """A run of cuts with all options of the code: gaps, own first poses, steps that wrap around."""
    chance = random.Random(21)
    key, tool, author = chance.randbytes(32), chance.randbytes(32), 7
    pose = wire.Pose(tuple(chance.randrange(-2 ** 31, 2 ** 31) for _ in range(3)) +
                     tuple(chance.randrange(-2 ** 15, 2 ** 15) for _ in range(4)))
    rpm, us, at, entries, expected = 20000, 8000, [40, 90, 11], b"", []
    head = client.link.CutRun(author_seq=at[2], lease_epoch=3, body=2, tool_number=5, level=1, spindle_rpm=rpm,
                              start=pose.numbers, path_us=us)
    for n in range(12):
        steps = (1, 1, 1) if n == 0 else (1 + chance.randrange(3), 1 + chance.randrange(4), 1 + chance.randrange(2))
        at = [a + s for a, s in zip(at, steps)] if n else at
        cut = noise_cut(chance, pose, author, at[2], tool, rpm if n % 3 else rpm + chance.randrange(-99, 99),
                        us if n % 4 else us + 5)
        more = steps[1] != steps[0] or steps[2] != 1
        entries += wire.varint((steps[0] - 1) << 1 | more)
        if more:
            entries += wire.varint(wire.zigzag(steps[1] - steps[0])) + wire.varint(steps[2] - 1)
        entries += wire.coded_cut(cut, pose, rpm, us)
        pose, rpm, us = cut.path[-1], cut.spindle_rpm, cut.path_us
        expected.append([at[0], at[1], client.to_message(cut).SerializeToString(deterministic=True).hex()])
    run_of = client.link.EntryRun(author=author, index=40, room_seq=90, head=head, entries=entries)
    plain = client.link.DownPacket(entries=[run_of]).SerializeToString()
    return ({"key": key.hex(), "datagram": wire.seal(9, 0, 77, key, plain).hex(), "tools": {"5": tool.hex()}}, expected)


def noise_cut(chance, start, author, author_seq, tool, rpm, us):
    """A cut from `start`, or sometimes from elsewhere, on with equal steps, so that some poses are where expected."""
    step = [chance.randrange(-2 ** 28, 2 ** 28) for _ in range(3)] + [chance.randrange(-2 ** 12, 2 ** 12)] * 4
    path = [start]
    if chance.random() < 0.3:
        path = [wire.Pose(tuple(wrapped_sum(start.numbers, [7] * 7)))]
    for _ in range(1 + chance.randrange(4)):
        path.append(wire.Pose(tuple(wrapped_sum(path[-1].numbers, step))))
    return wire.Cut(author, author_seq, 3, 2, tool, 1, path, rpm, us)


def wrapped_sum(numbers, step):
    return (wire.wrapped(number + by, i) for i, (number, by) in enumerate(zip(numbers, step)))


def broach_state():
    """A tool's state with its effort. Each number differs from the others, so that none can be exchanged."""
    types, link = client.types, client.link
    effort = link.ToolEffort(tool_name="broach-2", force=[1500, -250, 40125], torque=-31, feed=417, density=1203,
                             engaged=875, depth=6200, flutes_full=62, force_hand=9001, device_holds=30000, cortex=457,
                             seated=271, blow_impulse=2800)
    pose = types.QuantisedPose(position=[1024, -2049, 7], rotation=[0, 0, 0, 32767])
    state = link.ToolState(author=4, state_seq=5300, pose_bone_tool=pose, buttons=2, spindle_rpm=240,
                           phase=types.CUTTING_PHASE_RUBBING, effort=effort, time_us=123456789012, blows=17)
    return {"state": state.SerializeToString(deterministic=True).hex()}, state_result(state)


def state_result(state):
    """What a ToolState says, in the units of CuttingState. Poses stay as they are."""
    effort = state.effort
    milli = {name: getattr(effort, name) / 1000 for name in ("feed", "density", "engaged", "flutes_full", "force_hand",
                                                             "device_holds", "seated", "blow_impulse")}
    plain = {name: getattr(state, name) for name in ("author", "state_seq", "buttons", "spindle_rpm", "phase",
                                                     "time_us", "blows")}
    return {**plain, **milli, "position": list(state.pose_bone_tool.position), "tool_name": effort.tool_name,
            "rotation": list(state.pose_bone_tool.rotation), "force": [f / 1000 for f in effort.force],
            "torque": effort.torque / 100, "depth": effort.depth / 1024, "cortex": effort.cortex / 100}


def triangles_hash(triangles):
    """SHA-256 over the sorted triangles, each from its smallest corner on, as nine floats of 32 bits."""
    return wire.sha256(b"".join(struct.pack("<9f", *a, *b, *c) for a, b, c in sorted(triangles))).hex()


def chain(add, file):
    with contextlib.closing(sqlite3.connect(file)) as base:
        genesis, = base.execute("SELECT value FROM registers WHERE name = 'genesis'").fetchone()
        rows = base.execute("SELECT place, at_ns, bytes, chain FROM rows ORDER BY place").fetchall()
    kinds, before = set(), None
    for seq, at_ns, entry, stored in rows:
        kind = client.journal.JournalEntry.FromString(entry).WhichOneof("what")
        if before is None:
            add("chain at the first entry", "first_entry",
                {"genesis": genesis.hex(), "seq": seq, "at_ns": at_ns, "entry": entry.hex()}, stored.hex())
        elif kind not in kinds:
            add(f"chain at an entry of kind {kind}", "next_entry",
                {"chain": before.hex(), "seq": seq, "at_ns": at_ns, "entry": entry.hex()}, stored.hex())
        kinds.add(kind)
        before = stored


def signatures(add, folder, durable):
    """What the server sealed and signed. Its public key is that which osteon-server prints."""
    with contextlib.closing(sqlite3.connect(folder / "room.journal")) as base:
        rows = base.execute("SELECT name, value, seal FROM registers").fetchall()
        since, seq, chain_then, signature = base.execute(
            "SELECT since, place, chain, signature FROM signatures ORDER BY place DESC").fetchone()
    registers = {name: (value, seal) for name, value, seal in rows}
    shown = subprocess.run([BIN / "osteon-server", "key", "show", folder / "signing.key"], check=True,
                           capture_output=True, text=True).stdout.split()[0]
    value, seal = registers["witness key"]
    add(f"seal of event {durable.room_seq}", "witness_seal",
        {"witness_key": value.hex(), "seq": durable.room_seq, "chain": durable.chain.hex()}, durable.seal.hex())
    add(f"signature of events {since} to {seq}", "signed_entries",
        {"public_key": shown, "since": since, "seq": seq, "chain": chain_then.hex(), "signature": signature.hex()},
        "signed")
    add("signature of a register", "signed_register",
        {"public_key": shown, "genesis": registers["genesis"][0].hex(), "name": b"witness key".hex(),
         "value": value.hex(), "signature": seal[32:].hex()}, "signed")


def datagrams(add, path, session):
    """A sealed datagram of the server, and the cuts of its run of entries as the stream sent them."""
    sent = {event[2]: event[3] for event in session.events if event[0] == "cut"}
    key, found = bytes(session.offer.key_down), []
    for datagram in path.packets:
        _, _, counter, plain = wire.open_sealed(datagram, key)
        packet = client.link.DownPacket.FromString(plain)
        if packet.entries:
            found.append((len(packet.entries[0].entries), counter, datagram, packet.entries[0]))
    # The shortest run and the two longest.
    found.sort(key=lambda one: one[:2])
    for _, counter, datagram, run_of in (found[0], *found[-2:]):
        tool = run_of.head.tool_hash or session.numbers[run_of.head.tool_number]
        cuts = wire.read_entries(run_of.author, run_of.index, run_of.room_seq, run_of.head, tool, run_of.entries)
        add(f"datagram {counter} with {len(cuts)} cuts", "datagram",
            {"key": key.hex(), "datagram": datagram.hex(), "tools": {str(run_of.head.tool_number): tool.hex()}},
            [[index, seq, sent[cut.author, cut.author_seq].SerializeToString(deterministic=True).hex()]
             for index, seq, cut in cuts])


if __name__ == "__main__":
    sys.exit(main())
