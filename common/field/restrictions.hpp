// What an instructor has decided about one hand: all that holds, not what has changed. A row of the room; the hand's
// own loop keeps to it as well, so that nothing is predicted that the room would refuse.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/rejection.hpp"

namespace osteon {

// A ball in the bone's frame, in steps of kQuantum_mm.
struct ZoneLimit {
  std::array<std::int32_t, 3> centre{};
  std::int32_t radius = 0;
  [[nodiscard]] bool contains(const std::array<std::int32_t, 3>& tip) const;
  friend bool operator==(const ZoneLimit&, const ZoneLimit&) = default;
};

struct Restrictions {
  bool stopped = false;  // may not cut
  AuthorId taken_by{};   // who holds its tool; null: itself
  AuthorId guide{};      // along whose tool the hand is pulled; null: nobody's
  int guide_share = 0;   // how firmly, 1000: as firmly as the device may
  int force_limit = 0;   // most that the hand is made to feel and cuts with, steps of 0.01 N; 0: no such limit
  std::optional<ZoneLimit> zone{};  // where the tip must be to cut; none: anywhere
  std::vector<Digest> tools{};      // that it may cut with, sorted; none: all
  std::string words{};              // why, shown to the trainee

  [[nodiscard]] bool may_cut() const { return !stopped && !taken_by; }
  [[nodiscard]] double force_limit_n() const { return 0.01 * force_limit; }
  friend bool operator==(const Restrictions&, const Restrictions&) = default;
};

// Whose word it is, as far as that is known.
struct Decider {
  AuthorId author{};   // null: nobody knows
  std::string name{};  // empty: nobody knows
  friend bool operator==(const Decider&, const Decider&) = default;
};

inline constexpr int kWholeShare = 1000;
inline constexpr int kMostForceLimit = 10'000;  // 100 N
inline constexpr std::size_t kMostLimitedTools = 64, kMostSupervisionWords = 256;

// Error invalid_input: a number out of range, tools unsorted or too many, words too long. Names the field.
[[nodiscard]] Result<void> check(const Restrictions& supervision);

// Why a hand under it may not make this cut: frozen, taken, forbidden_tool, zone; none: it may.
[[nodiscard]] Rejection breach(const Restrictions& supervision, const Cut& cut);

}  // namespace osteon
