"""A small client of Osteon's server in Python, made from deploy/docs/protocol.md and the files of proto/ alone."""
import collections
import contextlib
import functools
import importlib
import os
import queue
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import grpc

import wire

SOURCE = Path(os.environ["OSTEON_SOURCE_DIR"])
PROTOCOL, KERNEL = 4, 2


def load_stubs():
    """Makes the protocol's modules in a folder of their own, and imports them."""
    folder = tempfile.TemporaryDirectory(prefix="osteon-protocol-")
    files = sorted(str(p) for p in (SOURCE / "proto").rglob("*.proto"))
    plugin = subprocess.run(["which", "grpc_python_plugin"], capture_output=True, text=True, check=True).stdout.strip()
    subprocess.run(["protoc", f"-I{SOURCE / 'proto'}", f"--python_out={folder.name}", f"--grpc_out={folder.name}",
                    f"--plugin=protoc-gen-grpc={plugin}", *files], check=True)
    sys.path.insert(0, folder.name)
    modules = {name: importlib.import_module(f"osteon.v1.{name}")
               for name in ("types_pb2", "room_pb2", "room_pb2_grpc", "watch_pb2", "watch_pb2_grpc", "cutting_pb2",
                            "cutting_pb2_grpc", "field_pb2", "field_pb2_grpc", "link_pb2", "journal_pb2", "people_pb2",
                            "people_pb2_grpc")}
    return folder, modules


_FOLDER, _MODULES = load_stubs()
types, room, room_grpc = (_MODULES[n] for n in ("types_pb2", "room_pb2", "room_pb2_grpc"))
watch, watch_grpc = (_MODULES[n] for n in ("watch_pb2", "watch_pb2_grpc"))
cutting, cutting_grpc, link = (_MODULES[n] for n in ("cutting_pb2", "cutting_pb2_grpc", "link_pb2"))
field, field_grpc = (_MODULES[n] for n in ("field_pb2", "field_pb2_grpc"))
journal, people, people_grpc = (_MODULES[n] for n in ("journal_pb2", "people_pb2", "people_pb2_grpc"))


CODES = {name.removeprefix("REJECTION_REASON_"): number for name, number in cutting.RejectionReason.items()}


# gRPC lets channels of one process to one address share a connection, and one that has just broken ends the next call.
# Each member stands for a program of its own, so it has a connection of its own.
OWN_CONNECTION = (("grpc.use_local_subchannel_pool", 1),)


class Credentials(grpc.AuthMetadataPlugin):
    """What a person shows over TLS: a folder with certificate and key, and a ticket with each call."""

    def __init__(self, folder, ticket):
        self.folder, self.ticket = Path(folder), ticket

    def __call__(self, _context, callback):
        callback((("osteon-ticket", self.ticket),) if self.ticket else (), None)

    def channel(self, address):
        authority, key, chain = ((self.folder / name).read_bytes() for name in ("ca.pem", "person.key", "person.pem"))
        return grpc.secure_channel(address, grpc.composite_channel_credentials(
            grpc.ssl_channel_credentials(authority, key, chain), grpc.metadata_call_credentials(self)), OWN_CONNECTION)


class Member:
    """Somebody who has joined a room."""

    def __init__(self, address, kind, name="", *, again=None, durable=None, kernel=KERNEL, version=PROTOCOL,
                 channel=None):
        self.address = address
        self.channel = channel or grpc.insecure_channel(address, OWN_CONNECTION)
        self.rooms = room_grpc.RoomServiceStub(self.channel)
        request = room.JoinRequest(protocol_version=version, kernel_version=kernel, kind=kind, name=name, user=name)
        if again:
            request.resume_author, request.secret = again.author, again.secret
        if durable:
            request.durable_room_seq, request.durable_chain, request.durable_seal = durable
        self.joined = self.rooms.Join(request, timeout=20)
        self.author = self.joined.author
        self.secret = again.secret if again else self.joined.secret

    def close(self):
        self.channel.close()

    def status(self):
        return self.rooms.GetStatus(room.GetStatusRequest(), timeout=20)


@functools.cache  # Tests ask for most blocks several times, and Python needs 10 ms for each.
def mesh_of(key, payload, pitch_mm):
    _, level, *index = key
    return wire.decode_block(index, payload, pitch_mm / 2 ** level)


