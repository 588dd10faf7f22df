"""A client that was written from deploy/docs/protocol.md, against real servers. See stage.py."""
import contextlib
import math
import queue
import threading
import time
import unittest

import grpc

import client
import wire
from client import CODES, cutting, field, field_grpc, people, people_grpc, room, types, watch
from stage import (CONSOLE, VIEWER, Case, bag, full, metal_case, open_edges, run, stl_triangles,
                   until_cancelled, volume_mm3)


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
        self.check_vertices(after)
        summary = self.server.stop()
        self.assertEqual(after.hash().hex(), summary["mesh_hash"])


    def check_vertices(self, surface):
        """Flags and normals of a block 20 x 20 x 10 mm, in which a ball of 3.2 mm went along x, 1 to 4.2 mm deep."""
        seen = {True: 0, False: 0}
        for key, payload in surface.blocks.items():
            mesh = client.mesh_of(key, payload, self.hand.joined.pitch_mm)
            for at, normal, is_cut in zip(mesh.positions, mesh.normals, mesh.cut):
                self.assertAlmostEqual(math.hypot(*normal), 1, places=6)
                centre = (min(max(at[0], -2), 2), 0, -2.6)  # of the ball when it was nearest
                self.assertEqual(is_cut, math.dist(at, centre) < 2, at)
                if is_cut:
                    expected = [(c - a) / math.dist(at, centre) for a, c in zip(at, centre)]  # out of the bone
                else:
                    faces = (abs(at[0]), abs(at[1]), at[2] if at[2] > -5 else -10 - at[2])
                    if sorted(abs(f - (0 if i == 2 else 10)) for i, f in enumerate(faces))[1] < 1:
                        continue  # an edge of the block has no single normal
                    axis = min(range(3), key=lambda i: abs(faces[i] - (0 if i == 2 else 10)))
                    middle = (0, 0, -5)
                    expected = [math.copysign(1, at[i] - middle[i]) if i == axis else 0 for i in range(3)]
                self.assertGreater(sum(n * e for n, e in zip(normal, expected)), 0.97, (at, normal, expected))
                seen[is_cut] += 1
        self.assertGreater(min(seen.values()), 500)


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


class TheMetal(Case):
    """A bone whose middle layer, z from -6 to -3, is metal."""

    def prepare(self):
        metal_case(self.folder)

    def test_is_marked_and_is_not_cut(self):
        surface = self.surface()
        run("osteon-import", "surface", self.server.case, "--out", self.folder / "bone.stl")
        self.assertEqual(bag(surface.triangles()), bag(stl_triangles(self.folder / "bone.stl")))
        depths = {0: [], 1: [], 2: []}
        for key, payload in surface.blocks.items():
            mesh = client.mesh_of(key, payload, self.hand.joined.pitch_mm)
            for position, tissue in zip(mesh.positions, mesh.tissue):
                if max(abs(position[0]), abs(position[1])) > 5 and -8 < position[2] < -1:  # the sides
                    depths[tissue].append(position[2])
        pitch = self.hand.joined.pitch_mm
        self.assertGreater(len(depths[0]), 100)
        self.assertGreater(len(depths[1]), 100)
        self.assertTrue(all(-6 - 3 * pitch < z < -3 + 3 * pitch for z in depths[1]), "metal is in its layer")
        self.assertFalse(any(-6 + 3 * pitch < z < -3 - 3 * pitch for z in depths[0]), "and is all of it")

        into = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -4)]))
        self.assertEqual(self.session.decided(into)[3], CODES["METAL"])
        # The tip points up, so the burr is below it.
        above = self.session.send_cut(self.session.cut(self.burr, [(0, 0, 1.5)]))
        self.assertEqual(self.session.decided(above)[0], "cut")


