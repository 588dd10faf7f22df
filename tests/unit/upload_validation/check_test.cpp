// The process that validates an uploaded case stays within its memory limit. So does every program that opens a case.
#include "server/upload_validation/case_check.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "common/core/bounded_text.hpp"
#include "tests/support/changed_bytes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr long kMostMib = 1024;

// The peak memory of all children of this test so far, MiB.
long peak_mib() {
  rusage used{};
  ::getrusage(RUSAGE_CHILDREN, &used);
  return used.ru_maxrss / 1024;
}

class CheckTest : public ::testing::Test {
 protected:
  CheckTest() {
    EXPECT_TRUE(test::plain_block(4, 2, 1.0).save(temp_ / "case"));
    std::ostringstream out;
    out << std::ifstream(temp_ / "case" / "bone.vdb", std::ios::binary).rdbuf();
    sound_ = out.str();
  }
  void put(const std::string& vdb) const { std::ofstream(temp_ / "case" / "bone.vdb", std::ios::binary) << vdb; }
  Result<CheckedCase> checked(const fs::path& reader = test::program("osteon-server"),
                              const UploadQuota& quota = {}) const {
    fs::remove_all(temp_ / "place");
    fs::create_directory(temp_ / "place");
    EXPECT_TRUE(pack_case(temp_ / "case", temp_ / "place" / "case.zip"));
    return check_case(reader, temp_ / "place" / "case.zip", temp_ / "place", quota);
  }
  // Expects a refusal in one short line, from the validating process and from osteon-import.
  void expect_refused() const {
    const auto out = checked();
    ASSERT_FALSE(out);
    EXPECT_LE(out.error().message.size(), kMostErrorBytes + 4);
    EXPECT_TRUE(std::ranges::none_of(out.error().message, [](char c) { return c >= 0 && c < ' '; }))
        << out.error().message;
    const auto told = test::run(test::program("osteon-import"), {"info", temp_ / "case"});
    EXPECT_EQ(told.exit_code, 1) << told.err;
    EXPECT_EQ(std::ranges::count(told.err, '\n'), 1) << told.err;
  }

  test::TempDir temp_;
  std::string sound_;
};

TEST_F(CheckTest, ChangedFilesStayWithinTheMemory) {
  std::mt19937 random(1);
  for (int i = 0; i < 12; ++i) {
    put(test::changed_bytes(sound_, random));
    const auto out = checked();
    if (!out) {
      EXPECT_LE(out.error().message.size(), kMostErrorBytes + 4);
    }
  }
  EXPECT_LE(peak_mib(), kMostMib);
}

// Each of these changes one byte. `osteon-import info` used 12 and 6 GB for them, and the process as much as its limit.
TEST_F(CheckTest, TheWorstChangesAreRefused) {
  for (const auto& [at, value] : {std::pair<std::size_t, int>{102, 16}, {129, 253}, {135, 127}}) {
    std::string vdb = sound_;
    vdb[at] = static_cast<char>(value);
    put(vdb);
    expect_refused();
  }
  EXPECT_LE(peak_mib(), kMostMib);
}

// An error may quote what a file contains: here a title of almost a megabyte with line breaks.
TEST_F(CheckTest, ErrorsAreOneShortLine) {
  fs::resize_file(temp_ / "case" / "case.json", 0);
  std::ofstream(temp_ / "case" / "case.json")
      << "{\"schema_version\": 1, \"title\": \"" << std::string(900'000, 'x') << "\n\x1b[2J";
  expect_refused();
}

TEST_F(CheckTest, TheProcessGetsNoMoreMemoryThanItsQuota) {
  const fs::path reader = temp_ / "reader";
  // The server limits a process after its start. What the process does before has no limit.
  std::ofstream(reader) << R"sh(#!/bin/sh
while [ "$(ulimit -v)" = unlimited ]; do sleep 0.01; done
head -c 400000000 /dev/zero | tail -c 400000000 > /dev/null && echo '{"error":"it had the memory"}'
)sh";
  fs::permissions(reader, fs::perms::owner_all);
  const auto ample = checked(reader), tight = checked(reader, {.memory_bytes = std::uint64_t{256} << 20});
  ASSERT_FALSE(ample);
  EXPECT_EQ(ample.error().message, "it had the memory");
  ASSERT_FALSE(tight);
  EXPECT_NE(tight.error().message, "it had the memory");
}

}  // namespace
}  // namespace osteon
