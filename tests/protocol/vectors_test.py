"""Checks wire.py with what a real server once said (vectors.json), and that one flipped bit is noticed in each."""
import base64
import itertools
import json
import os
import struct
import unittest
import zlib
from pathlib import Path

import client
import wire
from make_vectors import block_result, state_result



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
    return block_result(payload, wire.decode_block(given["index"], payload, given["level_pitch_mm"]))


def first_entry(given):
    return next_entry(dict(given, chain=wire.first_chain(bytes.fromhex(given["genesis"])).hex()))


def next_entry(given):
    return wire.next_chain(bytes.fromhex(given["chain"]), given["seq"], given["at_ns"],
                           bytes.fromhex(given["entry"])).hex()


def witness_seal(given):
    return wire.witness_seal(bytes.fromhex(given["witness_key"]), given["seq"], bytes.fromhex(given["chain"])).hex()


def signed_entries(given):
    message = wire.signed_entries(given["since"], given["seq"], bytes.fromhex(given["chain"]))
    wire.check_signature(bytes.fromhex(given["public_key"]), message, bytes.fromhex(given["signature"]))
    return "signed"


def signed_register(given):
    message = wire.signed_register(*(bytes.fromhex(given[name]) for name in ("name", "value", "genesis")))
    wire.check_signature(bytes.fromhex(given["public_key"]), message, bytes.fromhex(given["signature"]))
    return "signed"


def datagram(given):
    _, _, _, plain = wire.open_sealed(bytes.fromhex(given["datagram"]), bytes.fromhex(given["key"]))
    run = client.link.DownPacket.FromString(plain).entries[0]
    tool = run.head.tool_hash or bytes.fromhex(given["tools"][str(run.head.tool_number)])
    return [[index, seq, client.to_message(cut).SerializeToString(deterministic=True).hex()]
            for index, seq, cut in wire.read_entries(run.author, run.index, run.room_seq, run.head, tool, run.entries)]


def tool_state(given):
    return state_result(client.link.ToolState.FromString(bytes.fromhex(given["state"])))


def next_key(given):
    return wire.next_key(bytes.fromhex(given["key"])).hex()


CHECKS = {check.__name__: check for check in (tool_hash, field_hash, surface_hash, block, first_entry, next_entry,
                                              witness_seal, signed_entries, signed_register, datagram, tool_state,
                                              next_key)}


TRIED = 64  # bits of each field, or all of them if it has fewer
ALL = os.environ.get("OSTEON_TRIALS") == "all"  # as deploy/nightly sets it; else a quarter of these bits


def flipped_hex(text, bit):
    data = bytearray.fromhex(text)
    data[bit // 8] ^= 1 << bit % 8
    return data.hex()


def some_bits(count):
    return range(count) if count <= TRIED else [i * (count - 1) // (TRIED - 1) for i in range(TRIED)]


def flips(name, value):
    """Yields the value of a field with one bit flipped, for some bits."""
    if isinstance(value, int):
        yield from (value ^ 1 << bit for bit in range(32))
    elif isinstance(value, float):
        raw, = struct.unpack("<Q", struct.pack("<d", value))
        # Lower bits vanish when positions are rounded to 32 bits; exponents beyond all lengths are no pitch.
        yield from (struct.unpack("<d", struct.pack("<Q", raw ^ 1 << bit))[0] for bit in range(32, 56))
    elif isinstance(value, list):
        for i, one in enumerate(value):
            yield from ([*value[:i], changed, *value[i + 1:]] for changed in flips(name, one) if abs(changed) < 10 ** 6)
    elif name == "yaml":
        # The lowest bit of each digit of a number, and of each letter of a text.
        for at, letter in enumerate(value):
            if letter.isalnum() and ":" in value[value.rfind("\n", 0, at) + 1:at]:
                yield value[:at] + chr(ord(letter) ^ 1) + value[at + 1:]
    elif name == "leaves":
        for i, (key, packed) in enumerate(value.items()):
            data = zlib.decompress(base64.b64decode(packed)).hex()
            for bit in (0, (97 * i + 5) % (4 * len(data)), 4 * len(data) - 1):
                changed = base64.b64encode(zlib.compress(bytes.fromhex(flipped_hex(data, bit)))).decode()
                yield dict(value, **{key: changed})
    elif name == "blocks":
        for i, (key, digest) in enumerate(value.items()):
            yield dict(value, **{key: flipped_hex(digest, i % 256)})
    else:
        yield from (flipped_hex(value, bit) for bit in some_bits(4 * len(value)))


def broken(given):
    """Yields (field, the vector's input with one bit of that field flipped)."""
    for name, value in given.items():
        # `tools` only says what a number means, and `pitch_mm` of a field only which leaves are empty.
        if name not in ("tools", "pitch_mm"):
            tried = itertools.islice(flips(name, value), 0, None, 1 if ALL else 4)
            yield from ((name, dict(given, **{name: changed})) for changed in tried)


class Vectors(unittest.TestCase):
    def test_are_many_and_of_every_kind(self):
        self.assertGreaterEqual(len(VECTORS), 26)
        self.assertEqual({vector["check"] for vector in VECTORS}, set(CHECKS))

    def test_hold(self):
        for vector in VECTORS:
            with self.subTest(vector["name"]):
                self.assertEqual(CHECKS[vector["check"]](vector["given"]), vector["expected"])

    def test_a_flipped_bit_is_noticed(self):
        print()
        for vector in VECTORS:
            missed, refused, tried = [], 0, 0
            for name, given in broken(vector["given"]):
                tried += 1
                try:
                    if CHECKS[vector["check"]](given) == vector["expected"]:
                        missed.append(name)
                except Exception:  # pylint: disable=broad-except  # refused: noticed as well
                    refused += 1
            print(f"  {vector['name']:42} {tried:4} flipped bits: {refused:4} refused, "
                  f"{tried - refused - len(missed):4} give another result, {len(missed)} not noticed")
            self.assertEqual(missed, [], vector["name"])


if __name__ == "__main__":
    assert "OSTEON_SOURCE_DIR" in os.environ
    unittest.main()
