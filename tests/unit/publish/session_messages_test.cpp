// Tests the bytes of what a room sends to its sessions.
#include "server/publish/session_messages.hpp"

#include <gtest/gtest.h>

#include "common/wire/convert.hpp"
#include "common/wire/encoded_cut.hpp"
#include "osteon/v1/cutting.pb.h"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

// The cut was encoded before. The message is still what protobuf makes of the whole.
TEST(SessionMessages, ACutIsSentAsItWasEncoded) {
  for (const std::uint64_t seq : {1ull, 127ull, 128ull, 1ull << 40}) {
    const Cut cut = test::straight_cut(find_tool("burr-round-5").value(), {0, 0, 0}, {1, 2, 3}, {0, 0, -1}, seq);
    v1::SessionResponse whole;
    whole.mutable_committed()->set_room_seq(seq);
    *whole.mutable_committed()->mutable_cut() = wire::to_wire(cut);
    const SessionMessage message = cut_message(RoomSeq{seq}, cut, *wire::encoded(cut));
    EXPECT_EQ(*message.bytes, whole.SerializeAsString());
    EXPECT_EQ(message.seq, RoomSeq{seq});
    EXPECT_EQ(message.fast.kind, wire::SessionEntryKind::committed);
    EXPECT_EQ(message.fast.cut, cut);
  }
}

}  // namespace
}  // namespace osteon
