#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "common/field/kernel.hpp"
#include "common/volume/cut_history.hpp"
#include "common/volume/fragments.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

using test::plain_block;
using test::straight_cut;

double box_distance(const Box& box, const Vec3& p) {
  const Vec3 q = (p - box.centre_mm()).cwiseAbs() - 0.5 * box.size_mm();
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

// Leaves that remove a solid given by its exact distance, as cuts of that level would do.
std::vector<FieldLeaf> leaves_of(const Case& bone, int level, const Box& around,
                                 const std::function<double(const Vec3&)>& distance_mm) {
  std::vector<FieldLeaf> leaves;
  const double pitch = level_pitch_mm(bone.pitch_mm(), level);
  const std::int32_t band = band_quanta(pitch);
  const CoordBox box = covering_samples(around.grown(kBandVoxels * pitch), pitch);
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize) {
        FieldLeaf leaf{{}, level, {x, y, z}, {}};
        if (!bone.has_bone(
                {shift_down(leaf.origin, level), shift_down(leaf.origin + Coord{7, 7, 7}, level) + Coord{1, 1, 1}}))
          continue;
        for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
          const Vec3 p = position_mm(leaf.origin + Coord{i / 64, i / 8 % 8, i % 8}, pitch);
          leaf.values.push_back(
              static_cast<std::int16_t>(std::clamp(std::lround(distance_mm(p) * 1024.0), -long{band}, long{band})));
        }
        if (std::ranges::any_of(leaf.values, [&](std::int16_t v) { return v < band; }))
          leaves.push_back(std::move(leaf));
      }
  return leaves;
}

struct Room {
  CutField field;
  FragmentFinder finder;
  CutHistory history;
  std::uint64_t seq = 0;
  TouchCost cost;
  explicit Room(const Case& bone) : field(bone, {}), finder(field) {}

  void touch(const std::vector<FieldLeaf>& leaves) {
    std::array<std::vector<Coord>, kLevels> changed;
    for (const FieldLeaf& leaf : leaves) changed[static_cast<std::size_t>(leaf.level)].push_back(leaf.origin);
    for (int level = 0; level < kLevels; ++level) {
      const TouchCost c = finder.touch(field, level, changed[static_cast<std::size_t>(level)]);
      cost = {cost.cells + c.cells, cost.samples + c.samples, cost.links || c.links};
    }
  }
  RoomSeq remove(const std::vector<FieldLeaf>& leaves) {
    cost = {};
    for (const FieldLeaf& leaf : leaves) field.merge(leaf);
    history.add_mask({++seq}, leaves);
    touch(leaves);
    return {seq};
  }
  RoomSeq remove_box(int level, const Box& box) {
    return remove(leaves_of(field.bone(), level, box, [&](const Vec3& p) { return box_distance(box, p); }));
  }
  void cut(const Cut& cut) {
    const CutReport report = field.apply(cut);
    history.add({++seq}, cut, report.reached_leaves);
    finder.touch(field, cut.level, report.changed_leaves);
  }
  [[nodiscard]] std::vector<Fragment> pieces() { return finder.take_fragments(field); }
  void rebuild(std::span<const RoomSeq> places, bool undo) {
    for (const LevelLeaves& l : undo ? history.undo(field, places) : history.redo(field, places))
      finder.touch(field, l.level, l.origins);
  }
};

// The fragment's own body: the parent's field before the fragment is taken, with everything but the fragment removed.
CutField body_of(const Fragment& piece, const CutField& parent_before) {
  CutField body(parent_before.bone(), {1});
  for (FieldLeaf leaf : parent_before.leaves()) {
    leaf.body = {1};
    body.restore(leaf);
  }
  for (FieldLeaf leaf : piece.left) {
    leaf.body = {1};
    body.merge(leaf);
  }
  return body;
}

CutField copy_of(const CutField& field) {
  CutField copy(field.bone(), field.body());
  for (const FieldLeaf& leaf : field.leaves()) copy.restore(leaf);
  return copy;
}

// The part of a block between two planes.
Box slab_of(double x0, double x1, double y0 = -12.0, double y1 = 12.0) { return {{x0, y0, -12.0}, {x1, y1, 2.0}}; }

// Solid volume in a box, from samples of the finest level.
double solid_mm3(const CutField& field, const Box& box) {
  const double pitch = level_pitch_mm(field.bone().pitch_mm(), 2);
  const CoordBox samples = covering_samples(box, pitch);
  const Coord d = samples.dims();
  std::vector<float> f(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z));
  field.gather_solid(2, samples, f);
  double sum = 0.0;
  for (const float v : f) sum += std::clamp(0.5 - static_cast<double>(v) / pitch, 0.0, 1.0);
  return sum * pitch * pitch * pitch;
}

