#include "haptic_client/contact/cortex_probe.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/field/tissue.hpp"

namespace osteon::haptic {
namespace {

constexpr double kStep_mm = 0.4;       // between samples: below the pitch of most cases
constexpr double kBeside_mm = 1.0;     // from the tool's wall to a line
constexpr double kBehind_mm = 1.6;     // a point or tooth cuts up to here behind its end [A]
constexpr double kLeastForce_n = 0.2;  // from which a force has a direction

// Positive in cortical bone that still stands, and not finite beyond the patch.
double margin_at(const Patch& patch, const Vec3& at_mm) noexcept {
  double solid_mm = 0.0, density = 0.0;
  if (!patch.solid(at_mm, solid_mm) || !patch.density.sample(at_mm, density))
    return -std::numeric_limits<double>::infinity();
  return std::min(-solid_mm, density - static_cast<double>(kCorticalFrom_g_cm3));
}

// Way from a point in the layer to its end. `margin`: at that point.
double to_the_end_mm(const Patch& patch, const Vec3& from_mm, const Vec3& direction, double margin) noexcept {
  double way_mm = 0.0;
  while (way_mm < CortexProbe::kFarthest_mm) {
    const double next = margin_at(patch, from_mm + (way_mm + kStep_mm) * direction);
    if (!(next > 0.0)) return way_mm + (std::isfinite(next) ? kStep_mm * margin / (margin - next) : 0.0);
    margin = next;
    way_mm += kStep_mm;
  }
  return way_mm;
}

// The layer on a line, if the tool's end is in one. `from_mm`: beside the foremost point that cuts.
double layer_mm(const Patch& patch, const Vec3& from_mm, const Vec3& direction) noexcept {
  for (double back_mm = -kStep_mm; back_mm < kBehind_mm + 0.5 * kStep_mm; back_mm += kStep_mm) {
    const Vec3 at_mm = from_mm - back_mm * direction;
    const double margin = margin_at(patch, at_mm);
    if (!(margin > 0.0)) continue;
    return to_the_end_mm(patch, at_mm, direction, margin) + to_the_end_mm(patch, at_mm, -direction, margin);
  }
  return 0.0;
}

// Where a line begins, tool frame.
Vec3 beside(const ToolModel& model, const Vec3& into, std::size_t line) noexcept {
  const Tool& tool = model.tool;
  const double side = line % 2 == 0 ? 1.0 : -1.0;
  // The plate's normal is y. Across it the kerf is narrow.
  if (model.feed == Feeding::in_plane)
    return {(line < 2 ? 0.25 : -0.25) * tool.width_mm, side * (0.5 * (tool.thickness_mm + tool.set_mm) + kBeside_mm),
            0.0};
  const Vec3 across = line < 2 ? into.unitOrthogonal() : into.cross(into.unitOrthogonal());
  const double radius_mm = 0.5 * tool.diameter_mm;
  const Vec3 end_mm = model.axial ? Vec3(Vec3::Zero()) : Vec3(radius_mm * (into - Vec3::UnitZ()));
  return end_mm + side * (radius_mm + kBeside_mm) * across;
}

}  // namespace

void CortexProbe::step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_tool, bool touching,
                       const Vec3& on_bone_n) noexcept {
  const bool has_width = model.tool.diameter_mm > 0.0 || model.feed == Feeding::in_plane;
  if (!touching || !has_width || model.feed == Feeding::none || patch.version == 0) {
    lines_mm_ = {};
    into_.setZero();
    return;
  }
  if (!model.axial) {
    Vec3 force_n = pose_bone_tool.rotation.conjugate() * on_bone_n;
    if (model.feed == Feeding::in_plane) force_n.y() = 0.0;
    if (force_n.norm() > kLeastForce_n) into_ = force_n.normalized();
  }
  const Vec3 into = into_.isZero() ? Vec3(Vec3::UnitZ()) : into_;
  lines_mm_[next_] = layer_mm(patch, pose_bone_tool.point(beside(model, into, next_)), pose_bone_tool.direction(into));
  next_ = (next_ + 1) % lines_mm_.size();
}

double CortexProbe::thickness_mm() const noexcept {
  std::array<double, 4> found{};
  const auto end = std::ranges::copy_if(lines_mm_, found.begin(), [](double mm) { return mm > 0.0; }).out;
  const auto count = static_cast<std::size_t>(end - found.begin());
  if (count == 0) return 0.0;
  std::sort(found.begin(), end);
  return 0.5 * (found[(count - 1) / 2] + found[count / 2]);
}

}  // namespace osteon::haptic