class Surface:
    """The surface as a viewer without a camera gets it: every block in full detail."""

    def __init__(self, member):
        self.member = member
        self.blocks = {}  # (body, level, x, y, z) -> payload
        self.room_seq = 0
        self._stream = None

    def read_until(self, room_seq):
        """Reads the stream until the surface is whole and contains the event."""
        stub = watch_grpc.WatchServiceStub(self.member.channel)
        if self._stream is None:
            self._stream = stub.WatchMesh(watch.WatchMeshRequest(author=self.member.author), timeout=60)
        for message in self._stream:
            for block in message.blocks:
                key = (block.body, block.level, block.index.x, block.index.y, block.index.z)
                wire.check_digest(block.payload, block.mesh_hash)
                if block.payload:
                    self.blocks[key] = block.payload
                else:
                    self.blocks.pop(key, None)
            self.room_seq = message.room_seq
            if message.snapshot_complete and message.room_seq >= room_seq:
                return self

        raise AssertionError("the server ended the stream")

    def close(self):
        if self._stream is not None:
            self._stream.cancel()

    def hash(self):
        return wire.surface_hash({key: wire.sha256(payload) for key, payload in self.blocks.items()})

    def triangles(self):
        """The triangles of all blocks, each as three points."""
        out = []
        for key, payload in sorted(self.blocks.items()):
            mesh = mesh_of(key, payload, self.member.joined.pitch_mm)
            out += [tuple(mesh.positions[i] for i in triangle) for triangle in mesh.triangles]
        return out


class Session:
    """The stream of a haptic client. Messages about events are taken in order of their index, by stream or datagram."""

    def __init__(self, member):
        self.member = member
        self.leaves, self.tools, self.numbers = {}, {}, {}
        self.complete = self.durable = self.offer = self.scene = self.supervised = self.redial = None
        self.partners = {}  # author -> newest CuttingState
        self.events = []  # cuts, rejections and all other messages with an index, in order; see _deliver
        self.lease = member.joined.lease_epoch
        self.author_seq = 0
        self.ended = None
        self._next, self._held = 1, {}
        self._changed = threading.Condition()
        self._requests = queue.Queue()
        self.send(cutting.SessionRequest(open=cutting.SessionOpen(
            author=member.author, server_epoch=member.joined.server_epoch, secret=member.secret)))
        self._call = cutting_grpc.CuttingServiceStub(member.channel).Session(iter(self._requests.get, None))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.wait(lambda: self.complete or self.ended)

    def send(self, request):
        self._requests.put(request)

    def wait(self, holds, seconds=30):
        with self._changed:
            if not self._changed.wait_for(holds, seconds):
                raise AssertionError("waited too long for the server")
        return self

    def close(self):
        self._requests.put(None)
        self._reader.join(20)

    def cut(self, tool, path, *, lease=None, level=0, body=0, rpm=20000, us=8000, author_seq=None):
        """The next cut of this author; not sent yet."""
        self.author_seq = author_seq or self.author_seq + 1
        return wire.Cut(self.member.author, self.author_seq, self.lease if lease is None else lease, body, tool, level,
                        [wire.Pose.at(p) if not isinstance(p, wire.Pose) else p for p in path], rpm, us)

    def send_cut(self, cut):
        self.send(cutting.SessionRequest(cut=to_message(cut)))
        return cut

    def decision(self, author_seq):
        """What the room has decided of an own cut: ("cut" | "rejected", room_seq, code or None)."""
        for event in list(self.events):
            if event[0] in ("cut", "rejected") and event[2] == (self.member.author, author_seq):
                return event
        return None

    def decided(self, cut):
        self.wait(lambda: self.decision(cut.author_seq) or self.ended)
        return self.decision(cut.author_seq)

    def take(self, index, event):
        """An event of the stream or of a datagram. The first copy counts."""
        with self._changed:
            if index >= self._next:
                self._held.setdefault(index, event)
            while self._next in self._held:
                self._deliver(self._held.pop(self._next))
                self._next += 1
            self._changed.notify_all()

    @property
    def taken(self):
        return self._next - 1

    def beyond(self):
        """Bits for the 64 entries after the missing one, as datagrams report them."""
        return sum(1 << bit for bit in range(64) if self._next + 1 + bit in self._held)

    def _deliver(self, event):
        self.events.append(event)
        if event[0] == "rejected":
            self.lease = event[4]
        if event[0] == "supervised":
            self.supervised, self.lease = event[3], event[4]
        if event[0] == "change" and event[3].lease_epoch:
            self.lease = max(self.lease, event[3].lease_epoch)

    def _read(self):
        try:
            for message in self._call:
                self._take(message)
        except grpc.RpcError as error:
            self.ended = error
        with self._changed:
            self.ended = self.ended or "ended"
            self._changed.notify_all()

    def _take(self, message):
        kind = message.WhichOneof("message")
        body = getattr(message, kind)
        if message.index:
            return self.take(message.index, event_of(kind, body, self.member.author))
        with self._changed:
            if kind == "leaf":
                self.leaves[(body.body, body.level, body.origin.x, body.origin.y, body.origin.z)] = body.values
            elif kind == "tool":
                self.tools[body.tool.tool_hash] = body.tool
                self.numbers[body.tool_number] = body.tool.tool_hash
            elif kind == "partner":
                if body.state_seq > self.partners.get(body.author, types.CuttingState()).state_seq:
                    self.partners[body.author] = body
            elif kind in ("complete", "durable", "scene", "redial"):
                setattr(self, kind, body)
                if kind == "complete":
                    self.lease, self.author_seq = body.lease_epoch, body.decided_author_seq
            elif kind == "link":
                self.offer = body
            elif kind == "supervised":
                self.supervised = body.supervision
            elif kind in ("committed", "rejected"):  # decided before: an answer to a cut that was sent again
                self.events.append(event_of(kind, body, self.member.author))
            self._changed.notify_all()
        return None