class TheField(Case):
    def test_hashes_of_tools(self):
        self.assertGreaterEqual(len(self.session.tools), 24)
        for digest, tool in self.session.tools.items():
            self.assertEqual(wire.tool_hash(tool.yaml), digest, tool.yaml)

    def test_a_tool_of_ones_own(self):
        yaml = ('name: own\ntitle: "My burr"\nkind: round-burr\ndiameter_mm: 2.5\nshank_diameter_mm: 2\n'
                'shank_length_mm: 40\nspindle_rpm: 30000\nteeth: 6\nfeed_mm_per_rev: 0.03\ncut_level: 0\n')
        added = self.hand.rooms.AddTool(room.AddToolRequest(
            author=self.hand.author, tool=types.ToolDefinition(yaml=yaml)), timeout=20)
        self.assertEqual(added.tool_hash, wire.tool_hash(yaml))
        self.session.wait(lambda: any(e[0] == "tool" for e in self.session.events))
        told = next(e for e in self.session.events if e[0] == "tool")
        self.assertEqual((told[1], told[3].tool.tool_hash), (added.room_seq, added.tool_hash))
        self.assertNotIn(told[3].tool_number, self.session.numbers)
        fine = self.session.send_cut(self.session.cut(added.tool_hash, [(0, 0, -0.5)], level=1))
        self.assertEqual(self.session.decided(fine)[3], CODES["LEVEL"])
        coarse = self.session.send_cut(self.session.cut(added.tool_hash, [(0, 0, -0.5)], level=0))
        self.assertEqual(self.session.decided(coarse)[0], "cut")

    def test_leaves_are_the_distance_to_the_tool(self):
        """The part of a round burr that cuts is a ball below its tip."""
        pitch, radius, half = self.hand.joined.pitch_mm, 1.6, math.sqrt(0.5)
        for tip, rotation, axis in (((0.3, -0.2, 0.5), (0, 0, 0, 1), (0, 0, 1)),
                                    ((0.3, -0.2, 0.5), (half, 0, 0, half), (0, -1, 0))):
            with self.subTest(axis):
                cut = self.session.send_cut(self.session.cut(self.burr, [wire.Pose.at(tip, rotation)]))
                self.assertEqual(self.session.decided(cut)[0], "cut")
                _, late = self.haptic()
                centre = tuple(t - radius * a for t, a in zip(tip, axis))
                band = int(4 * pitch * 1024)
                for (_, level, *origin), values in full(late.leaves).items():
                    self.assertEqual((level, [o % 8 for o in origin]), (0, [0, 0, 0]))
                    for i, value in enumerate(values):
                        at = [(origin[0] + i // 64) * pitch, (origin[1] + i // 8 % 8) * pitch,
                              (origin[2] + i % 8) * pitch]
                        steps = (math.dist(at, centre) - radius) * 1024
                        self.assertAlmostEqual(value, max(-band, min(band, steps)), delta=2)
                undone = self.hand.rooms.Undo(room.UndoRequest(author=self.hand.author, count=1), timeout=20)
                self.session.wait(lambda u=undone: any(e[1] == u.room_seq for e in self.session.events))

    def test_the_files_of_the_case(self):
        files = {}
        for part in self.hand.rooms.GetCase(room.GetCaseRequest(case_hash=self.hand.joined.case_hash), timeout=20):
            files.setdefault(part.file, bytearray()).extend(part.data)
        self.assertEqual(list(files), ["case.json", "bone.vdb"])
        for name, data in files.items():
            self.assertEqual(bytes(data), (self.server.case / name).read_bytes(), name)

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


class Limits(Case):
    """A server with limits that a single client can reach."""

    def options(self):
        config = self.folder / "server.yaml"
        config.write_text("limits:\n  swept_voxels_per_s: 1.0e+6\n  power_w: 1\n  blow_j: 0\n")
        return "--config", config

    def test_more_than_a_motor_can(self):
        hard = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -1.5), (1, 0, -1.5)], us=1000))
        self.assertEqual(self.session.decided(hard)[3], CODES["POWER"])

    def test_more_than_a_room_can_evaluate(self):
        # Above the bone, so that nothing is removed. At level 2 each cut sweeps a box of some 400000 samples.
        cuts = [self.session.send_cut(self.session.cut(self.burr, [(0, 0, 8), (20, 0, 8)], level=2, us=1000))
                for _ in range(20)]
        codes = [self.session.decided(cut)[3] for cut in cuts]
        self.assertEqual(self.session.decided(cuts[0])[0], "cut", "a burst is allowed")
        self.assertTrue(CODES["RATE"] in codes, "and no more than that")


