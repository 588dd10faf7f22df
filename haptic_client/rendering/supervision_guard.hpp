// Applies an instructor's restrictions for this hand in the haptic loop. Where nothing may be cut, the spindle runs
// down and the tool rubs, as in a room that is held. Force felt and force used to cut stay within the permitted limit.
// The room would reject the cuts that are not predicted here.
#pragma once
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/field/restrictions.hpp"
#include "common/geometry/pose.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

// Restrictions of fixed size, so that they cross to the haptic thread by TripleBuffer.
struct HapticRestrictions {
  static constexpr std::size_t kMostTools = 256;
  RoomSeq room_seq;               // the event that set it
  std::uint64_t lease_epoch = 0;  // of the hand's lease since then
  bool stopped = false;
  AuthorId taken_by, guide;  // null: nobody
  double guide_share = 0;    // 0 … 1
  double force_limit_n = 0;  // physical; 0: none
  std::optional<ZoneLimit> zone;
  bool some_tools = false;            // only tools that are not forbidden
  std::bitset<kMostTools> forbidden;  // by index of the loop's tools

  [[nodiscard]] bool may_cut() const noexcept { return !stopped && !taken_by; }
};
// `tools`: the loop's.
[[nodiscard]] HapticRestrictions haptic_restrictions(const Restrictions& supervision, RoomSeq room_seq,
                                                     std::uint64_t lease_epoch, std::span<const ToolModel> tools);

// The restrictions in words, for a line of a log; empty: there are none.
[[nodiscard]] std::string in_words(const Restrictions& supervision);
// "Dr. Weber", safe for a terminal; "#3" for a person without a name; empty: unknown.
[[nodiscard]] std::string called(const Decider& by);

// What the newest datagram says about the hand. It may arrive before its log entry, which may be lost or wait for
// others. The epochs say which of the two is newer.
struct StopFlag {
  std::uint64_t lease_epoch = 0;
  bool frozen = false;
};
// As one word that is written and read without a lock.
[[nodiscard]] constexpr std::uint64_t packed(const StopFlag& flag) {
  return flag.lease_epoch << 1 | (flag.frozen ? 1u : 0u);
}
[[nodiscard]] constexpr StopFlag unpacked(std::uint64_t word) { return {word >> 1, (word & 1) != 0}; }

// Applies the restrictions, tick by tick. [haptic]
class SupervisionGuard {
 public:
  // The tip may be this much outside a zone while the tool's path is inside: the play of its hole, and the motion of
  // one tick.
  static constexpr double kEdge_mm = 0.4;

  void set(const HapticRestrictions& restrictions) noexcept { now_ = restrictions; }
  void set(const StopFlag& flag) noexcept { flag_ = flag; }
  [[nodiscard]] const HapticRestrictions& now() const noexcept { return now_; }
  // By a log entry or, before it has arrived, by a datagram.
  [[nodiscard]] bool stopped() const noexcept {
    return !now_.may_cut() || (flag_.frozen && flag_.lease_epoch > now_.lease_epoch);
  }
  // Whether this tool may cut with its tip there, bone frame; the limit is a little inside the zone's edge.
  [[nodiscard]] bool may_cut(int tool, const Vec3& tip_mm) const noexcept;
  // Whether the room takes a path through there.
  [[nodiscard]] bool takes(const Vec3& tip_mm) const noexcept;

  // Largest physical force to be felt and to cut with in this tick, N: what the device may show, or the permitted
  // limit. From the last tick's `felt_n` it approaches the permitted limit by at most `slew_n` a tick.
  [[nodiscard]] double limit_n(double device_n, double felt_n, double slew_n) noexcept;

 private:
  HapticRestrictions now_;
  StopFlag flag_;
  std::optional<double> cap_n_;  // none: the device's own limit
};

}  // namespace osteon::haptic
