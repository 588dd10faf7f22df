#include "common/volume/settled.hpp"

#include <utility>

namespace osteon {

CutField piece_of(const CutField& parent, const Fragment& fragment, BodyId body) {
  CutField piece(parent.bone(), body, parent.tools());
  for (const FieldLeaf& leaf : parent.leaves()) piece.restore(leaf);
  for (const FieldLeaf& mask : fragment.left) piece.merge(mask);
  return piece;
}

Settled settle(CutField whole) {
  Settled result;
  std::vector<Fragment> fragments = FragmentFinder(whole).take_fragments(whole);
  std::uint32_t last = whole.body().value;
  std::vector<CutField> pieces;
  for (const Fragment& fragment : fragments)
    if (fragment.debris())
      ++result.debris;
    else
      pieces.push_back(piece_of(whole, fragment, BodyId{++last}));
  for (Fragment& fragment : fragments) {
    for (const FieldLeaf& mask : fragment.taken) whole.merge(mask);
    result.taken.push_back(std::move(fragment.taken));
  }
  result.bodies.push_back(std::move(whole));
  for (CutField& piece : pieces) result.bodies.push_back(std::move(piece));
  return result;
}

}  // namespace osteon
