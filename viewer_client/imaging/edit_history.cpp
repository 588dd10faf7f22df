#include "viewer_client/imaging/edit_history.hpp"

#include <array>
#include <charconv>
#include <utility>

namespace osteon {

namespace {

// All digits that bring it back, with a point in every locale.
std::string digits_of(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

}  // namespace

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
  std::string text = "# osteon-import ct --threshold " + digits_of(edits.threshold_hu) + " --edits THIS_FILE\nedits:\n";
  for (const Vec3& seed : edits.seeds_mm)
    text += "  - {kind: seed, point_mm: [" + digits_of(seed.x()) + ", " + digits_of(seed.y()) + ", " +
            digits_of(seed.z()) + "]}\n";
  return text;
}

}  // namespace osteon
