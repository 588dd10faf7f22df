// What a set of cuts leaves of a bone, independent of their order. During cutting, pieces and debris come off in the
// state of that moment, so the remaining field depends on the order of the cuts. Here they are found once, after all
// cuts.
#pragma once
#include <vector>

#include "common/volume/fragments.hpp"

namespace osteon {

struct Settled {
  std::vector<CutField> bodies;  // first what remains, with the body's own number; then the pieces, largest first
  int debris = 0;                // number of pieces that vanished
  std::vector<std::vector<FieldLeaf>> taken;  // the masks that removed each piece and each debris from the first body
};

// `whole`: a field in which only cuts removed bone, and no mask. CutHistory::undo() of the masks makes it so. Its
// values do not depend on the order of the cuts. The result follows from them and the case alone. The pieces get the
// numbers after the field's.
[[nodiscard]] Settled settle(CutField whole);

// A body for the piece: its parent's field at the time when the piece was found, with everything but the piece removed.
[[nodiscard]] CutField piece_of(const CutField& parent, const Fragment& fragment, BodyId body);

}  // namespace osteon
