// The baselines of the figures do the work that Osteon does, so that no figure compares with something that does less.
#include <gtest/gtest.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <unordered_set>

#include "common/field/kernel.hpp"
#include "common/imaging/smoothing.hpp"
#include "common/surface/block_source.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/perf/baselines/contact_input.hpp"
#include "tests/perf/baselines/csg_cut.hpp"
#include "tests/perf/baselines/dense_cut.hpp"
#include "tests/perf/baselines/flying_edges.hpp"
#include "tests/perf/baselines/gdcm_decode.hpp"
#include "tests/perf/baselines/itk_smoothing.hpp"
#include "tests/perf/baselines/leaf_cut.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::baselines {
namespace {

using osteon::test::plain_block;
using osteon::test::straight_cut;

constexpr double kPitch_mm = 0.5;
constexpr int kLevel = 2;
// Baselines round in another order. They may be off by a quantum where a distance lies half-way between two.
constexpr double kTolerance_mm = 1.001 * kQuantum_mm;

struct Work {
  std::string name;
  std::vector<Cut> cuts;
};

void PrintTo(const Work& work, std::ostream* out) { *out << work.name; }

std::vector<Cut> at_work(const char* tool, const Vec3& from, const Vec3& step, const Vec3& axis, int count) {
  std::vector<Cut> cuts;
  for (int i = 0; i < count; ++i) {
    cuts.push_back(straight_cut(*find_tool(tool), from + i * step, from + (i + 1) * step, axis));
    cuts.back().level = kLevel;
  }
  return cuts;
}

// Along the lattice, and slanted, where no shortcut of one axis holds.
std::vector<Work> works() {
  const Vec3 slanted = Vec3(0.4, -0.3, -1).normalized(), feed = 0.05 * slanted;
  return {{"burr", at_work("burr-round-3.2", {-2, 0.03, -1.6}, {0.12, 0, 0}, -Vec3::UnitZ(), 30)},
          {"slanted burr", at_work("burr-round-3.2", {-1, 0.03, -1.2}, {0.08, 0.05, -0.03}, slanted, 30)},
          {"drill", at_work("drill-3.5", {0.04, 0.03, 0}, {0, 0, -0.05}, -Vec3::UnitZ(), 60)},
          {"slanted drill", at_work("drill-3.5", {0.04, 0.03, 0.5}, feed, slanted, 60)}};
}

class CutBaselines : public testing::TestWithParam<Work> {
 protected:
  CutBaselines() {
    for (const Cut& cut : GetParam().cuts) {
      field_.apply(cut);
      shapes_.push_back(swept_shape(cut, kPitch_mm));
    }
    const CoordBox bone = field_.bone().bounds_samples();
    box_ = {4 * bone.min, 4 * bone.max};
    const Coord d = box_.dims();
    ours_.resize(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z));
    surface_ = solid_ = ours_;
    field_.gather_cuts(kLevel, box_, ours_);
    field_.gather_surface(kLevel, box_, surface_);
    field_.gather_solid(kLevel, box_, solid_);
  }

  template <class Check>
  void for_each_sample(Check check) {
    std::size_t i = 0;
    for (int x = box_.min.x; x <= box_.max.x; ++x)
      for (int y = box_.min.y; y <= box_.max.y; ++y)
        for (int z = box_.min.z; z <= box_.max.z; ++z) check(x, y, z, i++);
  }

  // The same R wherever ours is stored, and no cut in bone that ours does not have.
  template <class Baseline>
  void expect_same_cuts(const Baseline& baseline) {
    std::unordered_set<Coord, CoordHash> stored;
    for (const FieldLeaf& leaf : field_.leaves()) stored.insert(leaf.origin);
    int cut = 0, differing = 0, not_ours = 0;
    for_each_sample([&](int x, int y, int z, std::size_t i) {
      const float theirs = baseline.at(x, y, z);
      if (stored.contains(floor_to({x, y, z}, kLeafSize))) {
        cut += ours_[i] < band_;
        differing += std::abs(theirs - ours_[i]) > kTolerance_mm;
      } else {
        not_ours += theirs < band_ && surface_[i] < 0.0f;
      }
    });
    EXPECT_GT(cut, 20000);
    EXPECT_EQ(differing, 0);
    EXPECT_EQ(not_ours, 0);
  }

