// The scan of a case: HU and labels on the scanner's voxels.
#include "common/volume/case_scan.hpp"

#include <gtest/gtest.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "common/volume/openvdb_start.hpp"
#include "common/volume/sparse_volume.hpp"
#include "tests/support/content.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

class CaseScanTest : public ::testing::Test {
 protected:
  CaseScanTest() : scan_(test::turned_scan()), bone_(*test::described_ball(test::full_description(scan_))) {
    EXPECT_TRUE(bone_.save(folder_, scan_));
  }
  void expect_same(const CaseScan& loaded) const {
    EXPECT_EQ(loaded.geometry, scan_.geometry);
    EXPECT_EQ(loaded.hu, scan_.hu);
    EXPECT_EQ(loaded.labels, scan_.labels);
    EXPECT_EQ(loaded.tissue, scan_.tissue);
  }
  [[nodiscard]] Error refused() const {
    const auto loaded = load_scan(folder_, bone_);
    EXPECT_FALSE(loaded);
    return loaded ? Error{} : loaded.error();
  }
  // Writes another scan in the place of the case's own.
  void replace_by(const CaseScan& other) const {
    fs::remove(file_);
    ASSERT_TRUE(save_scan(file_, other));
  }

  test::TempDir temp_;
  CaseScan scan_;
  Case bone_;
  const fs::path folder_ = temp_ / "case", file_ = folder_ / "scan.vdb";
};

TEST_F(CaseScanTest, EveryVoxelComesBack) {
  const auto loaded = load_scan(folder_, bone_);
  ASSERT_TRUE(loaded) << loaded.error().message;
  expect_same(*loaded);
}

// Asked of OpenVDB itself, so that another program finds the voxels as the header says.
TEST_F(CaseScanTest, SampleIjkIsColumnRowAndSlice) {
  start_openvdb();
  openvdb::io::File file(file_.string());
  file.open(false);
  const auto hu = openvdb::gridPtrCast<openvdb::Int32Grid>(file.readGrid("hu"));
  const auto labels = openvdb::gridPtrCast<openvdb::Int32Grid>(file.readGrid("labels"));
  const auto tissue = openvdb::gridPtrCast<openvdb::Int32Grid>(file.readGrid("tissue"));
  ASSERT_TRUE(hu && labels && tissue);
  EXPECT_EQ(hu->tree().getValue(openvdb::Coord(3, 4, 5)), 3 + 400 + 5000 - 3000);
  EXPECT_EQ(labels->tree().getValue(openvdb::Coord(8, 5, 0)), 1);
  EXPECT_EQ(labels->tree().getValue(openvdb::Coord(9, 5, 0)), 7);
  EXPECT_EQ(labels->tree().getValue(openvdb::Coord(9, 6, 0)), 0);
  EXPECT_EQ(tissue->tree().getValue(openvdb::Coord(0, 0, 3)), 2);
}

// As other programs do it by default: OpenVDB loads the values of a leaf when they are needed. It expects the table for
// that in a file's metadata, or none.
TEST_F(CaseScanTest, AnotherProgramLoadsVoxelsWhenItNeedsThem) {
  start_openvdb();
  openvdb::io::DelayedLoadMetadata::registerType();
  for (const char* written : {"scan.vdb", "bone.vdb"}) {
    std::map<std::string, openvdb::Index64> active[2];
    for (const bool delayed : {false, true}) {
      openvdb::io::File file((folder_ / written).string());
      file.open(delayed);
      for (auto name = file.beginName(); name != file.endName(); ++name) {
        const auto grid = file.readGrid(name.gridName());
        openvdb::Index64 sum = grid->activeVoxelCount();
        if (const auto values = openvdb::gridPtrCast<openvdb::Int32Grid>(grid))
          for (auto at = values->cbeginValueOn(); at; ++at)
            sum += static_cast<openvdb::Index64>(at.getValue()) * at.getVoxelCount();
        active[delayed ? 1 : 0][name.gridName()] = sum;
      }
    }
    EXPECT_FALSE(active[0].empty());
    EXPECT_EQ(active[0], active[1]) << written;
    EXPECT_EQ(test::content(folder_ / written).find("file_delayed_load"), std::string::npos) << written;
  }
  openvdb::io::DelayedLoadMetadata::unregisterType();
}

