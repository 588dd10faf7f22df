// Undo and redo of what a person has decided about the bones of a scan.
#pragma once
#include <cstddef>
#include <vector>

#include "viewer_client/imaging/imaging_edits.hpp"

namespace osteon {

// Every state since the scan was opened. A state is small, so it is stored as a whole; states share their corrections.
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

}  // namespace osteon