  const float band_ = band_mm(level_pitch_mm(kPitch_mm, kLevel));
  CutField field_{plain_block(16, 8, kPitch_mm), BodyId{}};
  std::vector<SweptShape> shapes_;
  CoordBox box_;
  std::vector<float> ours_, surface_, solid_;
};

std::array<int, 3> ints(Coord c) { return {c.x, c.y, c.z}; }

TEST_P(CutBaselines, DenseArrayHoldsTheSameCuts) {
  for (const int threads : {1, 2}) {
    DenseCut dense(ints(box_.min), ints(box_.max), shapes_[0].pitch_mm, band_);
    for (const SweptShape& shape : shapes_) dense.apply(shape, threads);
    expect_same_cuts(dense);
  }
}

TEST_P(CutBaselines, CulledLeavesHoldTheSameCuts) {
  openvdb::initialize();
  for (const int threads : {1, 2}) {
    LeafCut leaves(ints(box_.min), ints(box_.max), shapes_[0].pitch_mm, band_);
    for (const SweptShape& shape : shapes_) leaves.apply(shape, threads);
    expect_same_cuts(leaves);
  }
}

TEST_P(CutBaselines, CsgDifferenceLeavesTheSameBone) {
  openvdb::initialize();
  // The block: 16 mm about the z axis, and 8 mm below z = 0.
  const auto block = [](float x, float y, float z) {
    const float dx = std::abs(x) - 8.0f, dy = std::abs(y) - 8.0f, dz = std::abs(z + 4.0f) - 4.0f;
    const float beyond = std::hypot(std::max(dx, 0.0f), std::max(dy, 0.0f), std::max(dz, 0.0f));
    return beyond > 0.0f ? beyond : std::max({dx, dy, dz});
  };
  CsgCut csg(ints(box_.min), ints(box_.max), shapes_[0].pitch_mm, band_, block);
  for (const SweptShape& shape : shapes_) csg.apply(shape);
  int bone = 0, near = 0, differing = 0;
  for_each_sample([&](int x, int y, int z, std::size_t i) {
    const float theirs = csg.at(x, y, z);
    bone += theirs < 0.0f;
    // On the cut's face, away from the block's own edges.
    if (std::abs(ours_[i]) > 0.25f || surface_[i] > -ours_[i] - 0.05f) return;
    ++near;
    differing += std::abs(theirs - solid_[i]) > kTolerance_mm;
  });
  EXPECT_GT(near, 1000);
  EXPECT_EQ(differing, 0);
  int ours = 0;
  for (const float f : solid_) ours += f < 0.0f;
  EXPECT_NEAR(bone, ours, 1e-4 * ours);
}

INSTANTIATE_TEST_SUITE_P(Tools, CutBaselines, testing::ValuesIn(works()), [](const auto& work) {
  std::string name = work.param.name;
  std::ranges::replace(name, ' ', '_');
  return name;
});

Mesh mesh_of(const CutField& field, const SurfaceBlocks& blocks, const BlockKey& key) {
  BlockSamples samples;
  Mesh mesh;
  gather_block(field, blocks, key, field.bone().pitch_mm(), samples);
  mesh_block(samples, mesh);
  return mesh;
}

