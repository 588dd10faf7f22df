#include "server/room/cut_energy.hpp"

#include <algorithm>
#include <cmath>

#include "common/mechanics/bone_strength.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

constexpr int kSamples = 64;      // in the body, about
constexpr std::size_t kPoses = 3; // of the path, besides its last
constexpr double kJ_per_N_mm = 1e-3;

}  // namespace

const CutEnergy::Samples& CutEnergy::samples(const ToolBox::Entry& tool) {
  const auto known = samples_.find(tool.hash);
  if (known != samples_.end()) return known->second;
  const Implicit body = cut_solid(tool.tool);
  Vec3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = tool.body.lowest[static_cast<std::size_t>(axis)] * kQuantum_mm;
    high[axis] = tool.body.highest[static_cast<std::size_t>(axis)] * kQuantum_mm;
  }
  // The middles of cubes, made smaller until enough of them are inside: a blade is a small part of its box.
  Samples made;
  double edge_mm = std::cbrt((high - low).prod() / kSamples);
  for (int attempt = 0; attempt < 4 && made.at_mm.size() < kSamples / 2; ++attempt, edge_mm /= 1.6) {
    made.at_mm.clear();
    made.volume_mm3 = edge_mm * edge_mm * edge_mm;
    for (double x = low.x() + edge_mm / 2; x < high.x(); x += edge_mm)
      for (double y = low.y() + edge_mm / 2; y < high.y(); y += edge_mm)
        for (double z = low.z() + edge_mm / 2; z < high.z(); z += edge_mm)
          if (const Vec3 p{x, y, z}; body(p) < 0.0) made.at_mm.push_back(p);
  }
  return samples_.emplace(tool.hash, std::move(made)).first->second;
}

double CutEnergy::least_j(const Cut& cut, const ToolBox::Entry& tool, std::span<const CutField* const> fields) {
  const Samples& body = samples(tool);
  double most_j = 0;
  for (std::size_t i = 0; i <= kPoses; ++i) {
    const std::size_t knot = (cut.path.size() - 1) * i / kPoses;
    if (i > 0 && knot == (cut.path.size() - 1) * (i - 1) / kPoses) continue;
    const Pose pose = dequantise(cut.path[knot]);
    double energy_j = 0;
    for (const Vec3& at : body.at_mm) {
      const Vec3 p = pose.point(at);
      const bool bone = std::ranges::any_of(fields, [&](const CutField* field) { return field->solid_mm(p) < 0.0; });
      if (bone) energy_j += kJ_per_N_mm * ultimate_stress_mpa(fields.front()->bone().density_g_cm3(p)) * body.volume_mm3;
    }
    most_j = std::max(most_j, energy_j);
  }
  return most_j;
}

}  // namespace osteon
