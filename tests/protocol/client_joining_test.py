"""Joining, coming back, and the history that a client can check, against real servers. See stage.py."""
import atexit
import collections
import contextlib
import functools
import shutil
import sqlite3
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import grpc

import client
import wire
from client import SOURCE, Credentials, Session, people, people_grpc, room, types
from stage import BIN, HAPTIC, VIEWER, Case, flipped


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
        self.assertLessEqual({"join", "cut", "rejection", "mark"}, set(self.kinds))
        key = self.register("witness key")[0]
        self.assertEqual(len(key), 32)
        for seq, chain, seal in told:
            self.assertEqual(heads[seq], chain)
            self.assertEqual(wire.witness_seal(key, seq, chain), seal)
        self.assertEqual(late.complete.room_seq, summary["room_seq"])

    def test_a_journal_is_signed_by_the_key_that_the_server_shows(self):
        self.groove(self.session)
        self.server.stop()
        first = self.public_key("show")
        signed = self.check_signatures({first})
        second = self.public_key("rotate")
        self.server.start()
        self.hand, self.session = self.haptic("anna")
        self.groove(self.session, 1)
        self.server.stop()
        self.assertEqual(self.public_key("show"), second)
        self.assertNotEqual(first, second)
        self.assertEqual(self.check_signatures({first, second}), {first, second})
        self.assertEqual(signed, {first})
        # The key file says who followed whom, and both have signed it.
        lines = (self.folder / "signing.key").read_text().splitlines()
        one = bytes.fromhex(next(line for line in lines if line.startswith("succession ")).split()[1])
        before, after, by_before, by_after = one[:32], one[32:64], one[64:128], one[128:]
        self.assertEqual((before, after), (first, second))
        for key, signature in ((before, by_before), (after, by_after)):
            wire.check_signature(key, wire.signed_succession(before, after), signature)

    def public_key(self, command):
        said = subprocess.run([BIN / "osteon-server", "key", command, self.folder / "signing.key"], check=True,
                              capture_output=True, text=True, timeout=60).stdout
        return bytes.fromhex(said.split()[0])

    def register(self, name):
        with contextlib.closing(sqlite3.connect(self.folder / "room.journal")) as base:
            return base.execute("SELECT value, seal FROM registers WHERE name = ?", (name,)).fetchone()

    def check_signatures(self, keys):
        """Checks all signatures of the journal. Returns the keys that signed log entries."""
        heads = self.chain_of(self.folder / "room.journal")
        with contextlib.closing(sqlite3.connect(self.folder / "room.journal")) as base:
            entries = base.execute("SELECT since, place, chain, key, signature FROM signatures").fetchall()
        self.assertEqual(max(row[1] for row in entries), max(heads), "the newest signature covers everything")
        for since, seq, chain, key, signature in entries:
            self.assertEqual(chain, heads[seq])
            self.assertIn(key, keys)
            message = wire.signed_entries(since, seq, chain)
            wire.check_signature(key, message, signature)
            for wrong in ((key, flipped(message), signature), (key, message, flipped(signature)),
                          (flipped(key), message, signature)):
                with self.assertRaises(wire.Broken):
                    wire.check_signature(*wrong)
        value, seal = self.register("witness key")
        message = wire.signed_register("witness key", value, self.register("genesis")[0])
        self.assertIn(seal[:32], keys)
        wire.check_signature(seal[:32], message, seal[32:])
        return {row[3] for row in entries}

    def chain_of(self, file):
        """{sequence number: chain}, computed from the genesis and the entries."""
        with contextlib.closing(sqlite3.connect(file)) as base:
            genesis, = base.execute("SELECT value FROM registers WHERE name = 'genesis'").fetchone()
            rows = base.execute("SELECT place, at_ns, bytes, chain FROM rows ORDER BY place").fetchall()
        read = client.journal.JournalGenesis.FromString(genesis)
        self.assertEqual(read.case_hash, self.hand.joined.case_hash)
        chain, heads, self.kinds = wire.first_chain(genesis), {}, []
        for seq, at_ns, entry, stored in rows:
            chain = wire.next_chain(chain, seq, at_ns, entry)
            self.assertEqual(chain, stored)
            heads[seq] = chain
            self.kinds.append(client.journal.JournalEntry.FromString(entry).WhichOneof("what"))
        self.assertEqual(self.kinds[:2], ["join", "cut"])
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


