#include "common/field/field_hash.hpp"

#include <algorithm>
#include <tuple>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"

namespace osteon {

void FieldLeaf::expand() {
  if (is_constant()) values.resize(kLeafVoxels, values.front());
}

void FieldLeaf::compact() {
  if (values.empty() || is_constant() ||
      !std::ranges::all_of(values, [&](std::int16_t v) { return v == values.front(); }))
    return;
  values = std::vector<std::int16_t>{values.front()};
}

bool operator==(const FieldLeaf& a, const FieldLeaf& b) {
  if (a.body != b.body || a.level != b.level || a.origin != b.origin) return false;
  if (a.values.size() == b.values.size()) return a.values == b.values;
  if (!a.holds_values() || !b.holds_values()) return false;
  const FieldLeaf& one = a.is_constant() ? a : b;
  const FieldLeaf& all = a.is_constant() ? b : a;
  return std::ranges::all_of(all.values, [&](std::int16_t v) { return v == one.values.front(); });
}

Digest field_hash(std::vector<FieldLeaf> leaves, double pitch_mm) {
  std::ranges::sort(leaves, {}, [](const FieldLeaf& leaf) { return std::tuple(leaf.body, leaf.level, leaf.origin); });
  Hasher hasher;
  std::vector<std::byte> bytes(std::size_t{2} * kLeafVoxels);
  for (const FieldLeaf& leaf : leaves) {
    OSTEON_CHECK(leaf.holds_values());
    const std::int32_t band = band_quanta(level_pitch_mm(pitch_mm, leaf.level));
    if (std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == band; })) continue;
    hasher.integer(leaf.body.value);
    hasher.integer(static_cast<std::uint64_t>(leaf.level));
    for (const std::int32_t index : {leaf.origin.x, leaf.origin.y, leaf.origin.z})
      hasher.integer(static_cast<std::uint32_t>(index));
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      const auto value = static_cast<std::uint16_t>(leaf.value(i));
      bytes[2 * i] = static_cast<std::byte>(value & 255);
      bytes[2 * i + 1] = static_cast<std::byte>(value >> 8);
    }
    hasher.bytes(bytes);
  }
  return hasher.finish();
}

}  // namespace osteon