class Watching(Case):
    DRAIN_S = 5

    def state(self, seq, x, author=None):
        pose = types.Pose(position_mm=types.Vector3(x=x, y=0, z=5), rotation=[0, 0, 0, 1])
        return types.CuttingState(author=author or self.hand.author, state_seq=seq, pose_bone_tool=pose,
                                  pose_bone_device=pose, tool_name="burr-round-3.2", spindle_rpm=20000,
                                  force_physical_n=types.Vector3(x=1, y=-2, z=0.5),
                                  phase=types.CUTTING_PHASE_FREE)

    def messages_of(self, stream):
        """A queue of the stream's messages. The stream ends after the test."""
        self.addCleanup(stream.cancel)
        messages = queue.Queue()
        threading.Thread(target=lambda: [messages.put(m) for m in until_cancelled(stream)], daemon=True).start()
        return messages

    def until(self, messages, holds):
        until = time.monotonic() + 30
        while time.monotonic() < until:
            message = messages.get(timeout=30)
            if holds(message):
                return message
        raise AssertionError("no such message came")

    def test_the_tools_of_others(self):
        viewer = self.member(VIEWER)
        stub = client.watch_grpc.WatchServiceStub(viewer.channel)
        messages = self.messages_of(stub.WatchCutting(watch.WatchCuttingRequest(author=viewer.author), timeout=60))
        first = messages.get(timeout=30)
        self.assertEqual((list(first.states), list(first.bodies)), ([], [0]))
        _, other = self.haptic("ben")
        sent = self.state(7, 1.5)
        self.session.send(cutting.SessionRequest(state=sent))
        seen = self.until(messages, lambda m: m.states)
        self.assertEqual(list(seen.states), [sent])
        # Without datagrams a partner's state comes over the stream.
        other.wait(lambda: self.hand.author in other.partners)
        self.assertEqual(other.partners[self.hand.author], sent)
        self.assertEqual(self.session.partners, {}, "nobody is sent their own state")

    def test_a_state_of_somebody_else_ends_the_stream(self):
        self.session.send(cutting.SessionRequest(state=self.state(1, 0, author=999)))
        self.session.wait(lambda: self.session.ended)
        self.assertEqual(self.session.ended.code(), grpc.StatusCode.INVALID_ARGUMENT)

    def test_the_surface_while_another_cuts(self):
        watcher = self.surface()
        before, volume = watcher.hash(), volume_mm3(watcher.triangles())
        decided = self.groove(self.session, 6)
        watcher.read_until(decided[-1][1])
        self.assertNotEqual(watcher.hash(), before)
        self.assertEqual(watcher.hash(), self.surface(decided[-1][1]).hash(), "as who comes now sees it")
        self.assertLess(volume_mm3(watcher.triangles()), volume - 5)
        undone = self.hand.rooms.Undo(room.UndoRequest(author=self.hand.author, all=True), timeout=20)
        whole = watcher.read_until(undone.room_seq).triangles()
        # The blocks stay as fine as the cuts were, so only their shape is as before.
        self.assertEqual(open_edges(whole), [])
        self.assertAlmostEqual(volume_mm3(whole), volume, delta=0.5)

    def test_the_inside_of_the_bone(self):
        def key(leaf):
            return leaf.body, leaf.level, leaf.origin.x, leaf.origin.y, leaf.origin.z

        def digest(leaves):
            return wire.field_hash(full(leaves), self.hand.joined.pitch_mm)
        self.groove(self.session, 2)
        viewer = self.member(VIEWER)
        stub = field_grpc.FieldServiceStub(viewer.channel)

        def watching(kernel):
            return stub.WatchField(field.WatchFieldRequest(author=viewer.author, kernel_version=kernel), timeout=60)
        code, _ = self.refusal(lambda: next(watching(client.KERNEL + 1)))
        self.assertEqual(code, grpc.StatusCode.FAILED_PRECONDITION)
        messages = self.messages_of(watching(client.KERNEL))
        leaves, kinds, message = {}, [], None
        while kinds[-1:] != ["complete"]:
            message = messages.get(timeout=30)
            kinds.append(message.WhichOneof("message"))
            self.assertEqual(message.index, 0)
            if message.HasField("leaf"):
                leaves[key(message.leaf)] = message.leaf.values
        self.assertEqual([kind for i, kind in enumerate(kinds) if kinds[i - 1] != kind], ["tool", "leaf", "complete"])
        self.assertEqual(list(message.complete.bodies), [0])
        self.assertEqual(digest(leaves), self.hand.status().field_hash)

        # A cut, a cut that the room rejects, and an undo.
        cut = self.groove(self.session, 1, y=3.0)[0][1]
        wrong = self.session.send_cut(self.session.cut(self.burr, [(0, 0, -1)], body=9))
        rejected = self.session.decided(wrong)[1]
        undone = self.hand.rooms.Undo(room.UndoRequest(author=self.hand.author, all=True), timeout=20).room_seq
        events = []
        while not events or not events[-1].change.last:
            events.append(messages.get(timeout=30))
        self.assertEqual([e.index for e in events], list(range(1, len(events) + 1)))
        self.assertEqual([(e.WhichOneof("message"), e.committed.room_seq + e.noted.room_seq) for e in events[:2]],
                         [("committed", cut), ("noted", rejected)])
        for event in events[2:]:
            self.assertEqual((event.change.room_seq, list(event.change.bodies)), (undone, [0]))
            leaves.update((key(leaf), leaf.values) for leaf in event.change.leaves)
        self.assertEqual(digest(leaves), self.hand.status().field_hash)
        self.assertEqual(digest(leaves), digest({}))

    def test_who_has_heard_of_what(self):
        console = self.member(CONSOLE, "ada")
        stub = people_grpc.PeopleServiceStub(console.channel)
        messages = self.messages_of(stub.WatchPeople(people.WatchPeopleRequest(author=console.author), timeout=60))
        first = messages.get(timeout=30)
        self.assertTrue(first.complete)
        self.assertEqual({(p.name, p.hand) for p in first.people}, {("anna", True), ("ada", False)})
        stop = types.Restrictions(stopped=True, words="wait")
        decided = stub.Supervise(people.SuperviseRequest(author=console.author, subject=self.hand.author,
                                                         supervision=stop), timeout=20)
        pending = self.until(messages, lambda m: any(p.decided_room_seq == decided.room_seq for p in m.people))
        self.assertLess(pending.people[0].acknowledged_room_seq, decided.room_seq)
        self.session.wait(lambda: self.session.supervised == stop)
        self.session.send(cutting.SessionRequest(acknowledged=cutting.Acknowledgement(room_seq=decided.room_seq)))
        self.until(messages, lambda m: any(p.acknowledged_room_seq >= decided.room_seq for p in m.people))

    def test_the_shots_of_others(self):
        stub = people_grpc.PeopleServiceStub(self.hand.channel)
        shot = types.CArmShot(number=4, time_unix_ms=1796050000123, mode=types.SHOT_MODE_LIVE,
                              isocentre_mm=types.Vector3(x=1, y=2, z=-5), translation_mm=types.Vector3(z=-7),
                              orbit_rad=0.1, exposure_s=1 / 15,
                              air_kerma_at_metre_ugy=2.5, dose_area_gy_cm2=0.0017, seed=2**64 - 1)
        run = types.ShotRun(first_number=3, exposure_s=2 / 15, last=shot)
        counts = types.ShotTotals(shots=4, exposure_s=0.2, dose_area_gy_cm2=0.005)
        stub.ShareShots(people.ShareShotsRequest(author=self.hand.author, run=run, session=counts), timeout=20)
        console = self.member(CONSOLE, "ada")
        messages = self.messages_of(people_grpc.PeopleServiceStub(console.channel).WatchPeople(
            people.WatchPeopleRequest(author=console.author), timeout=60))
        run.author = self.hand.author
        first = messages.get(timeout=30)
        self.assertEqual(list(first.shots), [run])
        self.assertEqual([p.session_shots for p in first.people if p.author == self.hand.author], [counts])
        shot.tilt_rad = math.nan
        with self.assertRaises(grpc.RpcError) as refused:
            stub.ShareShots(people.ShareShotsRequest(author=self.hand.author, session=counts,
                                                     run=types.ShotRun(first_number=4, last=shot)), timeout=20)
        self.assertEqual((refused.exception.code(), refused.exception.details()),
                         (grpc.StatusCode.INVALID_ARGUMENT, "shot.tilt_rad must be -100 to 100"))

    def test_version_3_gets_nothing_that_it_does_not_know(self):
        _, old = self.haptic("ben", version=3)
        stub = people_grpc.PeopleServiceStub(self.hand.channel)
        said = stub.Say(people.SayRequest(author=self.hand.author, words="hello"), timeout=20).room_seq
        decided = self.groove(self.session, 1)[0]
        for session, kind in ((self.session, "chat"), (old, "noted")):
            session.wait(lambda s=session: any(e[1] == decided[1] for e in s.events))
            self.assertEqual([e[0] for e in session.events if e[1] == said], [kind])

    def test_a_server_says_that_it_stops(self):
        self.server.process.terminate()
        self.session.wait(lambda: self.session.redial)
        self.assertTrue(self.session.redial.why)


if __name__ == "__main__":
    unittest.main()