// Computed with Python's hashlib and struct from the rules of deploy/docs/case.md.
TEST_F(CaseScanTest, TheHashIsTheOneThatTheDocumentationDescribes) {
  EXPECT_EQ(to_hex(bone_.info().scan->hash), "ba0a8b3e44cc39e979de26c511b9a73262e99f2271dfb7b022f9730b545665fc");
}

TEST_F(CaseScanTest, AVoxelLiesWhereItsAxesSay) {
  const ScanGeometry& geometry = bone_.info().scan->geometry;
  const Vec3 step = geometry.position_mm({0, 0, 1}) - geometry.position_mm({0, 0, 0});
  EXPECT_NEAR(step.norm(), 2.0, 1e-12);
  EXPECT_TRUE(geometry.position_mm(Vec3::Zero()).isApprox(Vec3(-10.25, 20.5, 7.125)));
}

TEST_F(CaseScanTest, GridsThatAreNotKnownStayEmpty) {
  CaseScan labels_alone = scan_;
  labels_alone.hu.clear();
  labels_alone.tissue = {};
  CaseInfo info = test::full_description(labels_alone);
  const auto bone = test::described_ball(info);
  ASSERT_TRUE(bone && bone->save(temp_ / "labels", labels_alone));
  const auto loaded = load_scan(temp_ / "labels", *bone);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(loaded->hu.empty() && loaded->tissue.empty());
  EXPECT_EQ(loaded->labels, scan_.labels);
}

TEST_F(CaseScanTest, TheBoneIsReadAndVerifiedWithoutTheScan) {
  fs::remove(file_);
  const auto loaded = Case::load(folder_);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->hash(), bone_.hash());
  const Error missing = refused();
  EXPECT_EQ(missing.code, ErrorCode::not_found);
  EXPECT_EQ(missing.message, "there is no file " + file_.string() + "; import the case again");
}

TEST_F(CaseScanTest, ACaseWithoutScanSaysSo) {
  CaseInfo info = test::full_description(scan_);
  info.scan.reset();
  const auto bone = test::described_ball(info);
  ASSERT_TRUE(bone && bone->save(temp_ / "none"));
  EXPECT_FALSE(fs::exists(temp_ / "none" / "scan.vdb"));
  const auto loaded = load_scan(temp_ / "none", *bone);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::not_found);
  EXPECT_NE(loaded.error().message.find("has no scan; import it again"), std::string::npos);
}

TEST_F(CaseScanTest, OneChangedVoxelIsAnotherScan) {
  for (const int grid : {0, 1, 2}) {
    CaseScan other = scan_;
    if (grid == 0) other.hu[700] += 1;
    if (grid == 1) {
      std::vector<std::uint8_t> labels = scan_.labels.dense();
      labels[700] = labels[700] == 1 ? 7 : 1;
      other.labels = SparseBytes(labels);
    }
    if (grid == 2) {
      std::vector<std::uint8_t> tissue = scan_.tissue.dense();
      tissue[700] = tissue[700] == 1 ? 2 : 1;
      other.tissue = SparseBytes(tissue);
    }
    replace_by(other);
    const Error wrong = refused();
    EXPECT_EQ(wrong.code, ErrorCode::invalid_input);
    EXPECT_EQ(wrong.message,
              file_.string() + " is another scan than the case describes: scan.hash differs; import the case again");
  }
}

TEST_F(CaseScanTest, ValuesThatNoLabelListsAreRefused) {
  CaseInfo info = test::full_description(scan_);
  info.labels.pop_back();
  info.regions.clear();
  const auto bone = test::described_ball(info);
  ASSERT_TRUE(bone);
  const auto saved = bone->save(temp_ / "unlisted", scan_);
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().message, "labels does not list the value 7, which voxels of the scan have");
  // The same in a folder that somebody put together.
  ASSERT_TRUE(bone->save(temp_ / "unlisted"));
  fs::copy_file(file_, temp_ / "unlisted" / "scan.vdb");
  const auto loaded = load_scan(temp_ / "unlisted", *bone);
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("scan.vdb: labels does not list the value 7"), std::string::npos)
      << loaded.error().message;
}

