// Knows from where viewers look at the surface, and what must be drawn in full for them. All viewers share one surface.
// It is in full wherever any of them wants that.
#pragma once
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/surface/view_frustum.hpp"

namespace osteon {

// Any thread may call any function but focuses().
class ViewInterest {
 public:
  // A mesh stream opens. Without `look` it wants the whole bone in full.
  void open(AuthorId viewer, const std::optional<ViewFrustum>& look);
  void close(AuthorId viewer);
  // The newest view of each viewer counts until its last stream closes. Ignored for a viewer without a stream: returns
  // false.
  bool look(AuthorId viewer, const ViewFrustum& from);
  // [mesh thread] What the surface is drawn for from now on; nothing if the last result is still good. After everybody
  // has gone, a new viewer finds what the last one looked at.
  [[nodiscard]] std::optional<std::vector<Focus>> focuses(double pitch_mm, std::span<const Vec3> tool_tips_mm);

 private:
  struct Viewer {
    int streams = 0;
    std::optional<ViewFrustum> look;
  };
  Mutex mutex_{LockRank::leaf};
  std::map<AuthorId, Viewer> viewers_ OSTEON_GUARDED_BY(mutex_);
  std::vector<Focus> followed_{focus_on_nothing()};  // used by the mesh thread
};

}  // namespace osteon
