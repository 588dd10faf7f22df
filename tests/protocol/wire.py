"""What deploy/docs/protocol.md says, without gRPC: hashes, surface blocks, coded cuts and sealed datagrams.

Written from that page. It shares no code with Osteon's programs.
"""
import ctypes
import ctypes.util
import functools
import hashlib
import math
import struct
from dataclasses import dataclass, field


class Broken(ValueError):
    """Bytes that no correct sender writes."""


# --- hashes


class Hasher:
    """SHA-256 over values. Integers and floats take 8 bytes, little endian; a text begins with its length."""

    def __init__(self):
        self._sha = hashlib.sha256()

    def bytes(self, data):
        self._sha.update(data)

    def integer(self, value):
        self._sha.update(struct.pack("<Q", value & (1 << 64) - 1))

    def index(self, value):
        """A signed number of 32 bits, of which the hash takes the bits without sign."""
        self.integer(value & 0xFFFFFFFF)

    def number(self, value):
        self._sha.update(struct.pack("<d", value))

    def text(self, value):
        data = value.encode() if isinstance(value, str) else value
        self.integer(len(data))
        self.bytes(data)

    def digest(self):
        return self._sha.digest()


def sha256(data):
    return hashlib.sha256(data).digest()


def check_digest(data, digest):
    if sha256(data) != digest:
        raise Broken("a digest does not fit its bytes")


def first_chain(genesis):
    hasher = Hasher()
    hasher.text("osteon journal")
    hasher.text(genesis)
    return hasher.digest()


def next_chain(chain, seq, at_ns, entry):
    hasher = Hasher()
    hasher.bytes(chain)
    hasher.integer(seq)
    hasher.integer(at_ns)
    hasher.text(entry)
    return hasher.digest()


def witness_seal(key, seq, chain):
    """The seal of DurableSeq. `key`: the journal's register "witness key"."""
    hasher = Hasher()
    hasher.text("osteon witness")
    hasher.text(key)
    hasher.integer(seq)
    hasher.bytes(chain)
    return hasher.digest()


def signed_entries(since, seq, chain):
    """What a server signs for the log entries from `since` to `seq`."""
    hasher = Hasher()
    hasher.text("osteon journal rows")
    hasher.integer(since)
    hasher.integer(seq)
    hasher.text(chain)
    return hasher.digest()


def signed_register(name, value, genesis):
    """What a server signs for a register of the journal with that genesis."""
    register = Hasher()
    for text in ("register", name, value):
        register.text(text)
    hasher = Hasher()
    for text in ("osteon journal entry", first_chain(genesis), register.digest()):
        hasher.text(text)
    return hasher.digest()


def signed_succession(before, after):
    """What both keys sign when one public key takes over from another."""
    hasher = Hasher()
    for text in ("osteon signing key follows", before, after):
        hasher.text(text)
    return hasher.digest()


def check_signature(public_key, message, signature):
    """Ed25519."""
    if len(public_key) != 32 or len(signature) != 64:
        raise Broken("a key or signature has an impossible length")
    if sodium().crypto_sign_verify_detached(signature, message, ctypes.c_ulonglong(len(message)), public_key):
        raise Broken("a signature is not of this key")


def surface_hash(blocks):
    """`blocks`: {(body, level, x, y, z): SHA-256 of the payload} of all blocks that have a surface."""
    hasher = Hasher()
    for (body, level, *index), digest in sorted(blocks.items()):
        hasher.integer(body)
        hasher.integer(level)
        for i in index:
            hasher.index(i)
        hasher.bytes(digest)
    return hasher.digest()


TOOL_KINDS = ("drill", "round-burr", "end-drill", "barrel-burr", "contoured-burr", "oscillating-saw",
              "reciprocating-saw", "sphere-reamer", "cylinder-reamer", "outside-reamer", "broach", "drill-sleeve",
              "distal-block", "four-in-one-block", "pin", "screw", "trial-cup", "trial-stem", "mesh")
TOOL_NUMBERS = ("diameter_mm", "cutting_length_mm", "point_angle_rad", "shank_diameter_mm", "shank_length_mm",
                "width_mm", "thickness_mm", "set_mm", "swing_rad", "stroke_mm", "pivot_mm", "taper_rad", "corner_mm",
                "bore_mm", "thread_pitch_mm", "core_diameter_mm", "spindle_rpm", "feed_mm_per_rev")


