#include "haptic_client/contact/patch_builder.hpp"

#include <algorithm>
#include <cmath>

#include "common/field/kernel.hpp"

namespace osteon::haptic {
namespace {

constexpr std::size_t kMostKeptBricks = 20000;

CoordBox brick_samples(Coord index) {
  const Coord first = kBrickCells * index;
  return {first, first + Coord{kBrickCells, kBrickCells, kBrickCells}};
}

// Bricks of this pitch that touch the box.
CoordBox bricks_in(const Box& box, double pitch_mm) {
  const CoordBox samples = covering_samples(box, pitch_mm);
  return {shift_down(samples.min, 3), shift_down(samples.max, 3)};
}

Vec3 brick_centre_mm(Coord index, double pitch_mm) {
  return (kBrickCells * pitch_mm) * Vec3(index.x + 0.5, index.y + 0.5, index.z + 0.5);
}

// Box of a part of the tool between two positions on its axis.
Box tool_box(const ToolModel& model, const Pose& pose, double from_z_mm, double to_z_mm) {
  const Box& solid = model.solid.bounds;
  Box box;
  for (int corner = 0; corner < 8; ++corner)
    box.include(pose.point({corner & 4 ? solid.max_mm.x() : solid.min_mm.x(),
                            corner & 2 ? solid.max_mm.y() : solid.min_mm.y(), corner & 1 ? from_z_mm : to_z_mm}));
  return box;
}

template <class Visit>
void for_each(const CoordBox& box, const Visit& visit) {
  for (Coord c{box.min.x, 0, 0}; c.x <= box.max.x; ++c.x)
    for (c.y = box.min.y; c.y <= box.max.y; ++c.y)
      for (c.z = box.min.z; c.z <= box.max.z; ++c.z) visit(c);
}

}  // namespace

void PatchBuilder::changed(double pitch_mm, int level, const std::vector<Coord>& leaf_origins) {
  const double leaf_pitch = level_pitch_mm(pitch_mm, level);
  for (const Coord& origin : leaf_origins) {
    const auto forget = [&](Store& store, int of_level) {
      if (store.empty()) return;
      // Finer samples are interpolated up to the next leaf. They lie in bricks that hold samples of this one too.
      static_assert(1 << (kLevels - 1) <= kBrickCells);
      const Box box{position_mm(origin, leaf_pitch),
                    position_mm(origin + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}, leaf_pitch)};
      const double pitch = level_pitch_mm(pitch_mm, of_level);
      CoordBox bricks = bricks_in(box, pitch);
      // The apron of the brick below also holds these samples.
      bricks.min = bricks.min - Coord{1, 1, 1};
      for_each(bricks, [&](Coord index) {
        const CoordBox samples = brick_samples(index);
        const Vec3 low = position_mm(samples.min, pitch), high = position_mm(samples.max, pitch);
        if ((low.array() <= box.max_mm.array()).all() && (high.array() >= box.min_mm.array()).all()) store.erase(index);
      });
    };
    if (fine_level_ >= 0) forget(fine_, fine_level_);
    forget(coarse_, 0);
  }
}

std::shared_ptr<const Brick> PatchBuilder::brick(Store& store, std::span<const CutField* const> bodies, int level,
                                                 Coord index, Quantity quantity) {
  const Case& bone = bodies.front()->bone();
  auto& kept = store[index];
  if (kept) return kept;
  const CoordBox samples = brick_samples(index);
  const CoordBox at_h{shift_down(samples.min, level), shift_down(samples.max, level) + Coord{1, 1, 1}};
  if (quantity == Quantity::solid && !bone.has_bone(at_h)) {
    if (!air_) {
      auto air = std::make_shared<Brick>();
      air->values.fill(static_cast<float>(kBandVoxels * bone.pitch_mm()));
      air_ = air;
    }
    return kept = air_;
  }
  auto made = std::make_shared<Brick>();
  if (quantity == Quantity::density) {
    bone.gather_density(samples, made->values);
  } else {
    bodies.front()->gather_solid(level, samples, made->values);
    Brick other;
    for (const CutField* body : bodies.subspan(1)) {
      body->gather_solid(level, samples, other.values);
      for (std::size_t i = 0; i < made->values.size(); ++i)
        made->values[i] = std::min(made->values[i], other.values[i]);
    }
  }
  ++bricks_made_;
  return kept = made;
}

std::shared_ptr<const Brick> PatchBuilder::metal_brick(const Case& bone, Coord index) {
  const CoordBox samples = brick_samples(index), around = samples.grown(1);
  if (!bone.has_metal(around)) return nullptr;
  auto& kept = metal_[index];
  if (kept) return kept;
  auto made = std::make_shared<Brick>();
  std::size_t i = 0;
  for_each(samples, [&](Coord at) {
    // Between metal and air, everything is metal up to the surface. Between metal and bone, it is metal up to the
    // middle.
    bool metal = bone.tissue(at) == Tissue::metal;
    if (!metal && bone.tissue(at) == Tissue::none)
      for_each(CoordBox{at, at}.grown(1), [&](Coord beside) { metal |= bone.tissue(beside) == Tissue::metal; });
    made->values[i++] = metal ? 1.0f : 0.0f;
  });
  ++bricks_made_;
  return kept = made;
}

