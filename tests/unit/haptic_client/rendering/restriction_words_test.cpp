// Tests what a log says of a decision about the hand, and of who made it.
#include <gtest/gtest.h>

#include "haptic_client/rendering/supervision_guard.hpp"

namespace osteon::haptic {
namespace {

TEST(RestrictionWords, SayAllThatHolds) {
  EXPECT_EQ(in_words({}), "");
  EXPECT_EQ(in_words({.stopped = true, .words = "look here"}), "stopped");
  EXPECT_EQ(in_words({.stopped = true,
                      .taken_by = AuthorId{4},
                      .guide = AuthorId{5},
                      .guide_share = 250,
                      .force_limit = 300,
                      .zone = ZoneLimit{{1, 2, 3}, 4},
                      .tools = {Digest{{1}}, Digest{{2}}}}),
            "stopped, tool taken by 4, led by 5 with a share of 250, no more than 300 hundredths of a newton, within a "
            "ball only, "
            "with 2 tools only");
}

TEST(RestrictionWords, SayWhoDecided) {
  EXPECT_EQ(called({AuthorId{7}, "Dr. Weber"}), "Dr. Weber");
  EXPECT_EQ(called({AuthorId{7}, ""}), "#7");
  EXPECT_EQ(called({}), "") << "from a server that does not send it";
  EXPECT_EQ(called({AuthorId{7}, "Ada\x1b[2J\n"}), "Ada?[2J?") << "a name must not move the cursor";
  EXPECT_EQ(called({AuthorId{7}, "Jörg"}), "Jörg");
}

}  // namespace
}  // namespace osteon::haptic
