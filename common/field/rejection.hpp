// Why a room rejects a cut. The author of the cut receives the reason, and journals store it.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace osteon {

// Stored in journals and sent, so the numbers never change. The protocol has the same numbers (RejectionReason).
enum class Rejection : std::uint8_t {
  none = 0,
  body = 1,
  lease = 2,
  tool = 3,
  level = 4,
  path = 5,
  rotation = 6,
  place = 7,
  sweep = 8,
  spindle = 9,
  time = 10,
  rate = 11,
  power = 12,
  frozen = 13,
  taken = 14,
  forbidden_tool = 15,
  zone = 16,
  metal = 17,
};

// What programs and people read about a reason. Programs compare numbers, never sentences.
struct RejectionText {
  Rejection reason;
  std::string_view name;      // label of the metric osteon_rejections_total
  std::string_view sentence;  // for people
};
inline constexpr std::array<RejectionText, 18> kRejectionTexts{{
    {Rejection::none, "none", "the cut was applied"},
    {Rejection::body, "body", "the room has no such body"},
    {Rejection::lease, "lease", "the cut was made under a tool lease that has ended"},
    {Rejection::tool, "tool", "the tool is not registered in the room, or does not cut"},
    {Rejection::level, "level", "the level is finer than the tool or the case allows"},
    {Rejection::path, "path", "the path has no poses or more than a cut may have"},
    {Rejection::rotation, "rotation", "a rotation on the path is not a unit quaternion"},
    {Rejection::place, "place", "the path leaves the surroundings of the bone"},
    {Rejection::sweep, "sweep", "the path is longer than one cut may sweep"},
    {Rejection::spindle, "spindle", "the spindle is faster than any tool turns"},
    {Rejection::time, "time", "the tool has worked longer than time has passed"},
    {Rejection::rate, "rate", "the tool sweeps more than the room can follow"},
    {Rejection::power, "power", "the tool removes more bone than any motor can"},
    {Rejection::frozen, "frozen", "an instructor has stopped this person"},
    {Rejection::taken, "taken", "an instructor has taken over this person's tool"},
    {Rejection::forbidden_tool, "forbidden_tool", "an instructor allows this person only other tools"},
    {Rejection::zone, "zone", "an instructor allows this person to cut only in another place"},
    {Rejection::metal, "metal", "the cut would remove metal"},
}};
inline constexpr int kRejections = static_cast<int>(kRejectionTexts.size());
static_assert(
    [] {
      for (std::size_t i = 0; i < kRejectionTexts.size(); ++i)
        if (static_cast<std::size_t>(kRejectionTexts[i].reason) != i) return false;
      return true;
    }(),
    "each reason is at its own number");

// Rejection::none for a number that this version does not know.
[[nodiscard]] constexpr Rejection rejection_of(std::uint32_t number) noexcept {
  return number < kRejectionTexts.size() ? static_cast<Rejection>(number) : Rejection::none;
}
[[nodiscard]] constexpr std::string_view name(Rejection reason) noexcept {
  const auto number = static_cast<std::size_t>(reason);
  return number < kRejectionTexts.size() ? kRejectionTexts[number].name : "unknown";
}
[[nodiscard]] constexpr std::string_view sentence(Rejection reason) noexcept {
  const auto number = static_cast<std::size_t>(reason);
  return number < kRejectionTexts.size() ? kRejectionTexts[number].sentence : "the reason is unknown";
}

}  // namespace osteon
