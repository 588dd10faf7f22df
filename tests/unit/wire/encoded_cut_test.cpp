// Tests that bytes which are made once stand in a message as protobuf itself would write them.
#include "common/wire/encoded_cut.hpp"

#include <gtest/gtest.h>

#include "common/wire/convert.hpp"
#include "osteon/v1/journal.pb.h"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

// Contents around the lengths at which protobuf's length takes another byte.
TEST(EncodedCut, AFieldHasTheBytesOfProtobuf) {
  for (const std::size_t size : {0, 1, 127, 128, 129, 16383, 16384, 70000}) {
    v1::JournalEntry whole;
    whole.set_author(300);
    whole.mutable_mark()->set_label(std::string(size, 'x'));
    v1::JournalEntry head;
    head.set_author(300);
    std::string mark, bytes = head.SerializeAsString();
    if (size > 0) wire::append_field(mark, v1::JournalMark::kLabelFieldNumber, std::string(size, 'x'));
    wire::append_field(bytes, v1::JournalEntry::kMarkFieldNumber, mark);
    EXPECT_EQ(bytes, whole.SerializeAsString()) << size;
  }
}

TEST(EncodedCut, IsTheCut) {
  const Cut cut = test::straight_cut(find_tool("burr-round-5").value(), {0, 0, 0}, {1, 2, 3}, {0, 0, -1}, 7);
  v1::Cut read;
  ASSERT_TRUE(read.ParseFromString(*wire::encoded(cut)));
  EXPECT_EQ(*wire::from_wire(read), cut);
}

}  // namespace
}  // namespace osteon
