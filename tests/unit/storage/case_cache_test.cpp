// The case cache: a case is in memory only while a room uses it, and all cases together stay below a limit.
#include "server/storage/case_cache.hpp"

#include <gtest/gtest.h>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

class CaseCacheTest : public ::testing::Test {
 protected:
  CaseCacheTest() {
    for (const Case* bone : {&first_, &second_}) EXPECT_TRUE(bone->save(dir_ / to_hex(bone->hash())));
  }
  [[nodiscard]] KnownCase known(const Case& bone, bool with_size = true) const {
    return {bone.hash(), bone.info().title, dir_ / to_hex(bone.hash()), with_size ? bone.memory_bytes() : 0};
  }

  test::TempDir dir_;
  const Case given_ = test::test_block(), first_ = test::plain_block(6, 3, 0.5), second_ = test::plain_block(8, 4, 0.5);
};

TEST_F(CaseCacheTest, ACaseIsInMemoryAsLongAsSomebodyHasIt) {
  CaseCache case_cache(kMostCaseMemory);
  case_cache.keep({given_, dir_ / "given"});
  case_cache.add(known(first_));
  EXPECT_EQ(case_cache.all().size(), 2u);
  EXPECT_EQ(case_cache.find(first_.hash())->title, first_.info().title);
  EXPECT_FALSE(case_cache.find(second_.hash()));
  EXPECT_EQ(case_cache.load(second_.hash()).error().code, ErrorCode::not_found);
  EXPECT_EQ(case_cache.loaded_bytes(), given_.memory_bytes()) << "only the case that is still held";

  auto one = case_cache.load(first_.hash()), another = case_cache.load(first_.hash());
  ASSERT_TRUE(one.has_value()) << one.error().message;
  EXPECT_EQ(one->bone->hash(), first_.hash());
  EXPECT_EQ(one->bone, another->bone) << "the case was read once";
  EXPECT_EQ(case_cache.loaded_bytes(), given_.memory_bytes() + first_.memory_bytes());
  const std::weak_ptr<const Case> read = one->bone;
  one->bone.reset();
  EXPECT_FALSE(read.expired());
  another->bone.reset();
  EXPECT_TRUE(read.expired());
  EXPECT_EQ(case_cache.loaded_bytes(), given_.memory_bytes());
  EXPECT_TRUE(case_cache.load(first_.hash()));
}

TEST_F(CaseCacheTest, WhatWouldGoBeyondTheLimitIsRefusedUntilThereIsSpace) {
  // The size is known either from the upload or only after the case was read.
  for (const bool with_size : {true, false}) {
    CaseCache case_cache(second_.memory_bytes() + first_.memory_bytes() - 1);
    case_cache.add(known(first_, with_size));
    case_cache.add(known(second_, with_size));
    auto held = case_cache.load(first_.hash());
    ASSERT_TRUE(held.has_value()) << held.error().message;
    const auto refused = case_cache.load(second_.hash());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::exhausted);
    EXPECT_NE(refused.error().message.find("--case-memory-mib"), std::string::npos) << refused.error().message;
    EXPECT_EQ(case_cache.loaded_bytes(), first_.memory_bytes());
    held->bone.reset();
    EXPECT_TRUE(case_cache.load(second_.hash()));
  }
}

// A case whose size is known to be too large is refused before any byte of it is read.
TEST_F(CaseCacheTest, WhatIsTooLargeIsNotRead) {
  CaseCache case_cache(first_.memory_bytes() - 1);
  case_cache.add(known(first_));
  fs::remove(dir_ / to_hex(first_.hash()) / "bone.vdb");
  EXPECT_EQ(case_cache.load(first_.hash()).error().code, ErrorCode::exhausted);
}

TEST_F(CaseCacheTest, AFolderThatHoldsAnotherCaseIsRefused) {
  CaseCache case_cache(kMostCaseMemory);
  KnownCase wrong = known(first_);
  wrong.folder = dir_ / to_hex(second_.hash());
  case_cache.add(wrong);
  EXPECT_EQ(case_cache.load(first_.hash()).error().code, ErrorCode::invalid_input);
}

}  // namespace
}  // namespace osteon
