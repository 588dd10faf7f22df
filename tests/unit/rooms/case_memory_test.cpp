// Which cases are in memory while rooms open and close.
#include <gtest/gtest.h>

#include <filesystem>

#include "server/rooms/rooms.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

TEST(CasesOfRooms, AreInMemoryAndNoOthers) {
  const test::TempDir dir;
  const Case given_case = test::test_block(), first_case = test::plain_block(6, 3, 0.5),
             second_case = test::plain_block(8, 4, 0.5);
  const auto known = [&](const Case& bone) {
    EXPECT_TRUE(bone.save(dir / to_hex(bone.hash())));
    return KnownCase{bone.hash(), bone.info().title, dir / to_hex(bone.hash()), bone.memory_bytes()};
  };
  fs::create_directories(dir / "rooms");
  const std::uint64_t given = given_case.memory_bytes(), first = first_case.memory_bytes();
  ASSERT_LE(first, second_case.memory_bytes());
  const std::uint64_t most = given + second_case.memory_bytes();
  Rooms rooms({.cases = {{given_case, dir / "given"}}, .folder = dir / "rooms", .case_memory_bytes = most});
  rooms.add_case(known(first_case));
  rooms.add_case(known(second_case));
  EXPECT_EQ(rooms.cases().size(), 3u);
  EXPECT_EQ(rooms.case_bytes(), given) << "no case is read before a room uses it";
  const Digest of_first = first_case.hash(), of_second = second_case.hash();
  ASSERT_TRUE(rooms.create("anna", &of_first));
  ASSERT_TRUE(rooms.create("berta", &of_first));
  EXPECT_EQ(rooms.case_bytes(), given + first);
  const auto refused = rooms.create("carla", &of_second);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::exhausted) << refused.error().message;
  ASSERT_TRUE(rooms.close("anna"));
  EXPECT_EQ(rooms.case_bytes(), given + first) << "berta uses it";
  ASSERT_TRUE(rooms.close("berta"));
  EXPECT_EQ(rooms.case_bytes(), given);
  ASSERT_TRUE(rooms.create("carla", &of_second));
  EXPECT_EQ(rooms.resume("anna").error().code, ErrorCode::exhausted);
  ASSERT_TRUE(rooms.close("carla"));
  EXPECT_TRUE(rooms.resume("anna"));
  EXPECT_EQ(rooms.case_bytes(), given + first);
}

}  // namespace
}  // namespace osteon
