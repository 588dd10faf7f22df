#include "server/publish/view_interest.hpp"

#include <algorithm>

namespace osteon {

void ViewInterest::open(AuthorId viewer, const std::optional<ViewFrustum>& look) {
  const MutexLock lock(mutex_);
  Viewer& entry = viewers_[viewer];
  ++entry.streams;
  entry.look = look;
}

void ViewInterest::close(AuthorId viewer) {
  const MutexLock lock(mutex_);
  const auto entry = viewers_.find(viewer);
  if (entry != viewers_.end() && --entry->second.streams == 0) viewers_.erase(entry);
}

bool ViewInterest::look(AuthorId viewer, const ViewFrustum& from) {
  const MutexLock lock(mutex_);
  const auto entry = viewers_.find(viewer);
  if (entry == viewers_.end()) return false;
  entry->second.look = from;
  return true;
}

std::optional<std::vector<Focus>> ViewInterest::focuses(double pitch_mm, std::span<const Vec3> tool_tips_mm) {
  std::vector<Focus> wanted{focus_on_nothing()};
  {
    const MutexLock lock(mutex_);
    if (viewers_.empty()) return std::nullopt;
    for (const auto& [author, viewer] : viewers_)
      if (viewer.look) wanted.push_back(focus_of(*viewer.look, pitch_mm));
    for (const Vec3& tip_mm : tool_tips_mm) wanted.push_back(focus_of_tool(tip_mm));
    if (std::ranges::any_of(viewers_, [](const auto& entry) { return !entry.second.look; })) wanted.clear();
  }
  const auto same = [](const Focus& a, const Focus& b) { return nearly_equal(a, b); };
  if (std::ranges::equal(followed_, wanted, same)) return std::nullopt;
  followed_ = wanted;
  return wanted;
}

}  // namespace osteon