// A block of 20 x 20 x 10 mm sawn in two at 0.125 mm.
TEST(Fragments, ASawnBlockIsTwoPiecesWithTheirVolumes) {
  Room room(plain_block(20.0, 10.0, 0.5));
  EXPECT_TRUE(room.pieces().empty());
  room.remove_box(2, slab_of(1.06, 2.1));
  const CutField before = copy_of(room.field);
  auto pieces = room.pieces();
  ASSERT_EQ(pieces.size(), 1u);
  const double right = (10.0 - 2.1) * 20.0 * 10.0, left = (1.06 + 10.0) * 20.0 * 10.0, kerf = 1.04 * 20.0 * 10.0;
  EXPECT_NEAR(pieces[0].volume_mm3, right, 0.005 * right);
  EXPECT_FALSE(pieces[0].debris());
  EXPECT_NEAR(pieces[0].bounds.min_mm.x(), 2.1, 0.13);
  EXPECT_NEAR(pieces[0].bounds.max_mm.x(), 10.0, 0.51);
  room.remove(pieces[0].taken);
  EXPECT_TRUE(room.pieces().empty());
  const CutField piece = body_of(pieces[0], before);
  const Box all{{-11, -11, -11}, {11, 11, 1}};
  const double parent_mm3 = solid_mm3(room.field, all), piece_mm3 = solid_mm3(piece, all), whole = 20.0 * 20.0 * 10.0;
  EXPECT_NEAR(parent_mm3, left, 0.005 * left);
  EXPECT_NEAR(piece_mm3, right, 0.005 * right);
  EXPECT_NEAR(parent_mm3 + piece_mm3 + kerf, whole, 0.005 * whole);
  // The fragment by itself is one body without fragments.
  EXPECT_TRUE(FragmentFinder(piece).take_fragments(piece).empty());
}

// Kerf and fragment count as removed, although the fragment's masks are of two levels. A sample on an edge of the block
// counts half where a quarter of it is bone. So along the edges of the removed part the volume may be too large by that
// much.
TEST(Fragments, WhatAPieceTakesAlongCountsAsRemoved) {
  for (const double x0 : {1.06, 4.0, 5.3}) {
    SCOPED_TRACE(x0);
    Room room(plain_block(20.0, 10.0, 0.5));
    room.remove_box(2, slab_of(x0, x0 + 1.04));
    EXPECT_NEAR(room.field.removed_mm3(), 1.04 * 20.0 * 10.0, 0.01 * 1.04 * 20.0 * 10.0);
    const auto pieces = room.pieces();
    ASSERT_EQ(pieces.size(), 1u);
    room.remove(pieces[0].taken);
    const double all = (10.0 - x0) * 20.0 * 10.0;
    const double edges_mm = 4.0 * (10.0 - x0) + 2.0 * (20.0 + 10.0);
    EXPECT_NEAR(room.field.removed_mm3(), all, 0.25 * 0.5 * 0.5 * edges_mm + 0.001 * all);
  }
}

// Most leaves of a fragment's masks have a single value and take a hundredth of the memory.
TEST(Fragments, MasksKeepWhatIsGoneThroughoutAsOneValue) {
  Room room(plain_block(20.0, 10.0, 0.5));
  room.remove_box(2, slab_of(1.06, 2.1));
  const CutField before = copy_of(room.field);
  const auto pieces = room.pieces();
  ASSERT_EQ(pieces.size(), 1u);
  for (const auto* mask : {&pieces[0].taken, &pieces[0].left})
    for (const FieldLeaf& leaf : *mask) {
      const bool equal = std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == leaf.values.front(); });
      EXPECT_EQ(leaf.is_constant(), equal);
    }
  // Masks listed in full have the same effect on a field, its hash and a history.
  CutField compact = body_of(pieces[0], before), full = copy_of(compact);
  Fragment listed = pieces[0];
  for (FieldLeaf& leaf : listed.left) leaf.expand();
  EXPECT_EQ(listed.left, pieces[0].left);
  full = body_of(listed, before);
  EXPECT_EQ(full.hash(), compact.hash());
  EXPECT_EQ(full.leaves(), compact.leaves());
  std::vector<FieldLeaf> leaves = compact.leaves();
  EXPECT_TRUE(std::ranges::any_of(leaves, &FieldLeaf::is_constant));
  for (FieldLeaf& leaf : leaves) leaf.expand();
  EXPECT_EQ(field_hash(std::move(leaves), 0.5), compact.hash());
}

