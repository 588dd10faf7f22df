// Who watches the surface from where, and what it is drawn for: one surface for all, in full where any of them wants it
// so.
#pragma once
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/core/id.hpp"
#include "common/surface/view_frustum.hpp"

namespace osteon {

// Any thread may call any function but focuses().
class ViewInterest {
 public:
  // A mesh stream opens; without a look it wants all of the bone in full.
  void open(AuthorId viewer, const std::optional<ViewFrustum>& look);
  void close(AuthorId viewer);
  // The newest of each viewer counts, until its last stream closes. Of one without a stream: nothing; false.
  bool look(AuthorId viewer, const ViewFrustum& from);
  // [mesh thread] What the surface is to be drawn for from now on; nothing where that is as good as before. Whoever
  // comes when everyone has gone finds what the last one looked at.
  [[nodiscard]] std::optional<std::vector<Focus>> focuses(double pitch_mm, std::span<const Vec3> tool_tips_mm);

 private:
  struct Viewer {
    int streams = 0;
    std::optional<ViewFrustum> look;
  };
  std::mutex mutex_;
  std::map<AuthorId, Viewer> viewers_;
  std::vector<Focus> followed_{focus_on_nothing()};
};

}  // namespace osteon
