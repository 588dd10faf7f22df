// What a set of cuts leaves of a bone. While a bone is cut, pieces and debris come off as they are at that moment, so
// the field that remains depends on the order of the cuts. Here they are looked for once, after all cuts.
#pragma once
#include <vector>

#include "common/volume/fragments.hpp"

namespace osteon {

struct Settled {
  std::vector<CutField> bodies;  // first what remains, with the body's own name; then the pieces, largest first
  int debris = 0;                // pieces that vanished
  std::vector<std::vector<FieldLeaf>> taken;  // the masks that took each piece and crumb from the first body
};

// `whole`: a field in which only cuts took bone, and no mask did; CutHistory::undo() of the masks makes it so. Its
// values do not depend on the order of the cuts, and the result follows from them and the case alone. The pieces get
// the numbers after the field's.
[[nodiscard]] Settled settle(CutField whole);

// A body of the piece's own: its parent's field as it was when the piece was found, and all but the piece gone.
[[nodiscard]] CutField piece_of(const CutField& parent, const Fragment& fragment, BodyId body);

}  // namespace osteon