def tool_fields(definition):
    """The fields of a tool's YAML, one "name: value" on each line. Not for a tool made from a mesh."""
    fields = dict(line.split(": ", 1) for line in definition.strip().splitlines())
    return {name: value.strip('"') for name, value in fields.items()}


def tool_hash(definition):
    fields = tool_fields(definition)
    part = {"round-burr": 1.0, "sphere-reamer": 0.5, "trial-cup": 0.5}.get(fields["kind"])
    if part:  # the length of the cutting part follows from the diameter
        fields["cutting_length_mm"] = part * float(fields["diameter_mm"])
    hasher = Hasher()
    hasher.text(fields["name"])
    hasher.text(fields["title"])
    hasher.integer(TOOL_KINDS.index(fields["kind"]) + 1)
    for name in TOOL_NUMBERS:
        degrees = fields.get(name.replace("_rad", "_deg")) if name.endswith("_rad") else None
        hasher.number(float(degrees) * (math.pi / 180) if degrees is not None else float(fields.get(name, 0)))
    hasher.integer(int(fields.get("teeth", 0)))
    hasher.integer(int(fields.get("cut_level", 0)))
    hasher.integer(0)  # samples of a mesh
    if "law" in fields:
        hasher.text(fields["law"])
    return hasher.digest()


BAND_VOXELS = 4  # distances beyond this many samples of the level are cut off


def band(pitch_mm, level):
    """The value of a sample that no tool has come near, in steps of 2^-10 mm."""
    return int(BAND_VOXELS * (pitch_mm / 2 ** level) * 1024)


def field_hash(leaves, pitch_mm):
    """`leaves`: {(body, level, x, y, z): 512 values}. A leaf that no tool has reached counts as absent."""
    hasher = Hasher()
    for (body, level, *origin), values in sorted(leaves.items()):
        if all(value == band(pitch_mm, level) for value in values):
            continue
        hasher.integer(body)
        hasher.integer(level)
        for i in origin:
            hasher.index(i)
        hasher.bytes(struct.pack("<512h", *values))
    return hasher.digest()


# --- surface blocks

CELLS, SAMPLES = 16, 17  # along a block's edge
PLACES = 252  # positions along a cell's edge
COUNT = SAMPLES ** 3
STRIDE = (SAMPLES * SAMPLES, SAMPLES, 1)
COVERED, SEAMS, ALL_CUT, SOME_CUT, TISSUE = 1, 2, 4, 8, 16


@dataclass
class Mesh:
    positions: list = field(default_factory=list)  # (x, y, z), mm, rounded to 32 bits
    normals: list = field(default_factory=list)
    cut: list = field(default_factory=list)  # True on a face that a tool has made
    tissue: list = field(default_factory=list)  # 0 bone, 1 metal, 2 enamel
    triangles: list = field(default_factory=list)