// No point is solid in both bodies, and no solid point is lost or gained: at samples of every level, and anywhere.
void expect_partition(const CutField& before, const CutField& parent, const CutField& piece, const Box& box,
                      int allowed = 0) {
  for (int level = 0; level < kLevels; ++level) {
    const double pitch = level_pitch_mm(before.bone().pitch_mm(), level);
    const CoordBox samples = covering_samples(box, pitch);
    const Coord d = samples.dims();
    std::vector<float> f(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z)),
        a(f.size()), b(f.size());
    before.gather_solid(level, samples, f);
    parent.gather_solid(level, samples, a);
    piece.gather_solid(level, samples, b);
    int both = 0, lost = 0, gained = 0;
    for (std::size_t i = 0; i < f.size(); ++i) {
      both += a[i] < 0 && b[i] < 0;
      lost += f[i] < 0 && a[i] >= 0 && b[i] >= 0;
      gained += f[i] >= 0 && (a[i] < 0 || b[i] < 0);
    }
    EXPECT_EQ(both, 0) << "level " << level;
    EXPECT_EQ(gained, 0) << "level " << level;
    EXPECT_LE(lost, allowed) << "level " << level << " of " << f.size();
  }
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int both = 0, lost = 0;
  for (int i = 0; i < 30000; ++i) {
    const Vec3 p = box.min_mm + Vec3{unit(random), unit(random), unit(random)}.cwiseProduct(box.size_mm());
    const double f = before.solid_mm(p), a = parent.solid_mm(p), b = piece.solid_mm(p);
    both += a < 0 && b < 0;
    lost += f < -1e-6 && a >= 0 && b >= 0;
  }
  EXPECT_EQ(both, 0);
  EXPECT_LE(lost, allowed);
}

TEST(Fragments, ParentAndPieceArePartsOfWhatWasAndShareNothing) {
  for (const int level : {0, 1, 2}) {
    SCOPED_TRACE("kerf at level " + std::to_string(level));
    Room room(plain_block(16.0, 8.0, 0.5));
    // An oblique kerf: 1 mm at the finest level, wider at coarser voxels.
    const double width = level == 2 ? 1.0 : level == 1 ? 1.3 : 2.2;
    const Vec3 normal = Vec3{1.0, 0.35, 0.2}.normalized();
    room.remove(leaves_of(room.field.bone(), level, {{-10, -10, -10}, {10, 10, 2}}, [&](const Vec3& p) {
      return std::abs(normal.dot(p - Vec3{1.3, 0.2, 0})) - 0.5 * width;
    }));
    const CutField before = copy_of(room.field);
    auto pieces = room.pieces();
    ASSERT_EQ(pieces.size(), 1u);
    room.remove(pieces[0].taken);
    EXPECT_TRUE(room.pieces().empty());
    // Where a kerf of coarse voxels leaves the bone, wedges thinner than a voxel end without a sample of their own.
    expect_partition(before, room.field, body_of(pieces[0], before), {{-9, -9, -9}, {9, 9, 1}}, level == 2 ? 0 : 10);
  }
}

TEST(Fragments, AThinBridgeHoldsAndTheLastOfSeveralGivesWay) {
  Room room(plain_block(20.0, 10.0, 0.5));
  // Sawn through except for two bridges of 0.5 mm.
  room.remove_box(2, slab_of(1.0, 2.0, -12.0, -4.0));
  room.remove_box(2, slab_of(1.0, 2.0, -3.5, 5.0));
  room.remove_box(2, slab_of(1.0, 2.0, 5.5, 12.0));
  EXPECT_TRUE(room.pieces().empty());
  const RoomSeq first = room.remove_box(2, slab_of(1.0, 2.0, -4.2, -3.3));
  EXPECT_TRUE(room.pieces().empty());
  room.remove_box(2, slab_of(1.0, 2.0, 4.8, 5.7));
  EXPECT_EQ(room.pieces().size(), 1u);
  // It is found until it is taken. If a bridge comes back, it is not a fragment.
  EXPECT_EQ(room.pieces().size(), 1u);
  room.rebuild({&first, 1}, true);
  EXPECT_TRUE(room.pieces().empty());
  room.rebuild({&first, 1}, false);
  EXPECT_EQ(room.pieces().size(), 1u);
}