def event_of(kind, body, own):
    if kind == "committed":
        return "cut", body.room_seq, (body.cut.author, body.cut.author_seq), body.cut, None
    if kind == "rejected":
        return "rejected", body.room_seq, (own, body.author_seq), body.code, body.lease_epoch
    if kind == "supervised":
        return "supervised", body.room_seq, None, body.supervision, body.lease_epoch
    return kind, body.room_seq, None, body, None


def to_message(cut):
    return types.Cut(author=cut.author, author_seq=cut.author_seq, lease_epoch=cut.lease_epoch, body=cut.body,
                     tool_hash=cut.tool, level=cut.level,
                     path=[types.QuantisedPose(position=p.numbers[:3], rotation=p.numbers[3:]) for p in cut.path],
                     spindle_rpm=cut.spindle_rpm, path_us=cut.path_us)


def from_message(cut):
    return wire.Cut(cut.author, cut.author_seq, cut.lease_epoch, cut.body, cut.tool_hash, cut.level,
                    [wire.Pose(tuple(p.position) + tuple(p.rotation)) for p in cut.path], cut.spindle_rpm, cut.path_us)


class KeysDown:
    """The keys of the server's datagrams, by generation. Follows the server to later ones."""

    def __init__(self, key):
        self._keys = [key]

    def open(self, datagram):
        """(session, generation, counter, plain) as wire.open_sealed(). Raises wire.Broken."""
        newest = len(self._keys) - 1
        ahead = (datagram[4] - newest) % 256 if len(datagram) > 4 else 0
        if ahead > 8 and ahead != 255:
            raise wire.Broken("a datagram is of an impossible generation")
        keys = list(self._keys)
        while ahead <= 8 and len(keys) <= newest + ahead:
            keys.append(wire.next_key(keys[-1]))
        opened = wire.open_sealed(datagram, keys[-2] if ahead == 255 and newest else keys[-1])
        self._keys = keys
        return opened


