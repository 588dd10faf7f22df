#include "common/runtime/new_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

TEST(NewFolder, IsThereAsAWholeOrNotAtAll) {
  const test::TempDir temp;
  const fs::path folder = temp / "boxes";
  fs::path seen;
  const auto write = [&](const fs::path& partial) -> Result<void> {
    seen = partial;
    std::ofstream(partial / "file") << "whole";
    return {};
  };
  ASSERT_TRUE(write_new_folder(folder, write));
  EXPECT_NE(seen, folder);
  EXPECT_FALSE(fs::exists(seen));
  EXPECT_TRUE(fs::exists(folder / "file"));
  const auto again = write_new_folder(folder, write);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
}

// A user knows the name that he gave, and no other.
TEST(NewFolder, AFailureNamesTheFolderOfTheUser) {
  const test::TempDir temp;
  const fs::path folder = temp / "boxes";
  const auto failed = write_new_folder(folder, [&](const fs::path& partial) -> Result<void> {
    std::ofstream(partial / "file") << "half";
    const std::string file = (partial / "file").string();
    return failure(ErrorCode::internal, "cannot write " + file + "; make room on the disk of " + file);
  });
  ASSERT_FALSE(failed);
  const std::string file = (folder / "file").string();
  EXPECT_EQ(failed.error().message, "cannot write " + file + "; make room on the disk of " + file);
  EXPECT_TRUE(fs::is_empty(temp.path()));
}

}  // namespace
}  // namespace osteon
