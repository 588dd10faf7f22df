"""The fast path, and connections through bad networks, against real servers. See stage.py."""
import random
import socket
import threading
import time
import unittest

import client
import wire
from client import FastPath
from stage import HAPTIC, Case, full


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

    def decisions(self, session, cuts):
        return [session.decided(cut)[0] for cut in cuts]

    def cut_by(self, path, session, count, y=0.0):
        cuts = []
        for i in range(count):
            at = -4 + 8 * i / count
            cuts.append(path.send_cut(session.cut(self.burr, [(at, y, -0.5), (at + 0.3, y, -0.5)], us=20000)))
            time.sleep(0.025)
        return cuts

    def test_cuts_are_decided_without_the_stream(self):
        cuts = self.cut_by(self.open(self.session), self.session, 5)
        self.assertEqual(self.decisions(self.session, cuts), ["cut"] * 5)

    def test_keys_change(self):
        path = self.open(self.session)
        for keys in (0, 1, 3):  # a receiver follows over keys that it never saw
            for _ in range(keys):
                path.next_key()
            cuts = self.cut_by(path, self.session, 5, y=keys)
            self.assertEqual(self.decisions(self.session, cuts), ["cut"] * 5)

    def test_an_address_changes(self):
        path = self.open(self.session)
        for y in (0, 1, 2):
            self.assertEqual(self.decisions(self.session, self.cut_by(path, self.session, 5, y)), ["cut"] * 5)
            heard = sum(path.heard.values())
            path.move()
            until = time.monotonic() + 30
            while sum(path.heard.values()) < heard + 20 and time.monotonic() < until:
                time.sleep(0.02)
            self.assertGreaterEqual(sum(path.heard.values()), heard + 20, "the server has found the new address")

    def test_an_address_that_proves_nothing_gets_only_challenges(self):
        offer = self.session.offer
        packet = client.link.UpPacket()
        packet.times.sent_us = 1
        datagram = wire.seal(offer.session, 0, 1, bytes(offer.key_up), packet.SerializeToString())
        got = []
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as raw:
            raw.settimeout(2)
            raw.sendto(datagram, ("127.0.0.1", offer.udp_port))
            self.session.decided(self.session.send_cut(self.session.cut(self.burr, [(0, 0, -0.5)])))
            try:
                while True:
                    got.append(raw.recv(wire.MOST_DATAGRAM))
            except socket.timeout:
                pass
        self.assertTrue(got)
        self.assertLessEqual(sum(map(len, got)), 3 * len(datagram))
        for one in got:
            plain = client.link.DownPacket.FromString(wire.open_sealed(one, bytes(offer.key_down))[3])
            self.assertEqual([field.name for field, _ in plain.ListFields()], ["path_challenge"])

    def test_what_is_not_authentic_changes_nothing(self):
        path = self.open(self.session)
        first = self.cut_by(path, self.session, 3)
        self.assertEqual(self.decisions(self.session, first), ["cut"] * 3)
        offer, noise = self.session.offer, random.Random(3)
        packet = client.link.UpPacket(acknowledged=1000).SerializeToString()
        to = ("127.0.0.1", offer.udp_port)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as raw:
            raw.settimeout(0.5)
            for i in range(200):
                raw.sendto(noise.randbytes(noise.randrange(1200)), to)
                raw.sendto(wire.seal(offer.session, 0, 10 ** 9 + i, noise.randbytes(32), packet), to)
                # Each was sent before: counters are never taken twice.
                raw.sendto(wire.seal(offer.session, 0, 1 + i % 5, bytes(offer.key_up), packet), to)
            with self.assertRaises(socket.timeout):
                raw.recv(wire.MOST_DATAGRAM)
        more = self.cut_by(path, self.session, 3, y=1)
        self.assertEqual(self.decisions(self.session, more), ["cut"] * 3)
        self.assertEqual(self.hand.status().room_seq, self.session.decided(more[-1])[1])

    def test_a_datagram_cannot_end_the_stream(self):
        path = self.open(self.session)
        short = wire.Pose((0, 0, 0, 0, 0, 0, 20000))
        cut = path.send_cut(self.session.cut(self.burr, [short, short]))
        self.assertEqual(self.session.decided(cut)[3], client.CODES["ROTATION"])
        self.assertIsNone(self.session.ended)
        self.assertEqual(self.decisions(self.session, self.cut_by(path, self.session, 3)), ["cut"] * 3)

    def test_tools_of_others(self):
        path = self.open(self.session)
        _, other = self.haptic("ben")
        others = self.open(other)
        pose = client.types.QuantisedPose(position=[1024, -2048, 5120], rotation=[0, 0, 0, 32767])
        until, shown = time.monotonic() + 30, 0
        while self.hand.author not in others.partners and time.monotonic() < until:
            shown += 1
            path.show(client.link.ToolState(state_seq=shown, pose_bone_tool=pose, spindle_rpm=20000,
                                            phase=client.types.CUTTING_PHASE_FREE, blows=shown,
                                            time_us=5_000_000 + shown))
            time.sleep(0.05)
        seen = others.partners[self.hand.author]
        self.assertLessEqual(seen.state_seq, shown)
        self.assertEqual((seen.pose_bone_tool, seen.spindle_rpm), (pose, 20000))
        self.assertEqual((seen.time_us, seen.blows), (5_000_000 + seen.state_seq, seen.state_seq))
        self.assertNotIn(other.member.author, others.partners)

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


