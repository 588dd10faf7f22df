// What a person has decided about the bones of a scan, with undo and redo, and as the edit list of osteon-import.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"

namespace osteon {

struct ImagingEdits {
  double threshold_hu = 226.0;  // the same default as that of osteon-import
  std::vector<Vec3> seeds_mm;   // LPS; each grows a bone
  friend bool operator==(const ImagingEdits&, const ImagingEdits&) = default;
};

// Every state since the scan was opened. A state is small, so it is stored as a whole.
class EditHistory {
 public:
  [[nodiscard]] const ImagingEdits& now() const { return states_[at_]; }
  // Equal edits are no step. What was undone cannot be done again after it.
  void apply(ImagingEdits edits);
  [[nodiscard]] bool can_undo() const { return at_ > 0; }
  [[nodiscard]] bool can_redo() const { return at_ + 1 < states_.size(); }
  // Nothing happens where it cannot be.
  void undo();
  void redo();

 private:
  std::vector<ImagingEdits> states_{ImagingEdits{}};
  std::size_t at_ = 0;
};

// The seeds as a file for "osteon-import ct --edits". Positions come back bit for bit. The threshold is an option of
// that command, and a comment here.
[[nodiscard]] std::string edit_list_text(const ImagingEdits& edits);

}  // namespace osteon
