// A small bone with any description, and a description in which every field is set.
#pragma once
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"

namespace osteon::test {

// A ball of three pitches radius about the origin.
[[nodiscard]] Result<Case> described_ball(CaseInfo info);

// Voxels of 0.5 x 0.75 x 2 mm, turned about two axes and mirrored. HU are i + 100 j + 1000 k - 3000 but for the two
// limits of int16; labels 0, 1 and 7; tissues 0, 1 and 2.
[[nodiscard]] CaseScan turned_scan();

// Lists the labels of that scan, and plans something of each kind.
[[nodiscard]] CaseInfo full_description(const CaseScan& scan);

}  // namespace osteon::test