TEST_F(CaseScanTest, ALargerScanIsRefusedBeforeItIsRead) {
  CaseScan larger{.geometry = scan_.geometry};
  larger.geometry.dims = {64, 64, 64};
  for (std::size_t i = 0; i < larger.geometry.count(); ++i) larger.labels.push_back(i % 2 == 0 ? 7 : 1);
  replace_by(larger);
  const Error wrong = refused();
  EXPECT_EQ(wrong.code, ErrorCode::exhausted) << wrong.message;
  EXPECT_NE(wrong.message.find("scan.vdb"), std::string::npos);
}

TEST_F(CaseScanTest, ADamagedFileIsOneSentence) {
  const std::string sound = test::content(file_);
  const auto expect_sentence = [&](const std::string& bytes, std::size_t at) {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes;
    const auto loaded = load_scan(folder_, bone_);
    if (loaded) return expect_same(*loaded);  // the byte has no meaning
    EXPECT_TRUE(loaded.error().code == ErrorCode::invalid_input || loaded.error().code == ErrorCode::exhausted) << at;
    EXPECT_NE(loaded.error().message.find("scan.vdb"), std::string::npos) << loaded.error().message;
    EXPECT_EQ(loaded.error().message.find('\n'), std::string::npos);
  };
  for (std::size_t at = 0; at < sound.size(); at += 1 + sound.size() / 400) {
    std::string changed = sound;
    changed[at] = static_cast<char>(changed[at] ^ 0x41);
    expect_sentence(changed, at);
  }
  for (std::size_t end = 0; end < sound.size(); end += 1 + sound.size() / 100) {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << sound.substr(0, end);
    EXPECT_NE(refused().message.find("import the case again"), std::string::npos) << end;
  }
  const SparseVolume floats(0.0f);
  ASSERT_TRUE(save_volumes(file_, 1.0, {{"hu", &floats}}));
  EXPECT_NE(refused().message.find("not one of int32"), std::string::npos) << refused().message;
}

// At every question that it asks.
TEST_F(CaseScanTest, StopsWhenAsked) {
  int asked = 0, left = 0;
  const KeepGoing count = [&](double) { return ++asked > 0; }, stop = [&](double) { return left-- > 0; };
  ASSERT_TRUE(bone_.save(temp_ / "whole", scan_, count));
  EXPECT_GE(asked, 5) << "before, for each of three grids, and before the folder gets its name";
  for (int calls = 0; calls < asked; ++calls) {
    left = calls;
    const auto saved = bone_.save(temp_ / "stopped", scan_, stop);
    ASSERT_FALSE(saved) << calls;
    EXPECT_EQ(saved.error().code, ErrorCode::cancelled);
    EXPECT_FALSE(fs::exists(temp_ / "stopped"));
  }
  asked = 0;
  ASSERT_TRUE(load_scan(folder_, bone_, count));
  EXPECT_GE(asked, 3);
  for (int calls = 0; calls < asked; ++calls) {
    left = calls;
    const auto loaded = load_scan(folder_, bone_, stop);
    ASSERT_FALSE(loaded) << calls;
    EXPECT_EQ(loaded.error().code, ErrorCode::cancelled);
  }
}

TEST_F(CaseScanTest, ProgressOfWritingNeverGoesBack) {
  std::vector<double> fractions;
  ASSERT_TRUE(save_scan(temp_ / "again.vdb", scan_, [&](double done) {
    fractions.push_back(done);
    return true;
  }));
  EXPECT_TRUE(std::ranges::is_sorted(fractions)) << testing::PrintToString(fractions);
  EXPECT_EQ(fractions.back(), 1.0);
}

}  // namespace
}  // namespace osteon
