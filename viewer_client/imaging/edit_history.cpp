#include "viewer_client/imaging/edit_history.hpp"

#include <array>
#include <cstdio>
#include <utility>

namespace osteon {

void EditHistory::apply(ImagingEdits edits) {
  if (edits == now()) return;
  states_.resize(at_ + 1);
  states_.push_back(std::move(edits));
  ++at_;
}

void EditHistory::undo() {
  if (can_undo()) --at_;
}

void EditHistory::redo() {
  if (can_redo()) ++at_;
}

std::string edit_list_text(const ImagingEdits& edits) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "# osteon-import ct --threshold %.17g --edits THIS_FILE\nedits:\n",
                edits.threshold_hu);
  std::string text = line.data();
  for (const Vec3& seed : edits.seeds_mm) {
    std::snprintf(line.data(), line.size(), "  - {kind: seed, point_mm: [%.17g, %.17g, %.17g]}\n", seed.x(), seed.y(),
                  seed.z());
    text += line.data();
  }
  return text;
}

}  // namespace osteon
