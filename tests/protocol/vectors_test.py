"""Checks wire.py with what a real server once said (vectors.json), and that one flipped bit is noticed in each."""
import base64
import json
import os
import struct
import unittest
import zlib
from pathlib import Path

import client
import wire
from make_vectors import triangles_hash
from stage import turned



def joined(value):
    """A vector as make_vectors.py made it, before its long texts were split."""
    if isinstance(value, dict) and set(value) == {"text"}:
        return "".join(value["text"])
    if isinstance(value, dict) and set(value) == {"lines"}:
        return "\n".join(value["lines"]) + "\n"
    if isinstance(value, dict):
        return {name: joined(one) for name, one in value.items()}
    return [joined(one) for one in value] if isinstance(value, list) else value


VECTORS = joined(json.loads(Path(__file__).with_name("vectors.json").read_text()))


def tool_hash(given):
    return wire.tool_hash(given["yaml"]).hex()


def field_hash(given):
    leaves = {}
    for key, values in given["leaves"].items():
        data = zlib.decompress(base64.b64decode(values))
        numbers = struct.unpack(f"<{len(data) // 2}h", data)
        leaves[tuple(map(int, key.split()))] = numbers * 512 if len(numbers) == 1 else numbers
    return wire.field_hash(leaves, given["pitch_mm"]).hex()


def surface_hash(given):
    return wire.surface_hash({tuple(map(int, key.split())): bytes.fromhex(digest)
                              for key, digest in given["blocks"].items()}).hex()


def block(given):
    payload = bytes.fromhex(given["payload"])
    mesh = wire.decode_block(given["index"], payload, given["level_pitch_mm"])
    triangles = [turned(tuple(mesh.positions[i] for i in t)) for t in mesh.triangles]
    return {"mesh_hash": wire.sha256(payload).hex(), "triangles": triangles_hash(triangles)}


def first_entry(given):
    return next_entry(dict(given, chain=wire.first_chain(bytes.fromhex(given["genesis"])).hex()))


def next_entry(given):
    return wire.next_chain(bytes.fromhex(given["chain"]), given["seq"], given["at_ns"],
                           bytes.fromhex(given["entry"])).hex()


def datagram(given):
    _, _, _, plain = wire.open_sealed(bytes.fromhex(given["datagram"]), bytes.fromhex(given["key"]))
    run = client.link.DownPacket.FromString(plain).entries[0]
    tool = run.head.tool_hash or bytes.fromhex(given["tools"][str(run.head.tool_number)])
    return [[index, seq, client.to_message(cut).SerializeToString(deterministic=True).hex()]
            for index, seq, cut in wire.read_entries(run.author, run.index, run.room_seq, run.head, tool, run.entries)]


def next_key(given):
    return wire.next_key(bytes.fromhex(given["key"])).hex()


CHECKS = {check.__name__: check for check in (tool_hash, field_hash, surface_hash, block, first_entry, next_entry,
                                              datagram, next_key)}


def flipped_hex(text, bit):
    data = bytearray.fromhex(text)
    data[bit // 8 % len(data)] ^= 1 << bit % 8
    return data.hex()


def broken(given, bit):
    """Yields (field, the vector's input with one bit of that field flipped)."""
    for name, value in given.items():
        if name in ("tools", "level_pitch_mm", "pitch_mm"):
            continue
        if isinstance(value, int):
            yield name, dict(given, **{name: value ^ 1 << bit % 8})
        elif name == "yaml":
            at = value.index("diameter_mm: ") + len("diameter_mm: ")
            yield name, dict(given, yaml=value[:at] + chr(ord(value[at]) ^ 1) + value[at + 1:])
        elif name == "leaves":
            key = sorted(value)[bit % len(value)]
            data = flipped_hex(zlib.decompress(base64.b64decode(value[key])).hex(), bit)
            changed = base64.b64encode(zlib.compress(bytes.fromhex(data))).decode()
            yield name, dict(given, leaves=dict(value, **{key: changed}))
        elif name == "blocks":
            key = sorted(value)[bit % len(value)]
            yield name, dict(given, blocks=dict(value, **{key: flipped_hex(value[key], bit)}))
        elif name == "index":
            continue  # a block elsewhere is another surface; its payload says nothing about its place
        else:
            yield name, dict(given, **{name: flipped_hex(value, bit)})


class Vectors(unittest.TestCase):
    def test_are_many_and_of_every_kind(self):
        self.assertGreaterEqual(len(VECTORS), 18)
        self.assertEqual({vector["check"] for vector in VECTORS}, set(CHECKS))

    def test_hold(self):
        for vector in VECTORS:
            with self.subTest(vector["name"]):
                self.assertEqual(CHECKS[vector["check"]](vector["given"]), vector["expected"])

    def test_a_flipped_bit_is_noticed(self):
        print()
        for vector in VECTORS:
            noticed, tried = 0, 0
            for bit in (0, 5, 97, 1003, 5011):
                for name, given in broken(vector["given"], bit):
                    tried += 1
                    try:
                        found = CHECKS[vector["check"]](given) != vector["expected"]
                    except Exception:  # pylint: disable=broad-except  # refused: noticed as well
                        found = True
                    self.assertTrue(found, f"{vector['name']}: bit {bit} of {name}")
                    noticed += found
            print(f"  {vector['name']:45} {noticed:3} of {tried:3} flipped bits noticed")


if __name__ == "__main__":
    assert "OSTEON_SOURCE_DIR" in os.environ
    unittest.main()
