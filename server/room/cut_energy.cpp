#include "server/room/cut_energy.hpp"

#include <algorithm>
#include <cmath>

#include "common/mechanics/bone_strength.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

constexpr int kSamples = 64, kMostTried = 20'000;
constexpr std::size_t kPoses = 3;  // of the path, besides its last
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
  // Halton's points: no two lie in one plane, so an advancing tool meets them one by one. Draws as many as it takes,
  // because a blade fills only a small part of its box.
  const auto halton = [](int index, int base) {
    double value = 0, part = 1;
    for (; index > 0; index /= base) value += (part /= base) * (index % base);
    return value;
  };
  Samples made;
  int tried = 0;
  while (static_cast<int>(made.at_mm.size()) < kSamples && tried < kMostTried) {
    ++tried;
    const Vec3 p = low + Vec3(halton(tried, 2), halton(tried, 3), halton(tried, 5)).cwiseProduct(high - low);
    if (body(p) < 0.0) made.at_mm.push_back(p);
  }
  made.volume_mm3 = (high - low).prod() / tried;
  return samples_.emplace(tool.hash, std::move(made)).first->second;
}

double CutEnergy::resolution_j(const ToolBox::Entry& tool) {
  return kJ_per_N_mm * ultimate_stress_mpa(kCorticalDensity) * samples(tool).volume_mm3;
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
      if (bone)
        energy_j += kJ_per_N_mm * ultimate_stress_mpa(fields.front()->bone().density_g_cm3(p)) * body.volume_mm3;
    }
    most_j = std::max(most_j, energy_j);
  }
  return most_j;
}

}  // namespace osteon
