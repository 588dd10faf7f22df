// The size that a .vdb file declares is checked before OpenVDB uses it.
#include "common/volume/vdb_size.hpp"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/volume/case.hpp"
#include "common/volume/openvdb_start.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr VdbLimits kAmple{.memory_bytes = std::uint64_t{1} << 30, .leaves = 1 << 20, .grids = 16};

class VdbSizeTest : public ::testing::Test {
 protected:
  VdbSizeTest() : bone_(test::plain_block(20, 10, 0.5)) {
    EXPECT_TRUE(bone_.save(temp_ / "case"));
    std::ostringstream out;
    out << std::ifstream(file_, std::ios::binary).rdbuf();
    sound_ = out.str();
  }
  [[nodiscard]] Result<VdbSize> measured(const std::string& bytes, const VdbLimits& limits = kAmple) const {
    std::ofstream(temp_ / "bytes.vdb", std::ios::binary) << bytes;
    return measure_vdb(temp_ / "bytes.vdb", limits);
  }
  using Changes = std::vector<std::pair<std::size_t, int>>;
  [[nodiscard]] std::string changed(const Changes& changes) const {
    std::string bytes = sound_;
    for (const auto& [at, value] : changes) bytes[at] = static_cast<char>(value);
    return bytes;
  }

  test::TempDir temp_;
  Case bone_;
  const fs::path file_ = temp_ / "case" / "bone.vdb";
  std::string sound_;
};

TEST_F(VdbSizeTest, MeasuresWhatIsLoaded) {
  const auto size = measure_vdb(file_, kAmple);
  ASSERT_TRUE(size) << size.error().message;
  const auto loaded = static_cast<double>(bone_.memory_bytes());
  EXPECT_GE(static_cast<double>(size->memory_bytes), 0.95 * loaded);
  EXPECT_LE(static_cast<double>(size->memory_bytes), 1.2 * loaded);
  EXPECT_GT(size->leaves, 50u);
}

TEST_F(VdbSizeTest, RefusesWhatIsBeyondTheLimits) {
  const auto size = measure_vdb(file_, kAmple);
  ASSERT_TRUE(size);
  const VdbLimits exact{.memory_bytes = size->memory_bytes, .leaves = size->leaves, .grids = 5};
  EXPECT_TRUE(measure_vdb(file_, exact));
  for (const VdbLimits& less :
       {VdbLimits{exact.memory_bytes - 1, exact.leaves, 5}, VdbLimits{exact.memory_bytes, exact.leaves - 1, 5},
        VdbLimits{exact.memory_bytes, exact.leaves, 4}}) {
    const auto refused = measure_vdb(file_, less);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::exhausted) << refused.error().message;
  }
}

TEST_F(VdbSizeTest, RefusesAFileThatEndsTooEarly) {
  for (std::size_t end = 0; end < sound_.size(); end += 1 + sound_.size() / 300) {
    const auto out = measured(sound_.substr(0, end));
    ASSERT_FALSE(out) << end;
    EXPECT_EQ(out.error().code, ErrorCode::invalid_input) << end;
  }
}

// Each of these files made OpenVDB use 6 to 18 GB of memory, or half a minute.
TEST_F(VdbSizeTest, RefusesWhatMakesOpenVdbAllocate) {
  constexpr std::size_t kFirstGrid = 100,
                        kMetadata = 128;  // position of the first grid; number of metadata entries
  for (const Changes& changes :
       {Changes{{kFirstGrid + 2, 16}}, Changes{{kMetadata + 1, 253}}, Changes{{kMetadata + 7, 127}}}) {
    const auto out = measured(changed(changes));
    ASSERT_FALSE(out) << changes[0].first;
    EXPECT_EQ(out.error().code, ErrorCode::invalid_input);
    EXPECT_LT(out.error().message.size(), 500u);
  }
}

// A valid file of a few kilobytes: a constant in the whole neighbourhood. Listing its leaves took 1.6 GB.
TEST_F(VdbSizeTest, CountsTheLeavesOfLargeConstants) {
  start_openvdb();
  for (const openvdb::Index level : {2u, 3u}) {
    const auto grid = openvdb::FloatGrid::create(1.0f);
    grid->setName("surface");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    grid->tree().addTile(level, openvdb::Coord(0, 0, 0), -1.0f, true);
    openvdb::io::File(file_.string()).write(openvdb::GridPtrVec{grid});
    const std::uint64_t leaves = level == 2 ? 1 << 12 : 1 << 27;
    const auto size = measure_vdb(file_, {.memory_bytes = 1 << 30, .leaves = leaves, .grids = 1});
    ASSERT_TRUE(size) << size.error().message;
    EXPECT_EQ(size->leaves, leaves);
    EXPECT_FALSE(measure_vdb(file_, {.memory_bytes = 1 << 30, .leaves = leaves - 1, .grids = 1}));
  }
  const auto out = Case::load(temp_ / "case");
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, ErrorCode::exhausted) << out.error().message;
}

TEST_F(VdbSizeTest, RefusesALongDescription) {
  std::ofstream(temp_ / "case" / "case.json", std::ios::app) << std::string(2 << 20, ' ');
  const auto out = Case::load(temp_ / "case");
  ASSERT_FALSE(out);
  EXPECT_NE(out.error().message.find("longer than any"), std::string::npos) << out.error().message;
}

}  // namespace
}  // namespace osteon