class FastPath:
    """Cuts and entries in sealed datagrams, beside a session's stream. Sends a packet every few milliseconds."""

    def __init__(self, session, port=None):
        self.session = session
        offer = session.offer
        self._up, self._down = bytes(offer.key_up), KeysDown(bytes(offer.key_down))
        self._session, self._generation, self._counter = offer.session, 0, 1
        self._to = (session.member.address.rpartition(":")[0], port or offer.udp_port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(0.004)
        self._waiting = []  # cuts that are not acknowledged
        self._lock = threading.Lock()
        self._echo, self._echoes = b"", 0
        self._seen, self._newest, self._packets, self._times = set(), 0, 0, (0, 0)
        self._state, self._left = None, []
        self.frozen, self.entries, self.unknown = False, 0, 0
        self.partners = {}  # author -> newest ToolState
        self.heard = collections.Counter()  # datagrams by generation of their key
        self._over = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send_cut(self, cut):
        with self._lock:
            self._waiting.append(cut)
        return cut

    def show(self, state):
        """The newest ToolState of the tool. Goes with all packets from now on."""
        self._state = state

    def next_key(self):
        """Seals with the next key from now on."""
        with self._lock:
            self._up, self._generation = wire.next_key(self._up), self._generation + 1

    def move(self):
        """Goes on from another port of this machine."""
        with self._lock:
            self._left.append(self._socket)
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.settimeout(0.004)

    def close(self):
        self._over = True
        self._thread.join(20)
        for one in (*self._left, self._socket):
            one.close()

    def _run(self):
        due = 0.0
        while not self._over:
            now = time.monotonic()
            if now >= due:
                self._send(now)
                due = now + 0.008
            with contextlib.suppress(OSError, wire.Broken):  # nothing came, or nothing of the server's
                self._receive(self._socket.recv(wire.MOST_DATAGRAM))

    def _send(self, now):
        packet = link.UpPacket(acknowledged=self.session.taken, acknowledged_beyond=self.session.beyond())
        packet.times.sent_us = int(now * 1e6)
        packet.times.received_counter, packet.times.received_packets = self._newest, self._packets
        packet.times.echo_sent_us, packet.times.echo_received_us = self._times
        if self._echoes:
            packet.path_echo, self._echoes = self._echo, self._echoes - 1
        if self._state:
            packet.state.CopyFrom(self._state)
        with self._lock:
            packet.cuts.extend(runs_of(self._waiting[:4], self.session.numbers))
            datagram = wire.seal(self._session, self._generation, self._counter, self._up, packet.SerializeToString())
            self._counter += 1
            self._socket.sendto(datagram, self._to)

    def _receive(self, datagram):
        session, generation, counter, plain = self._down.open(datagram)
        if session != self._session or counter in self._seen:
            return
        self._seen.add(counter)
        self.heard[generation] += 1
        packet = link.DownPacket.FromString(plain)
        if packet.path_challenge:
            self._echo, self._echoes = packet.path_challenge, 8
            return
        self._packets += 1
        if counter > self._newest:
            self._newest, self.frozen = counter, packet.frozen
            self._times = packet.times.sent_us, int(time.monotonic() * 1e6)
        with self._lock:
            self._waiting = [cut for cut in self._waiting if cut.author_seq > packet.acknowledged]
        for state in packet.partners:
            if state.state_seq > self.partners.get(state.author, link.ToolState()).state_seq:
                self.partners[state.author] = state
        for run in packet.entries:
            tool = run.head.tool_hash or self.session.numbers.get(run.head.tool_number)
            if tool is None:
                self.unknown += 1
                continue
            for index, seq, cut in wire.read_entries(run.author, run.index, run.room_seq, run.head, tool, run.entries):
                self.entries += 1
                self.session.take(index, ("cut", seq, (cut.author, cut.author_seq), to_message(cut), None))
        for entry in packet.rejected:
            self.entries += 1
            self.session.take(entry.index, ("rejected", entry.room_seq, (self.session.member.author, entry.author_seq),
                                            entry.reason, entry.lease_epoch))
        for entry in packet.supervised:
            self.session.take(entry.index,
                              ("supervised", entry.room_seq, None, entry.supervision, entry.lease_epoch))


def runs_of(cuts, numbers):
    """The cuts as CutRuns: one for consecutive cuts that have a head in common. `numbers`: of the session's tools."""
    tools, runs, before = {tool: number for number, tool in numbers.items()}, [], None
    for cut in cuts:
        start, rpm, us = cut.path[0], cut.spindle_rpm, cut.path_us
        if before and head_of(cut) == (before.author_seq + 1, *head_of(before)[1:]):
            start, rpm, us = before.path[-1], before.spindle_rpm, before.path_us
        else:
            runs.append(link.CutRun(author_seq=cut.author_seq, lease_epoch=cut.lease_epoch, body=cut.body,
                                    level=cut.level, spindle_rpm=rpm, start=start.numbers, path_us=us))
            if cut.tool in tools:
                runs[-1].tool_number = tools[cut.tool]
            else:
                runs[-1].tool_hash = cut.tool
        runs[-1].cuts += wire.coded_cut(cut, start, rpm, us)
        before = cut
    return runs


def head_of(cut):
    return cut.author_seq, cut.lease_epoch, cut.body, cut.tool, cut.level