void PatchBuilder::find_near(const ToolModel& model, const Pose& pose_tool_bone, const CoordBox& bricks,
                             double pitch_mm, double margin_mm) {
  near_.clear();
  const double edge_mm = kBrickCells * pitch_mm, half_diagonal_mm = 0.5 * std::sqrt(3.0) * edge_mm;
  // Between samples of a distance, trilinear values may be that much steeper than the distance.
  const double steepest = model.tool.kind == ToolKind::mesh ? std::sqrt(3.0) : 1.0;
  // A box of bricks is halved, unless none of its bricks is near by the distance of its middle.
  const auto halve = [&](const CoordBox& box, const auto& again) -> void {
    const Coord dims = box.dims(), across = box.min + box.max + Coord{1, 1, 1};
    const Vec3 middle_mm = 0.5 * edge_mm * Vec3(across.x, across.y, across.z);
    const double most_mm = 0.5 * edge_mm * steepest * Vec3(dims.x - 1, dims.y - 1, dims.z - 1).norm();
    const double distance_mm = model.solid(pose_tool_bone.point(middle_mm));
    if (distance_mm - most_mm >= margin_mm + half_diagonal_mm ||
        distance_mm + most_mm <= -half_diagonal_mm - model.fine_pitch_mm)
      return;
    if (dims == Coord{1, 1, 1}) {
      near_.push_back(box.min);
      return;
    }
    const auto longest = std::max({dims.x, dims.y, dims.z});
    CoordBox low = box, high = box;
    const auto part = [&](std::int32_t Coord::*axis) {
      low.max.*axis = box.min.*axis + longest / 2 - 1;
      high.min.*axis = box.min.*axis + longest / 2;
    };
    part(dims.x == longest ? &Coord::x : dims.y == longest ? &Coord::y : &Coord::z);
    again(low, again);
    again(high, again);
  };
  if (!bricks.empty()) halve(bricks, halve);
}

void PatchBuilder::build(std::span<const CutField* const> bodies, const ToolModel& model, const Pose& pose,
                         Patch& patch) {
  const double h = bodies.front()->bone().pitch_mm();
  const Tool& tool = model.tool;
  if (fine_level_ != model.cut_level || fine_.size() > kMostKeptBricks) fine_.clear();
  if (coarse_.size() > kMostKeptBricks) coarse_.clear(), density_.clear(), metal_.clear();
  // An added or removed body changed the bone everywhere.
  if (!std::ranges::equal(bodies_, bodies)) {
    fine_.clear();
    coarse_.clear();
    bodies_.assign(bodies.begin(), bodies.end());
  }
  fine_level_ = model.cut_level;
  const Pose pose_tool_bone = pose.inverse();

  const auto fill = [&](BrickGrid& grid, const CoordBox& bricks, double pitch, const auto& make) {
    grid.reset(pitch, bricks.min, bricks.max);
    for (const Coord index : near_) grid.set(index, make(index));
  };

  // The fine box ends a margin beyond the tip and reaches back as far as the sample limit allows.
  // A blade's plate runs in the kerf as its teeth do.
  const bool blade = model.feed == Feeding::in_plane;
  const double fine_reach_mm =
      params_.fine_samples * model.fine_pitch_mm - 2.0 * params_.fine_margin_mm - (blade ? 0.0 : tool.diameter_mm);
  const double back_mm = blade ? tool.reach_mm() : tool.cutting_length_mm;
  const Box fine_box = tool_box(model, pose, 0.0, -std::min(back_mm, std::max(1.0, fine_reach_mm)));
  const CoordBox fine = bricks_in(fine_box.grown(params_.fine_margin_mm), model.fine_pitch_mm);
  find_near(model, pose_tool_bone, fine, model.fine_pitch_mm, params_.fine_margin_mm);
  fill(patch.fine, fine, model.fine_pitch_mm,
       [&](Coord i) { return brick(fine_, bodies, model.cut_level, i, Quantity::solid); });

  const CoordBox coarse = bricks_in(tool_box(model, pose, 0.0, -tool.reach_mm()).grown(params_.coarse_margin_mm), h);
  find_near(model, pose_tool_bone, coarse, h, params_.coarse_margin_mm);
  fill(patch.coarse, coarse, h, [&](Coord i) { return brick(coarse_, bodies, 0, i, Quantity::solid); });
  fill(patch.density, coarse, h, [&](Coord i) { return brick(density_, bodies, 0, i, Quantity::density); });

  const Case& bone = bodies.front()->bone();
  patch.has_metal = false;
  if (!bone.metal_leaves().empty())
    fill(patch.metal, coarse, h, [&](Coord i) {
      std::shared_ptr<const Brick> made = metal_brick(bone, i);
      patch.has_metal |= made != nullptr;
      return made;
    });

  // The case's clearance never changes. It is computed again only when the tool has moved to other cells.
  const CoordBox cells = bricks_in(tool_box(model, pose, 0.0, -tool.reach_mm()).grown(params_.clearance_margin_mm), h);
  Clearance& clearance = patch.clearance;
  if (clearance.mm.empty() || clearance.cells != cells || clearance.bone != bone.hash()) {
    clearance.bone = bone.hash();
    clearance.cells = cells;
    clearance.cell_mm = kBrickCells * h;
    clearance.mm.clear();
    for_each(cells, [&](Coord index) {
      clearance.mm.push_back(static_cast<float>(bone.clearance_mm(brick_centre_mm(index, h))));
    });
  }
  ++patch.version;
}

}  // namespace osteon::haptic
