// Many cuts of all tools on one small bone, and orders to apply them in. They show that a bone is a function of the set
// of its cuts.
#pragma once
#include <vector>

#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

// A ball of bone, 20 mm across, h = 0.5 mm.
[[nodiscard]] Case ball_of_bone();

// Uses every cutting tool in turn. Each has an active point on the ball's surface, faces the bone, is at most a
// fraction of a millimetre deep, and is moved and turned slightly. So the bone's skin is the minimum over many cuts and
// never all gone, as it soon would be with deep cuts. One cut in 200 is deep.
[[nodiscard]] std::vector<Cut> grazing_cuts(std::size_t count, Random& random);

// Number of cutting tools in the box.
[[nodiscard]] std::size_t cutting_tools();

// Every index in [0, count) once in random order, and some of them again, anywhere after.
[[nodiscard]] std::vector<std::size_t> order_with_repeats(std::size_t count, std::size_t repeats, Random& random);

}  // namespace osteon::test
