// The plan of a case over the wire: everything arrives, and nothing wrong is taken.
#include "common/wire/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace osteon {
namespace {

// A tetrahedron, and a strip that takes several parts.
SurgicalPlan full_plan() {
  SurgicalPlan plan;
  plan.axes = {{"neck", {1, 2, 3}, {0, 0.6, 0.8}}};
  plan.planes = {{"osteotomy", {4, 5, 6}, {0, 0, -1}}};
  plan.boxes = {{"window", {-1, -2, -3}, {1, 2, 3}}};
  TriangleMesh small{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
  TriangleMesh large;
  for (std::uint32_t i = 0; i < 150'000; ++i) {
    large.positions_mm.push_back({0.001f * static_cast<float>(i), i % 2 == 0 ? 0.0f : 1.0f, 0.0f});
    if (i >= 2) large.triangles.push_back({i - 2, i - 1, i});
  }
  plan.structures = {{"a nerve", StructureKind::nerve, 0.5, small}, {"a vessel", StructureKind::vessel, 3.0, large}};
  return plan;
}

Result<SurgicalPlan> read(const std::vector<v1::GetPlanResponse>& messages) {
  wire::PlanReader reader;
  for (const v1::GetPlanResponse& message : messages)
    if (Result<void> good = reader.add(message); !good) return tl::unexpected(good.error());
  return reader.finish();
}

TEST(PlanMessages, BringTheWholePlan) {
  const SurgicalPlan plan = full_plan();
  const auto messages = wire::to_wire(plan);
  EXPECT_GT(messages.size(), 5u);
  for (const v1::GetPlanResponse& message : messages) EXPECT_LT(message.ByteSizeLong(), 1024u * 1024u);
  const auto back = read(messages);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->axes.size(), 1u);
  EXPECT_EQ(back->axes[0].name, "neck");
  EXPECT_EQ(back->axes[0].point_mm, plan.axes[0].point_mm);
  EXPECT_EQ(back->axes[0].direction, plan.axes[0].direction);
  ASSERT_EQ(back->planes.size(), 1u);
  EXPECT_EQ(back->planes[0].normal, plan.planes[0].normal);
  ASSERT_EQ(back->boxes.size(), 1u);
  EXPECT_EQ(back->boxes[0].min_mm, plan.boxes[0].min_mm);
  EXPECT_EQ(back->boxes[0].max_mm, plan.boxes[0].max_mm);
  ASSERT_EQ(back->structures.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back->structures[i].name, plan.structures[i].name);
    EXPECT_EQ(back->structures[i].kind, plan.structures[i].kind);
    EXPECT_EQ(back->structures[i].voxel_mm, plan.structures[i].voxel_mm);
    EXPECT_EQ(back->structures[i].surface.positions_mm, plan.structures[i].surface.positions_mm);
    EXPECT_EQ(back->structures[i].surface.triangles, plan.structures[i].surface.triangles);
  }
  const auto nothing = read(wire::to_wire(SurgicalPlan{}));
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->empty());
}

TEST(DensityMessages, BringTheWholeDensityAndNothingWrong) {
  DensityGrid density(0.5);
  for (int i = 0; i < 2500; ++i) {
    DensityLeaf leaf;
    for (std::size_t k = 0; k < leaf.size(); ++k) leaf[k] = static_cast<std::uint8_t>(i * 7 + static_cast<int>(k));
    density.add({i - 1000, 3 * i, -i}, leaf);
  }
  const auto messages = wire::to_wire(density);
  EXPECT_EQ(messages.size(), 3u);
  const auto read = [](const std::vector<v1::GetDensityResponse>& all) -> Result<DensityGrid> {
    wire::DensityReader reader;
    for (const v1::GetDensityResponse& message : all)
      if (Result<void> good = reader.add(message); !good) return tl::unexpected(good.error());
    return reader.finish();
  };
  const auto back = read(messages);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->pitch_mm(), 0.5);
  EXPECT_EQ(back->leaves(), density.leaves());
  auto cut_off = messages;
  cut_off.pop_back();
  EXPECT_FALSE(read(cut_off));
  auto short_leaf = messages;
  short_leaf[0].mutable_leaves(0)->mutable_samples()->pop_back();
  EXPECT_FALSE(read(short_leaf));
  auto pitches = messages;
  pitches[1].set_pitch_mm(0.6);
  EXPECT_FALSE(read(pitches));
  for (const double pitch_mm : {0.0, 1e-300, 1e300, double{NAN}}) {
    for (auto& message : pitches) message.set_pitch_mm(pitch_mm);
    EXPECT_FALSE(read(pitches)) << pitch_mm;
  }
  auto endless = messages;
  endless.push_back(messages.back());
  EXPECT_FALSE(read(endless));
  auto empty = messages;
  empty[1].clear_leaves();
  EXPECT_FALSE(read(empty));
  auto twice = messages;
  *twice[1].mutable_leaves(0) = messages[0].leaves(0);
  EXPECT_FALSE(read(twice));
  auto far_away = messages;
  far_away[0].mutable_leaves(0)->mutable_leaf()->set_x(1 << 30);
  EXPECT_FALSE(read(far_away));
}

TEST(PlanMessages, AnUnknownKindMayBeAtRisk) {
  auto messages = wire::to_wire(full_plan());
  messages[0].mutable_structures(0)->set_kind(static_cast<v1::StructureKind>(77));
  const auto back = read(messages);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->structures[0].at_risk());
}

TEST(PlanMessages, WrongOnesAreRefused) {
  using Messages = std::vector<v1::GetPlanResponse>;
  const std::function<void(Messages&)> faults[] = {
      [](Messages& m) { m.pop_back(); },
      [](Messages& m) { m.erase(m.begin() + 1); },
      [](Messages& m) { m.insert(m.begin() + 1, m[1]); },
      [](Messages& m) { m[1].mutable_parts(0)->set_structure(2); },
      [](Messages& m) { m[1].mutable_parts(0)->add_points_mm(1.0f); },
      [](Messages& m) { m[1].mutable_parts(0)->set_points_mm(4, NAN); },
      [](Messages& m) { m[2].mutable_parts(0)->set_triangles(2, 4); },
      [](Messages& m) { m[0].mutable_structures(0)->set_triangles(4'000'001); },
      [](Messages& m) { m[0].mutable_structures(0)->set_points(1'000'000); },
      [](Messages& m) { m[0].mutable_structures(0)->set_voxel_mm(-1.0); },
      [](Messages& m) { m[0].mutable_axes(0)->mutable_direction()->set_x(1.0); },
      [](Messages& m) { m[0].mutable_planes(0)->mutable_point_mm()->set_z(INFINITY); },
      [](Messages& m) { m[0].mutable_boxes(0)->mutable_max_mm()->set_y(NAN); },
      [](Messages& m) { m[0].mutable_boxes(0)->mutable_max_mm()->set_y(-2.5); },
      [](Messages& m) { m.push_back(m.back()); },
      [](Messages& m) { m.insert(m.begin() + 1, v1::GetPlanResponse()); },
      [](Messages& m) { m[1].add_parts()->set_structure(0); },
      [](Messages& m) { *m[1].add_axes() = m[0].axes(0); },
      [](Messages& m) {
        for (int i = 0; i < 1000; ++i) *m[0].add_axes() = m[0].axes(0);
      },
  };
  for (std::size_t i = 0; i < std::size(faults); ++i) {
    Messages messages = wire::to_wire(full_plan());
    faults[i](messages);
    EXPECT_FALSE(read(messages)) << "fault " << i;
  }
}

}  // namespace
}  // namespace osteon