class TcpRelay:
    """Passes connections on in small pieces with pauses by a fixed seed, and breaks them when told to."""

    def __init__(self, address, seed):
        host, _, port = address.rpartition(":")
        self._to, self._seed = (host, int(port)), seed
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._sockets, self._lock, self.broken = [], threading.Lock(), 0
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                front, _ = self._listener.accept()
            except OSError:
                return
            try:
                back = socket.create_connection(self._to, timeout=20)
            except OSError:
                front.close()
                continue
            back.settimeout(None)
            with self._lock:
                self._sockets.append((front, back))
            for number, (source, sink) in enumerate(((front, back), (back, front))):
                threading.Thread(target=self._pass, args=(source, sink, self._seed + number), daemon=True).start()

    @staticmethod
    def _pass(source, sink, seed):
        chance = random.Random(seed)
        try:
            while data := source.recv(chance.randrange(1, 3000)):
                time.sleep(chance.random() * 0.002)
                sink.sendall(data)
        except OSError:
            pass
        for one in (source, sink):
            try:
                one.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def break_all(self):
        with self._lock:
            pairs, self._sockets = self._sockets, []
        for pair in pairs:
            self.broken += 1
            for one in pair:
                try:
                    one.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
                one.close()

    def close(self):
        self._listener.close()
        self.break_all()


class BrokenConnections(Case):
    def come(self, relay, again=None):
        hand = client.Member(relay.address, HAPTIC, "cleo", again=again)
        self.addCleanup(hand.close)
        session = client.Session(hand)
        self.addCleanup(session.close)
        return hand, session

    def test_each_cut_is_decided_once(self):
        relay = TcpRelay(self.server.address, seed=7)
        self.addCleanup(relay.close)
        hand, session = self.come(relay)
        sent = []
        for i in range(30):
            at = -4 + 0.25 * i
            cut = session.cut(self.burr, [(at, 0, -0.5), (at + 0.25, 0, -0.5)], us=5000, author_seq=i + 1)
            sent.append(session.send_cut(cut))
            time.sleep(0.02)
            if i in (6, 13, 14, 25):
                relay.break_all()
                session.wait(lambda s=session: s.ended)
                hand, session = self.come(relay, hand)
                # The first that is decided already is sent too: a client does not always know what came through.
                for undecided in sent[max(0, session.complete.decided_author_seq - 1):]:
                    session.send_cut(undecided)
        session.decided(sent[-1])
        self.assertGreaterEqual(relay.broken, 4)
        # Another client, whose connection never broke, has seen each of these cuts once.
        self.session.wait(lambda: any(e[2] == (hand.author, len(sent)) for e in self.session.events))
        cuts = [e[3] for e in self.session.events if e[0] == "cut" and e[3].author == hand.author]
        self.assertEqual([client.from_message(cut) for cut in cuts], sent)
        _, late = self.haptic()
        self.assertEqual(wire.field_hash(full(late.leaves), hand.joined.pitch_mm), self.hand.status().field_hash)


if __name__ == "__main__":
    unittest.main()