TEST(Fragments, WhatIsUnderACubicMillimetreIsDebris) {
  Room room(plain_block(16.0, 8.0, 0.5));
  // A corner of 0.8 mm, cut free on its two inner sides and below.
  const Box corner{{7.2, 7.2, -0.8}, {9.0, 9.0, 1.0}};
  room.remove(leaves_of(room.field.bone(), 2, corner.grown(0.6),
                        [&](const Vec3& p) { return std::abs(box_distance(corner, p) - 0.3) - 0.3; }));
  auto pieces = room.pieces();
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_TRUE(pieces[0].debris());
  EXPECT_NEAR(pieces[0].volume_mm3, 0.8 * 0.8 * 0.8, 0.25 * 0.8 * 0.8 * 0.8);  // the case rounds its edges by its voxel
  room.remove(pieces[0].taken);
  EXPECT_TRUE(room.pieces().empty());
}

TEST(Fragments, UndoingTheSplitGivesTheBoneBack) {
  Room room(plain_block(16.0, 8.0, 0.5));
  room.remove_box(2, slab_of(1.0, 2.0));
  const Digest before = room.field.hash();
  auto pieces = room.pieces();
  ASSERT_EQ(pieces.size(), 1u);
  const RoomSeq split = room.remove(pieces[0].taken);
  EXPECT_NE(room.field.hash(), before);
  room.rebuild({&split, 1}, true);
  EXPECT_EQ(room.field.hash(), before);
  const auto again = room.pieces();
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].taken, pieces[0].taken);
}

TEST(Fragments, BonesThatWereApartStayAndEachCanLosePieces) {
  const auto ball = [](double x, double r) { return [=](const Vec3& p) { return (p - Vec3{x, 0, 0}).norm() - r; }; };
  const auto large = ball(-5.0, 6.0), small = ball(4.0, 2.0);
  Room room(test::make_bone(
      {{-12, -7, -7}, {7, 7, 7}}, 0.5, [&](const Vec3& p) { return std::min(large(p), small(p)); },
      [](const Vec3&) { return 1.9; }));
  EXPECT_TRUE(room.pieces().empty());
  // A cut at one ball changes cells that both have. There are still two bones.
  room.remove_box(2, {{0.2, -2, -2}, {2.4, 2, 2}});
  EXPECT_TRUE(room.pieces().empty());
  room.remove_box(2, {{3.4, -4, -4}, {4.6, 4, 4}});
  const auto pieces = room.pieces();
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_LT(pieces[0].volume_mm3, 17.0);  // of the small ball
  EXPECT_GT(pieces[0].bounds.min_mm.x(), 2.0);
}

// The fragments depend only on the field, however it was made.
TEST(Fragments, KeptUpToDateIsWhatIsFoundAnew) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> across(-7.0, 7.0), depth(-8.0, 0.5);
  Room room(plain_block(14.0, 8.0, 0.5));
  int found = 0;
  for (int i = 0; i < 40; ++i) {
    const Vec3 from{across(random), across(random), depth(random)}, to{across(random), across(random), depth(random)};
    Cut cut = straight_cut(*find_tool("burr-round-3.2"), from, to, {0.3, 0.1, -1.0});
    cut.level = i % 3;
    room.cut(cut);
    if (i % 4 == 3) {
      const auto kept = room.pieces(), anew = FragmentFinder(room.field).take_fragments(room.field);
      ASSERT_EQ(kept.size(), anew.size());
      for (std::size_t n = 0; n < kept.size(); ++n) {
        EXPECT_EQ(kept[n].volume_mm3, anew[n].volume_mm3);
        EXPECT_EQ(kept[n].taken, anew[n].taken);
        EXPECT_EQ(kept[n].left, anew[n].left);
      }
      found += static_cast<int>(kept.size());
      if (kept.empty()) continue;
      const CutField before = copy_of(room.field);
      room.remove(kept[0].taken);
      expect_partition(before, room.field, body_of(kept[0], before), {{-8, -8, -9}, {8, 8, 1}}, 40);
    }
    if (i % 10 == 9) {
      std::vector<RoomSeq> some;
      for (std::uint64_t n = 1; n <= room.seq; n += 3) some.push_back({n});
      room.rebuild(some, i % 20 == 9);
    }
  }
  EXPECT_GT(found, 3);
}

TEST(Fragments, AnUpdateCostsWhatChanged) {
  Room small(plain_block(16.0, 8.0, 0.5)), large(plain_block(48.0, 8.0, 0.5));
  for (Room* room : {&small, &large}) {
    room->remove_box(2, {{0.1, 0.1, -1.0}, {1.1, 1.1, 1.0}});
    EXPECT_LE(room->cost.cells, 8u);
  }
  EXPECT_EQ(small.cost.cells, large.cost.cells);
  EXPECT_EQ(small.cost.samples, large.cost.samples);
}

}  // namespace
}  // namespace osteon
