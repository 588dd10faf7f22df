// What an instructor has decided about one person: all that holds, not only what has changed. It is part of the room's
// state. The person's haptic loop obeys it as well, so that nothing is predicted that the room would reject.
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
  bool stopped = false;             // may not cut
  AuthorId taken_by{};              // who has taken over the person's tool; null: nobody
  AuthorId guide{};                 // author whose tool guides the person's tool; null: nobody
  int guide_share = 0;              // strength of the guidance; 1000: the device's limit
  int force_limit = 0;              // largest force that the person feels and cuts with, steps of 0.01 N; 0: no limit
  std::optional<ZoneLimit> zone{};  // where the tip must be to cut; none: anywhere
  std::vector<Digest> tools{};      // tools that the person may cut with, sorted; none: all
  std::string words{};              // reason, shown to the trainee

  [[nodiscard]] bool may_cut() const { return !stopped && !taken_by; }
  [[nodiscard]] double force_limit_n() const { return 0.01 * force_limit; }
  friend bool operator==(const Restrictions&, const Restrictions&) = default;
};

// Who decided, if known.
struct Decider {
  AuthorId author{};   // null: unknown
  std::string name{};  // empty: unknown
  friend bool operator==(const Decider&, const Decider&) = default;
};

inline constexpr int kWholeShare = 1000;
inline constexpr int kMostForceLimit = 10000;  // 100 N
inline constexpr std::size_t kMostLimitedTools = 64, kMostSupervisionWords = 256;

// Error invalid_input, naming the field: a number out of range, tools unsorted or too many, words too long.
[[nodiscard]] Result<void> check(const Restrictions& supervision);

// Why these restrictions forbid the cut: frozen, taken, forbidden_tool, zone. none: it is allowed.
[[nodiscard]] Rejection breach(const Restrictions& supervision, const Cut& cut);

}  // namespace osteon
