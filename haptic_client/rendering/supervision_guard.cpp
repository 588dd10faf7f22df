#include "haptic_client/rendering/supervision_guard.hpp"

#include <algorithm>

namespace osteon::haptic {

HapticRestrictions haptic_restrictions(const Restrictions& supervision, RoomSeq room_seq, std::uint64_t lease_epoch,
                                       std::span<const ToolModel> tools) {
  HapticRestrictions out;
  out.room_seq = room_seq;
  out.lease_epoch = lease_epoch;
  out.stopped = supervision.stopped;
  out.taken_by = supervision.taken_by;
  out.guide = supervision.guide;
  out.guide_share = static_cast<double>(supervision.guide_share) / kWholeShare;
  out.force_limit_n = supervision.force_limit_n();
  out.zone = supervision.zone;
  out.some_tools = !supervision.tools.empty();
  for (std::size_t i = 0; i < std::min(tools.size(), HapticRestrictions::kMostTools); ++i)
    out.forbidden[i] = out.some_tools && !std::ranges::binary_search(supervision.tools, tools[i].tool.hash());
  return out;
}

std::string in_words(const Restrictions& now) {
  std::string words;
  const auto add = [&](const std::string& one) { words += (words.empty() ? "" : ", ") + one; };
  if (now.stopped) add("stopped");
  if (now.taken_by) add("tool taken by " + std::to_string(now.taken_by.value));
  if (now.guide)
    add("led by " + std::to_string(now.guide.value) + " with a share of " + std::to_string(now.guide_share));
  if (now.force_limit > 0) add("no more than " + std::to_string(now.force_limit) + " hundredths of a newton");
  if (now.zone) add("within a ball only");
  if (!now.tools.empty()) add("with " + std::to_string(now.tools.size()) + " tools only");
  return words;
}

std::string called(const Decider& by) {
  std::string name = by.name;
  std::ranges::replace_if(
      name, [](unsigned char byte) { return byte < 0x20 || byte == 0x7f; }, '?');
  if (!name.empty()) return name;
  return by.author ? "#" + std::to_string(by.author.value) : std::string();
}

bool SupervisionGuard::may_cut(int tool, const Vec3& tip_mm) const noexcept {
  if (stopped()) return false;
  const auto index = static_cast<std::size_t>(tool);
  if (now_.some_tools && (index >= HapticRestrictions::kMostTools || now_.forbidden[index])) return false;
  if (!now_.zone) return true;
  const Vec3 centre_mm(now_.zone->centre[0], now_.zone->centre[1], now_.zone->centre[2]);
  return (tip_mm - kQuantum_mm * centre_mm).norm() <= kQuantum_mm * now_.zone->radius - kEdge_mm;
}

bool SupervisionGuard::takes(const Vec3& tip_mm) const noexcept {
  return !now_.zone || now_.zone->contains(quantise(Pose{tip_mm, Eigen::Quaterniond::Identity()}).position);
}

double SupervisionGuard::limit_n(double device_n, double felt_n, double slew_n) noexcept {
  if (now_.force_limit_n > 0.0) {
    const double from_n = cap_n_ ? *cap_n_ : std::min(device_n, std::max(felt_n, now_.force_limit_n));
    cap_n_ = std::clamp(now_.force_limit_n, from_n - slew_n, from_n + slew_n);
  } else if (cap_n_) {
    *cap_n_ += slew_n;
    if (*cap_n_ >= device_n) cap_n_.reset();
  }
  return cap_n_ ? std::min(*cap_n_, device_n) : device_n;
}

}  // namespace osteon::haptic
