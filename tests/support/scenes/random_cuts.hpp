// Many cuts of all tools on one small bone, and orders to apply them in: what shows that a bone is a function of the
// set of its cuts.
#pragma once
#include <vector>

#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

// A ball of bone, 20 mm across, h = 0.5 mm.
[[nodiscard]] Case ball_of_bone();

// Every cutting tool in turn, each with an active point set on the ball's surface, its own surface facing the bone and
// at most a fraction of a millimetre deep, and moved and turned a little. So the bone's skin is the minimum over many
// cuts and never all gone, as it soon would be if they went deep; one in 200 does.
[[nodiscard]] std::vector<Cut> grazing_cuts(std::size_t count, Random& random);

// How many tools of the box cut.
[[nodiscard]] std::size_t cutting_tools();

// Every place in [0, count) once in random order, and some of them again, anywhere after.
[[nodiscard]] std::vector<std::size_t> order_with_repeats(std::size_t count, std::size_t repeats, Random& random);

}  // namespace osteon::test