class Rights(Case):
    """A server with certificates and tickets."""

    @staticmethod
    @functools.cache  # Eight programs make them.
    def certificates():
        folder = tempfile.TemporaryDirectory(prefix="osteon-protocol-")
        atexit.register(folder.cleanup)
        for arguments in (("authority",), ("server", "127.0.0.1"), ("person", "anna"), ("person", "ben")):
            subprocess.run([SOURCE / "deploy" / "certs", "--into", Path(folder.name) / "certs", *arguments], check=True,
                           capture_output=True, timeout=60)
        return Path(folder.name) / "certs"

    def prepare(self):
        shutil.copytree(self.certificates(), self.folder / "certs")

    def access(self):
        return "--certificates", self.folder / "certs" / "server"

    def enter(self):
        self.hand, self.session = self.haptic("anna", channel=self.channel("anna", "trainee"))
        self.burr = self.tool("burr-round-3.2")

    def ticket(self, user, role):
        return subprocess.run([BIN / "osteon-server", "ticket", "--key", self.folder / "certs/authority/tickets.key",
                               "--hours", "1", "--room", "room", "--user", user, "--role", role], check=True,
                              capture_output=True, text=True, timeout=60).stdout.strip()

    def channel(self, user, role, *, ticket=None):
        shown = self.ticket(user, role) if ticket is None else ticket
        return Credentials(self.folder / "certs" / "people" / user, shown).channel(self.server.address)

    def refused(self, call):
        """Status and the word for programs of a call that the server refuses."""
        with self.assertRaises(grpc.RpcError) as caught:
            call()
        words = {key: value for key, value in caught.exception.trailing_metadata() or ()}
        return caught.exception.code(), words.get("osteon-refusal")

    def test_a_trainee_cuts(self):
        self.assertEqual(self.hand.joined.role, types.ROLE_TRAINEE)
        self.assertEqual(self.groove(self.session, 1)[0][0], "cut")
        path = client.FastPath(self.session)
        self.addCleanup(path.close)
        cut = path.send_cut(self.session.cut(self.burr, [(0, 2, -0.5)]))
        self.assertEqual(self.session.decided(cut)[0], "cut")

    def test_who_is_refused(self):
        other = self.ticket("ben", "trainee")
        for what, channel in (("no ticket", self.channel("anna", "trainee", ticket="")),
                              ("another's ticket", self.channel("anna", "trainee", ticket=other)),
                              ("a changed ticket", self.channel("ben", "trainee", ticket=other[:-1] + "!"))):
            with self.subTest(what):
                code, word = self.refused(lambda c=channel: self.member(VIEWER, channel=c))
                self.assertIn(code, (grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED))
                self.assertTrue(word)

    def test_without_a_certificate_there_is_no_connection(self):
        authority = (self.folder / "certs" / "server" / "ca.pem").read_bytes()
        channel = grpc.secure_channel(self.server.address, grpc.ssl_channel_credentials(authority))
        code, word = self.refused(lambda: self.member(VIEWER, channel=channel))
        self.assertEqual((code, word), (grpc.StatusCode.UNAVAILABLE, None))

    def test_an_observer_watches_and_does_not_cut(self):
        channel = self.channel("ben", "observer")
        code, _ = self.refused(lambda: self.member(HAPTIC, channel=channel))
        self.assertEqual(code, grpc.StatusCode.PERMISSION_DENIED)
        self.assertEqual(self.member(VIEWER, channel=channel).joined.role, types.ROLE_OBSERVER)

    def test_a_trainee_does_not_supervise(self):
        stub = people_grpc.PeopleServiceStub(self.hand.channel)
        code, word = self.refused(lambda: stub.Supervise(people.SuperviseRequest(author=self.hand.author), timeout=20))
        self.assertEqual((code, word), (grpc.StatusCode.PERMISSION_DENIED, "role"))

    def test_a_header_that_nobody_knows(self):
        call = self.hand.rooms.GetStatus
        self.assertEqual(call(room.GetStatusRequest(), timeout=20,
                              metadata=[("osteon-room-bin", b"room")]).bodies, [0])
        code, word = self.refused(lambda: call(room.GetStatusRequest(), timeout=20, metadata=[("other", "1")]))
        self.assertEqual((code, word), (grpc.StatusCode.INVALID_ARGUMENT, "request"))

    def test_nobody_acts_as_another(self):
        channel = self.channel("ben", "trainee")
        self.member(VIEWER, channel=channel)
        mark = room.MarkRequest(author=self.hand.author, label="mine")
        rooms = client.room_grpc.RoomServiceStub(channel)
        code, _ = self.refused(lambda: rooms.Mark(mark, timeout=20))
        self.assertEqual(code, grpc.StatusCode.PERMISSION_DENIED)


if __name__ == "__main__":
    unittest.main()
