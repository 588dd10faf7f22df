#include "viewer_client/imaging/edit_history.hpp"

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

}  // namespace osteon