class Bytes:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        if self.at + count > len(self.data):
            raise Broken("the payload ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def byte(self):
        return self.take(1)[0]

    def varint(self):
        value = 0
        for shift in range(0, 64, 7):
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value & (1 << 64) - 1
        raise Broken("a number has more than 64 bits")

    def left(self):
        return len(self.data) - self.at


def read_rows(data):
    """The solid bits of the 17 x 17 rows of samples, bit z of rows[x][y]."""
    rows = [[0] * SAMPLES for _ in range(SAMPLES)]
    same = 0
    for x in range(SAMPLES):
        for y in range(SAMPLES):
            difference = 0
            if same > 0:
                same -= 1
            else:
                byte = data.byte()
                if byte < 64:
                    same = byte
                elif byte < 64 + 11 * SAMPLES:
                    length, start = (byte - 64) // SAMPLES + 1, (byte - 64) % SAMPLES
                    difference = ((1 << length) - 1) << start
                elif byte == 255:
                    difference = int.from_bytes(data.take(3), "little")
                else:
                    raise Broken("a row has an unknown code")
            if difference >= 1 << SAMPLES:
                raise Broken("a row has more than 17 samples")
            rows[x][y] = difference ^ expected_row(rows, x, y)
    if same:
        raise Broken("a run of rows goes beyond the block")
    return rows


def coded_rows(rows):
    """What read_rows() reads."""
    out, same = b"", 0
    for x in range(SAMPLES):
        for y in range(SAMPLES):
            difference = rows[x][y] ^ expected_row(rows, x, y)
            if difference == 0:
                same += 1
                continue
            out += coded_same(same)
            same = 0
            start = (difference & -difference).bit_length() - 1
            length = (difference >> start).bit_length()
            if difference >> start == (1 << length) - 1 and length <= 11:
                out += bytes([64 + (length - 1) * SAMPLES + start])
            else:
                out += b"\xff" + difference.to_bytes(3, "little")
    return out + coded_same(same)


def coded_same(rows):
    return b"\x3f" * (rows // 64) + (bytes([rows % 64 - 1]) if rows % 64 else b"")


def expected_row(rows, x, y):
    a = rows[x][y - 1] if y > 0 else 0
    b = rows[x - 1][y] if x > 0 else 0
    c = rows[x - 1][y - 1] if x > 0 and y > 0 else 0
    return ((a & b) | (~c & (a ^ b))) & (1 << SAMPLES) - 1


def read_seams(data):
    where = int.from_bytes(data.take(8), "little")
    places = [i for i in range(64) if where >> i & 1]
    packed = data.take((len(places) + 1) // 2)
    coarser = [0] * 64
    for n, i in enumerate(places):
        coarser[i] = packed[n // 2] >> (n % 2 * 4) & 15
        if is_inner(i) or not 1 <= coarser[i] <= 4:
            raise Broken("a seam is where none can be")
    return coarser


def is_inner(half_block):
    """Whether one of the 4³ half blocks belongs to the block itself."""
    return all(k in (1, 2) for k in (half_block // 16, half_block // 4 % 4, half_block % 4))


class SeamRule:
    """How many levels coarser the contour is at each place: 0, 2, 4 are planes between half blocks, 1 and 3 inside."""

    def __init__(self, coarser):
        self.any = any(coarser)
        self._steps = {}
        around = {0: (0, 1), 1: (1,), 2: (1, 2), 3: (2,), 4: (2, 3)}
        for x in range(5):
            for y in range(5):
                for z in range(5):
                    self._steps[x, y, z] = max(coarser[(i * 4 + j) * 4 + k]
                                               for i in around[x] for j in around[y] for k in around[z])

    def steps(self, place):
        return self._steps[tuple(place)]


# Corner i of a cell is at (i >> 2 & 1, i >> 1 & 1, i & 1). An edge is (its lower corner, its axis).
EDGES = [(corner, axis) for axis in range(3) for corner in range(8) if not corner & (4 >> axis)]
# Corners of the six faces, counter-clockwise seen from outside.
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@functools.lru_cache(maxsize=None)
def cell_triangles(solid):
    """Triangles of a cell as triples of indices into EDGES. `solid`: bit i for each solid corner."""

    def edge(a, b):
        return EDGES.index((a & b, {4: 0, 2: 1, 1: 2}[a ^ b]))

    following = {}
    for face in FACES:
        for i in range(4):
            if solid >> face[i] & 1 or not solid >> face[(i + 1) % 4] & 1:
                continue
            end = (i + 1) % 4
            while solid >> face[(end + 1) % 4] & 1:
                end = (end + 1) % 4
            following[edge(face[i], face[(i + 1) % 4])] = edge(face[end], face[(end + 1) % 4])
    triangles = []
    for start in range(12):
        loop, at = [], start
        while at in following:
            loop.append(at)
            at = following.pop(at)
        triangles += [(loop[0], loop[i - 1], loop[i]) for i in range(2, len(loop))]
    return tuple(triangles)


def sample(x, y, z):
    return x * STRIDE[0] + y * STRIDE[1] + z


class Contour:
    """Vertices and triangles that follow from the solid bits, the covered groups and the seams."""

    def __init__(self, rows, covered, rule):
        self.rows = rows
        self.cells = [(x, y, z) for x in range(CELLS) for y in range(CELLS) for z in range(CELLS)
                      if 0 < self._case(x, y, z) < 255 and not covered >> ((x // 4 * 4 + y // 4) * 4 + z // 4) & 1]
        used = set()
        for x, y, z in self.cells:
            case = self._case(x, y, z)
            for corner, axis in EDGES:
                if (case >> corner & 1) != (case >> (corner | 4 >> axis) & 1):
                    used.add(self._edge(x, y, z, corner, axis))
        self.used, self.moved = used, {}
        if rule.any:
            self._collapse(rule)
        # In order of the rows of samples, then of the axis, then of z.
        self.edges = sorted(used, key=lambda edge: (edge % COUNT // SAMPLES, edge // COUNT, edge % SAMPLES))
        self.vertex = {edge: number for number, edge in enumerate(self.edges)}
        for edge, to in self.moved.items():
            self.vertex[edge] = self.vertex[to]

    def _solid(self, number):
        return self.rows[number // STRIDE[0]][number // SAMPLES % SAMPLES] >> (number % SAMPLES) & 1

    def _case(self, x, y, z):
        case = 0
        for i in range(8):
            case |= (self.rows[x + (i >> 2)][y + (i >> 1 & 1)] >> (z + (i & 1)) & 1) << i
        return case

    @staticmethod
    def _edge(x, y, z, corner, axis):
        return axis * COUNT + sample(x + (corner >> 2), y + (corner >> 1 & 1), z + (corner & 1))

    def triangles(self):
        for x, y, z in self.cells:
            for triangle in cell_triangles(self._case(x, y, z)):
                corners = [self.vertex[self._edge(x, y, z, *EDGES[edge])] for edge in triangle]
                if len(set(corners)) == 3:
                    yield tuple(corners)

    def _collapse(self, rule):
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for side in (0, CELLS):
                for quarter in range(4):
                    place = [0, 0, 0]
                    place[axis] = side // 4
                    place[u], place[v] = 1 + quarter // 2 * 2, 1 + quarter % 2 * 2
                    steps = rule.steps(place)
                    if steps == 0:
                        continue
                    cells = 1 << steps
                    for a in range(quarter // 2 * 8, quarter // 2 * 8 + 8, cells):
                        for b in range(quarter % 2 * 8, quarter % 2 * 8 + 8, cells):
                            if a % cells == 0 and b % cells == 0:
                                origin = [0, 0, 0]
                                origin[axis], origin[u], origin[v] = side, a, b
                                self._collapse_face(origin, axis, cells)

    def _collapse_face(self, origin, axis, cells):
        """Follows the contour over a coarse face from each end. Vertices between go to the nearer end."""
        u, v = (axis + 1) % 3, (axis + 2) % 3
        first = sample(*origin)

        def corner(i, j, k):
            return self._solid(first + (i + (k in (1, 2))) * STRIDE[u] + (j + (k in (2, 3))) * STRIDE[v])

        def crossed(i, j, k):
            return corner(i, j, k) != corner(i, j, (k + 1) % 4)

        def number(i, j, k):
            return (first + (i + (k == 1)) * STRIDE[u] + (j + (k == 2)) * STRIDE[v] +
                    (u if k % 2 == 0 else v) * COUNT)

        def follow(i, j, k):
            path = []
            while True:
                path.append(number(i, j, k))
                if all(crossed(i, j, other) for other in range(4)):
                    out = (k + 3) % 4 if corner(i, j, k) else (k + 1) % 4
                else:
                    out = next(other for other in range(3, -1, -1) if other != k and crossed(i, j, other))
                i += (out == 1) - (out == 3)
                j += (out == 2) - (out == 0)
                k = (out + 2) % 4
                if not (0 <= i < cells and 0 <= j < cells):
                    path.append(number(i, j, k))
                    return path

        def start(i, j, k):
            if not crossed(i, j, k):
                return
            path = follow(i, j, k)
            if path[0] > path[-1]:
                return
            for p in range(1, len(path) - 1):
                to = path[0] if 2 * p < len(path) else path[-1]
                if path[p] in self.used and to in self.used:
                    self.used.discard(path[p])
                    self.moved[path[p]] = to

        for i in range(cells):
            start(i, 0, 0)
            start(i, cells - 1, 2)
            start(0, i, 3)
            start(cells - 1, i, 1)


def single(value):
    """Rounds to 32 bits."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def read_normal(a, b):
    u, v = a / 255 * 2 - 1, b / 255 * 2 - 1
    w = 1 - abs(u) - abs(v)
    if w < 0:
        u, v = ((1 - abs(v)) * (-1 if u < 0 else 1), (1 - abs(u)) * (-1 if v < 0 else 1))
    length = math.sqrt(u * u + v * v + w * w)
    return u / length, v / length, w / length


def decode_block(index, payload, level_pitch_mm):
    """The mesh of one block. `index`: its position in blocks of its level."""
    mesh = Mesh()
    if not payload:
        return mesh
    data = Bytes(payload)
    flags = data.byte()
    if flags > 31 or flags & ALL_CUT and flags & SOME_CUT:
        raise Broken("the flags mean nothing")
    covered = int.from_bytes(data.take(8), "little") if flags & COVERED else 0
    coarser = read_seams(data) if flags & SEAMS else [0] * 64
    rows = read_rows(data)
    contour = Contour(rows, covered, SeamRule(coarser))
    count = len(contour.edges)
    places, normals = data.take(count), data.take(2 * count)
    cuts = data.take((count + 7) // 8) if flags & SOME_CUT else b""
    tissue = data.take((count + 3) // 4) if flags & TISSUE else b""
    if data.left():
        raise Broken("the payload is too long")
    for n, edge in enumerate(contour.edges):
        axis, number = edge // COUNT, edge % COUNT
        if places[n] > PLACES:
            raise Broken("a vertex is beyond its edge")
        at = [(index[k] * CELLS + i) * PLACES
              for k, i in enumerate((number // STRIDE[0], number // SAMPLES % SAMPLES, number % SAMPLES))]
        at[axis] += places[n]
        mesh.positions.append(tuple(single(i * (level_pitch_mm / PLACES)) for i in at))
        mesh.normals.append(read_normal(normals[2 * n], normals[2 * n + 1]))
        mesh.cut.append(bool(cuts[n // 8] >> (n % 8) & 1) if cuts else bool(flags & ALL_CUT))
        kind = tissue[n // 4] >> (n % 4 * 2) & 3 if tissue else 0
        if kind == 3:
            raise Broken("a tissue does not exist")
        mesh.tissue.append(kind)
    mesh.triangles = list(contour.triangles())
    return mesh


# --- cuts in few bytes


@dataclass
class Pose:
    """Seven integers: x, y, z in steps of 2^-10 mm, then the quaternion x, y, z, w in steps of 1/32767."""
    numbers: tuple

    @staticmethod
    def at(position_mm, rotation=(0.0, 0.0, 0.0, 1.0)):
        return Pose(tuple(round(1024 * p) for p in position_mm) + tuple(round(32767 * r) for r in rotation))


def wrapped(value, i):
    """`value` as a signed number of 32 bits (position) or 16 bits (rotation)."""
    bits = 32 if i < 3 else 16
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


def zigzag(value):
    return (value << 1 if value >= 0 else (-value << 1) - 1) & (1 << 64) - 1


def unzigzag(value):
    return value >> 1 if value & 1 == 0 else -(value + 1 >> 1)


def varint(value):
    out = bytearray()
    while value >= 128:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


@dataclass
class Cut:
    author: int
    author_seq: int
    lease_epoch: int
    body: int
    tool: bytes  # the tool's hash
    level: int
    path: list  # of Pose
    spindle_rpm: int
    path_us: int


def coded_cut(cut, start, before_rpm, before_us):
    """A cut that continues from the pose `start`, after one with that speed and time."""
    own_first = not cut.path or cut.path[0] != start
    knots = cut.path if own_first else cut.path[1:]
    own_speed, own_time = cut.spindle_rpm != before_rpm, cut.path_us != before_us
    out = varint(len(knots) << 3 | own_speed << 2 | own_first << 1 | own_time)
    if own_time:
        out += varint(cut.path_us)
    if own_speed:
        out += varint(zigzag(cut.spindle_rpm - before_rpm))
    last, step = start.numbers, (0,) * 7
    for knot in knots:
        moved = tuple(wrapped(last[i] + step[i], i) for i in range(7))
        out += min(coded_pose(knot.numbers, last, 0), coded_pose(knot.numbers, moved, 128), key=len)
        step = tuple(wrapped(knot.numbers[i] - last[i], i) for i in range(7))
        last = knot.numbers
    return out


def coded_pose(numbers, expected, flag):
    rest = b""
    for i in range(7):
        if numbers[i] != expected[i]:
            flag |= 1 << i
            rest += varint(zigzag(wrapped(numbers[i] - expected[i], i)))
    return bytes([flag]) + rest


def read_cut(data, start, rpm, us):
    """(path, spindle_rpm, path_us) of a coded cut that continues from `start`."""
    what = data.varint()
    if what & 1:
        us = data.varint()
    if what & 4:
        rpm += unzigzag(data.varint())
    if not (0 <= rpm < 1 << 32 and us < 1 << 32):
        raise Broken("a speed or a time has more than 32 bits")
    path = [] if what & 2 else [start]
    last, step = start.numbers, (0,) * 7
    for _ in range(what >> 3):
        flag = data.byte()
        knot = [wrapped(last[i] + (step[i] if flag & 128 else 0), i) for i in range(7)]
        for i in range(7):
            if flag >> i & 1:
                difference = unzigzag(data.varint())
                if wrapped(difference, i) != difference:
                    raise Broken("a difference is too large")
                knot[i] = wrapped(knot[i] + difference, i)
        step = tuple(wrapped(knot[i] - last[i], i) for i in range(7))
        last = tuple(knot)
        path.append(Pose(last))
    return path, rpm, us


def read_entries(author, index, room_seq, head, tool, entries):
    """[(index, room_seq, Cut)] of an EntryRun. `head`: its CutRun, `tool`: the hash that it names."""
    data = Bytes(entries)
    if not entries:
        raise Broken("a run has no entries")
    pose, rpm, us = Pose(tuple(head.start)), head.spindle_rpm, head.path_us
    if len(pose.numbers) != 7:
        raise Broken("a pose needs seven numbers")
    author_seq, first, out = head.author_seq, True, []
    while data.left():
        what = data.varint()
        index_step = (what >> 1) + 1
        room_step, author_step = index_step, 1
        if what & 1:
            room_step += unzigzag(data.varint())
            author_step += data.varint()
        if not first:
            index, room_seq, author_seq = index + index_step, room_seq + room_step, author_seq + author_step
        first = False
        path, rpm, us = read_cut(data, pose, rpm, us)
        if path:
            pose = path[-1]
        out.append((index, room_seq,
                    Cut(author, author_seq, head.lease_epoch, head.body, tool, head.level, path, rpm, us)))
    return out


# --- sealed datagrams

MOST_DATAGRAM = 1100
HEADER, TAG = 13, 16


@functools.lru_cache(maxsize=None)
def sodium():
    library = ctypes.CDLL(ctypes.util.find_library("sodium") or "libsodium.so.23")
    if library.sodium_init() < 0:
        raise RuntimeError("libsodium does not start")
    return library


def next_key(key):
    """The key of the next generation."""
    salt, person = struct.pack("<QQ", 1, 0), b"osteonUD" + bytes(8)
    return hashlib.blake2b(digest_size=32, key=key, salt=salt, person=person).digest()


def seal(session, generation, counter, key, plain):
    header = struct.pack("<IBQ", session, generation & 255, counter)
    out = ctypes.create_string_buffer(len(plain) + TAG)
    sodium().crypto_aead_chacha20poly1305_ietf_encrypt(
        out, None, plain, ctypes.c_ulonglong(len(plain)), header, ctypes.c_ulonglong(HEADER), None,
        bytes(4) + struct.pack("<Q", counter), key)
    return header + out.raw


def open_sealed(datagram, key):
    """(session, generation, counter, plain). Raises Broken if the datagram was not sealed with the key."""
    if not HEADER + TAG <= len(datagram) <= MOST_DATAGRAM:
        raise Broken("a datagram has no possible length")
    session, generation, counter = struct.unpack("<IBQ", datagram[:HEADER])
    body = datagram[HEADER:]
    out = ctypes.create_string_buffer(max(1, len(body) - TAG))
    if sodium().crypto_aead_chacha20poly1305_ietf_decrypt(
            out, None, None, body, ctypes.c_ulonglong(len(body)), datagram[:HEADER], ctypes.c_ulonglong(HEADER),
            bytes(4) + struct.pack("<Q", counter), key):
        raise Broken("a datagram was not sealed with the key")
    return session, generation, counter, out.raw[:len(body) - TAG]