TEST(FlyingEdgesBaseline, MakesTheWholeBone) {
  const CutField field(osteon::test::make_bone(
                           {Vec3(-8, -8, -8), Vec3(8, 8, 8)}, kPitch_mm, [](const Vec3& p) { return p.norm() - 6.03; },
                           [](const Vec3&) { return 1.9; }),
                       {});
  const SurfaceBlocks blocks{BodyId{}};
  const CoordBox b = field.bone().bounds_samples();
  std::size_t triangles = 0;
  for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
    for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
      for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z)
        triangles += mesh_of(field, blocks, {{}, 0, {x, y, z}}).triangles.size();
  vtkNew<vtkImageData> image;
  fill_image(*image, field, 0, b.grown(1));
  FlyingEdges flying_edges(image);
  flying_edges.run();
  EXPECT_GT(triangles, 1000u);
  EXPECT_EQ(flying_edges.triangles(), static_cast<long long>(triangles));
  EXPECT_NE(flying_edges.surface().GetPointData()->GetNormals(), nullptr);
}

// Every vertex on a cut face is in the crop. Every vertex in the crop is one of flying edges, too.
TEST(FlyingEdgesBaseline, CropHoldsWhatAFrameChanged) {
  CutField field(plain_block(16, 8, kPitch_mm), BodyId{});
  SurfaceBlocks blocks{BodyId{}};
  std::vector<Coord> changed;
  const Work work = works()[1];
  for (const Cut& cut : work.cuts) {
    const CutReport report = field.apply(cut);
    (void)blocks.touch(report.level, report.changed_leaves);
    changed.insert(changed.end(), report.changed_leaves.begin(), report.changed_leaves.end());
  }
  const CoordBox crop = crop_of(changed);
  vtkNew<vtkImageData> image;
  fill_image(*image, field, kLevel, crop);
  FlyingEdges flying_edges(image);
  flying_edges.run();
  const double pitch = level_pitch_mm(kPitch_mm, kLevel);
  // Vertices by where they are, in tenths of a sample; each also in the neighbouring places.
  std::unordered_set<Coord, CoordHash> places;
  const auto place = [](const Vec3& samples) {
    return Coord{static_cast<int>(std::lround(10 * samples.x())), static_cast<int>(std::lround(10 * samples.y())),
                 static_cast<int>(std::lround(10 * samples.z()))};
  };
  for (vtkIdType i = 0; i < flying_edges.surface().GetNumberOfPoints(); ++i) {
    double p[3];
    flying_edges.surface().GetPoint(i, p);
    const Coord at = place(Vec3(crop.min.x + p[2], crop.min.y + p[1], crop.min.z + p[0]));
    for (int n = 0; n < 27; ++n) places.insert(at + Coord{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
  }
  int ours = 0, missing = 0, beyond = 0;
  for (const BlockKey& key : blocks.fine_blocks()) {
    if (key.level != kLevel || blocks.seams(key).most() > 0) continue;
    const Mesh mesh = mesh_of(field, blocks, key);
    for (std::size_t i = 0; i < mesh.positions_mm.size(); ++i) {
      const auto& p = mesh.positions_mm[i];
      const Vec3 samples = Vec3(p[0], p[1], p[2]) / pitch;
      const Vec3 low(crop.min.x, crop.min.y, crop.min.z), high(crop.max.x, crop.max.y, crop.max.z);
      if ((samples.array() < low.array()).any() || (samples.array() > high.array()).any()) {
        beyond += mesh.cut_face[i];
        continue;
      }
      ++ours;
      missing += !places.contains(place(samples));
    }
  }
  EXPECT_EQ(beyond, 0);
  EXPECT_GT(ours, 500);
  EXPECT_EQ(missing, 0);
}

// Noise has many cells with an ambiguous face, and coarse values that are exactly 0. With bone above the isovalue both
// choose alike.
TEST(FlyingEdgesBaseline, KeepsBoneApartAsOsteonDoesIfItIsAbove) {
  std::mt19937 random(7);
  std::normal_distribution<float> noise;
  std::vector<float> solid(static_cast<std::size_t>(kBlockApron) * kBlockApron * kBlockApron);
  for (float& f : solid) f = std::nearbyint(8.0f * noise(random)) / 8.0f;
  EXPECT_GT(std::ranges::count(solid, 0.0f), 100);
  const Mesh mesh = *decode_block({}, encode_block(solid, solid, 0, 1.0), 1.0);
  const auto triangles = [&](Inside inside) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(kBlockSamples, kBlockSamples, kBlockSamples);
    image->AllocateScalars(VTK_FLOAT, 1);
    auto* out = static_cast<float*>(image->GetScalarPointer());
    for (int x = 1; x <= kBlockSamples; ++x)
      for (int y = 1; y <= kBlockSamples; ++y)
        for (int z = 1; z <= kBlockSamples; ++z) {
          const float f = solid[static_cast<std::size_t>((x * kBlockApron + y) * kBlockApron + z)];
          *out++ = inside == Inside::above ? -f : f;
        }
    FlyingEdges flying_edges(image, inside);
    flying_edges.run();
    return flying_edges.triangles();
  };
  EXPECT_EQ(triangles(Inside::above), static_cast<long long>(mesh.triangles.size()));
  EXPECT_NE(triangles(Inside::below), static_cast<long long>(mesh.triangles.size()));
}

TEST(DenseContactBaseline, EvaluatesWhatOsteonDoes) {
  const Tool tool = *find_tool("burr-round");
  CutField field(plain_block(20.0, 12.0, kPitch_mm), BodyId{});
  field.apply(straight_cut(tool, {-6, 0, -3}, {0, 0, -3}, -Vec3::UnitZ()));
  haptic::ToolModel model(tool, kPitch_mm, 1.0, 1024);
  std::vector<haptic::ContactPoint> points(model.active), none;
  const haptic::ContactSet set = haptic::contact_set(points, none, 0.15 * 0.5 * tool.diameter_mm);
  haptic::ContactQuery query;
  query.pose_bone_tool = {{0.1, 0.05, -3.02}, pose_along(Vec3::Zero(), Vec3(0.1, 0.05, -1).normalized()).rotation};
  query.groups = set.groups();
  query.margin_mm = 1e3;  // no group is skipped
  query.density = query.ahead = true;
  query.direction_bone = Vec3(1, 0, -0.3).normalized();
  query.ahead_mm = model.inset + 0.25 * model.fine_pitch_mm;
  query.most_mm = 2.0 * model.fine_pitch_mm;
  query.least_facing = 0.1;  // some points are left out
  query.strength = &model.strength;
  haptic::Patch patch;
  haptic::PatchBuilder().build(field, model, query.pose_bone_tool, patch);
  haptic::ContactValues values;
  values.make_room(static_cast<int>(set.x.size()));
  const haptic::ContactSums ours = haptic::evaluate_contact(patch, set, query, values);

  const PointArrays arrays = point_arrays(set);
  PointValues theirs = room_for(arrays);
  const ContactTotals totals =
      dense_contact(dense_solid(field, model.cut_level, {{-40, -40, -48}, {40, 40, 48}}),
                    dense_density(field.bone(), {{-12, -12, -14}, {12, 12, 14}}), arrays, contact_task(query), theirs);
  int compared = 0, in_bone = 0, left_out = 0;
  for (std::size_t i = 0; i < arrays.x.size(); ++i) {
    EXPECT_NEAR(theirs.density_g_cm3[i], values.density_g_cm3[i], 1e-4);
    left_out += values.distance_mm[i] == haptic::kLeftOut_mm;
    EXPECT_EQ(theirs.distance_mm[i] == haptic::kLeftOut_mm, values.distance_mm[i] == haptic::kLeftOut_mm);
    if (std::abs(values.distance_mm[i]) > 0.4f) continue;  // beyond this, samples are clipped differently
    ++compared;
    in_bone += values.distance_mm[i] < 0.0f;
    EXPECT_NEAR(theirs.distance_mm[i], values.distance_mm[i], 1e-4);
    const double apart =
        std::hypot(theirs.gx[i] - values.gx[i], theirs.gy[i] - values.gy[i], theirs.gz[i] - values.gz[i]);
    EXPECT_LT(apart, 1e-2);
  }
  EXPECT_GT(compared, 100);
  EXPECT_GT(in_bone, 30);
  EXPECT_GT(left_out, 30);
  const auto close = [](double a, double b) { EXPECT_NEAR(a, b, 1e-3 * std::abs(b) + 1e-6); };
  close(totals.area, ours.area_mm2);
  close(totals.engaged, ours.engaged_mm2);
  close(totals.density, ours.density_mm2);
  close(totals.milling, ours.milling);
  close(totals.arm, ours.arm_mm3);
  close(totals.turned, ours.turned_area_mm2);
  close(totals.edge, ours.edge);
  EXPECT_NEAR(totals.nearest, ours.nearest_mm, 1e-4);
  const Vec3 force(totals.force[0], totals.force[1], totals.force[2]);
  const Vec3 torque(totals.torque[0], totals.torque[1], totals.torque[2]);
  EXPECT_GT(ours.force.norm(), 0.1);
  EXPECT_LT((force - ours.force).norm(), 1e-3 * ours.force.norm());
  EXPECT_LT((torque - ours.torque).norm(), 1e-3 * ours.torque.norm());
}

TEST(FilterBaselines, GiveWhatOursGive) {
  imaging::HuVolume volume;
  volume.dims = {33, 20, 17};
  volume.values.resize(volume.count());
  std::mt19937 random(3);
  for (std::int16_t& hu : volume.values) hu = static_cast<std::int16_t>(static_cast<int>(random() % 4096) - 1024);
  const auto always = [](double) { return true; };
  imaging::HuVolume median = volume, gaussian = volume;
  ASSERT_TRUE(imaging::smooth_median(median, imaging::MedianBox::volume, always));
  EXPECT_EQ(itk_filtered(volume, ItkFilter::median).values, median.values);

  // Discrete and recursive Gaussians are approximations of ours, closer for a large sigma. Noise of 1182 HU (uniform)
  // shows an error of a hundredth of the weights as about a dozen HU.
  constexpr double kSigma_voxels = 2.0;
  ASSERT_TRUE(imaging::smooth_gaussian(gaussian, kSigma_voxels, always));
  for (const ItkFilter filter : {ItkFilter::gaussian, ItkFilter::recursive_gaussian}) {
    const ItkResult theirs = itk_filtered(volume, filter, kSigma_voxels);
    ASSERT_EQ(theirs.values.size(), gaussian.values.size());
    double squares = 0.0;
    for (std::size_t i = 0; i < theirs.values.size(); ++i)
      squares += std::pow(theirs.values[i] - gaussian.values[i], 2.0);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(theirs.values.size())), 12.0);
  }
}

TEST(DecodeBaseline, ReadsEveryVoxelOfEverySlice) {
  imaging::HuVolume volume;
  volume.dims = {4, 3, 5};
  volume.values.assign(volume.count(), 40);
  const osteon::test::TempDir folder;
  const auto decoded = [&](const char* name) {
    EXPECT_TRUE(import::write_dicom_series(volume, folder / name, [](double) { return true; }));
    return gdcm_decode(folder / name);
  };
  const GdcmDecoded before = decoded("before");
  EXPECT_EQ(before.slices, 5);
  EXPECT_EQ(before.bytes, 2 * volume.count());
  // Whatever number is stored for a HU, one more is one more.
  std::int64_t more = 0;
  for (std::size_t i = 0; i < volume.count(); ++i)
    volume.values[i] += static_cast<std::int16_t>(i), more += static_cast<std::int64_t>(i);
  EXPECT_EQ(decoded("after").sum - before.sum, more);
}

}  // namespace
}  // namespace osteon::baselines
