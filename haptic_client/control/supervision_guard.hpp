// What an instructor has decided about this hand, as the haptic loop keeps to it: where nothing may be cut the spindle
// runs down and the tool rubs, as in a room that is held; no more is felt or cut with than was allowed. The room would
// refuse what is kept from being predicted here.
#pragma once
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/field/restrictions.hpp"
#include "common/geometry/pose.hpp"
#include "haptic_client/control/tool_model.hpp"

namespace osteon::haptic {

// A Restrictions of fixed size, so that it crosses to the haptic thread by TripleBuffer.
struct HapticRestrictions {
  static constexpr std::size_t kMostTools = 256;
  RoomSeq room_seq;               // since when it holds
  std::uint64_t lease_epoch = 0;  // of the hand's lease since then
  bool stopped = false;
  AuthorId taken_by, guide;  // null: nobody
  double guide_share = 0;    // 0 … 1
  double force_limit_n = 0;  // physical; 0: none
  std::optional<ZoneLimit> zone;
  bool some_tools = false;            // only those that are not forbidden
  std::bitset<kMostTools> forbidden;  // of the loop's tools

  [[nodiscard]] bool may_cut() const noexcept { return !stopped && !taken_by; }
};
// `tools`: the loop's.
[[nodiscard]] HapticRestrictions haptic_restrictions(const Restrictions& supervision, RoomSeq place,
                                                     std::uint64_t lease_epoch, std::span<const ToolModel> tools);

// What holds, for a line of a log; empty: nothing does.
[[nodiscard]] std::string in_words(const Restrictions& supervision);
// "Dr. Weber", fit for a terminal; "#3" for somebody without a name; empty: nobody knows.
[[nodiscard]] std::string called(const Decider& by);

// What the newest datagram says of the hand. It may come before the row that it stands for, which may be lost or wait
// for others; epochs say which of the two is newer.
struct StopFlag {
  std::uint64_t lease_epoch = 0;
  bool frozen = false;
};
// In a word that is written and read without a lock.
[[nodiscard]] constexpr std::uint64_t packed(const StopFlag& flag) {
  return flag.lease_epoch << 1 | (flag.frozen ? 1u : 0u);
}
[[nodiscard]] constexpr StopFlag unpacked(std::uint64_t word) { return {word >> 1, (word & 1) != 0}; }

// Keeps to it, tick by tick. [haptic]
class SupervisionGuard {
 public:
  // Where a tool's path lies inside a zone its tip may lie so much farther out: the play of its hole, and a tick's way.
  static constexpr double kEdge_mm = 0.4;

  void set(const HapticRestrictions& oversight) noexcept { now_ = oversight; }
  void set(const StopFlag& flag) noexcept { flag_ = flag; }
  [[nodiscard]] const HapticRestrictions& now() const noexcept { return now_; }
  // By a row or, before it has come, by a datagram.
  [[nodiscard]] bool stopped() const noexcept {
    return !now_.may_cut() || (flag_.frozen && flag_.lease_epoch > now_.lease_epoch);
  }
  // Whether this tool may cut with its tip there, bone frame; a little within the zone's edge.
  [[nodiscard]] bool may_cut(int tool, const Vec3& tip_mm) const noexcept;
  // Whether the room takes a path through there.
  [[nodiscard]] bool takes(const Vec3& tip_mm) const noexcept;

  // The most that is to be felt and cut with in this tick, N, of physical force: what the device may show, or what was
  // allowed, towards which it goes from `felt_n`, of the last tick, by at most `slew_n` a tick.
  [[nodiscard]] double limit_n(double device_n, double felt_n, double slew_n) noexcept;

 private:
  HapticRestrictions now_;
  StopFlag flag_;
  std::optional<double> cap_n_;  // none: the device's own
};

}  // namespace osteon::haptic
