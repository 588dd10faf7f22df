// The shots of a session on disk: what was written is read again, and neither a crash nor a full disk loses the others.
#include "viewer_client/inside/shot_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/support/content.hpp"
#include "tests/support/size_limit.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

CArmShot shot_number(std::uint64_t number) {
  CArmShot shot;
  shot.number = number;
  shot.time_unix_ms = 1796050000123;
  shot.mode = ShotMode::pulse;
  shot.position = {{1.5, -2.25, 0.1}, 0.3, -0.1, {0, 10, -200}};
  shot.exposure_s = 0.02;
  shot.air_kerma_at_metre_ugy = 1.0 / 3.0;
  shot.dose_area_gy_cm2 = 1.35e-3;
  shot.seed = std::numeric_limits<std::uint64_t>::max() - number;
  return shot;
}

std::vector<CArmShot> shots_to(std::uint64_t last) {
  std::vector<CArmShot> shots;
  for (std::uint64_t number = 1; number <= last; ++number) shots.push_back(shot_number(number));
  return shots;
}

void append(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::app) << text; }

TEST(ShotLine, HoldsAllOfAShot) {
  for (const ShotMode mode : {ShotMode::single, ShotMode::pulse, ShotMode::live}) {
    CArmShot shot = shot_number(7);
    shot.mode = mode;
    const std::string line = line_of(shot);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_EQ(shot_of(line), shot) << line;
  }
  // A program in another language reads it by these names.
  const auto object = nlohmann::json::parse(line_of(shot_number(7)));
  EXPECT_EQ(object.at("number"), 7);
  EXPECT_EQ(object.at("mode"), "pulse");
  EXPECT_EQ(object.at("translation_mm"), (nlohmann::json{0.0, 10.0, -200.0}));
  EXPECT_EQ(object.size(), 11u);
}

TEST(ShotLine, WithoutAPossibleShotIsNone) {
  const auto good = nlohmann::json::parse(line_of(shot_number(7)));
  ASSERT_TRUE(shot_of(good.dump()));
  for (const auto& [name, value] : good.items()) {
    auto without = good, other = good;
    without.erase(name);
    EXPECT_FALSE(shot_of(without.dump())) << name;
    for (const nlohmann::json& wrong : {nlohmann::json("no"), nlohmann::json(-1e300), nlohmann::json(nullptr)}) {
      other[name] = wrong;
      EXPECT_FALSE(shot_of(other.dump())) << name;
    }
  }
  for (const std::uint64_t number : {std::uint64_t{0}, std::numeric_limits<std::uint64_t>::max()}) {
    auto other = good;
    other["number"] = number;
    EXPECT_FALSE(shot_of(other.dump())) << number;
  }
  auto flat = good;
  flat["isocentre_mm"] = {1, 2};
  EXPECT_FALSE(shot_of(flat.dump()));
  for (const char* text : {"", "{", "[]", "7", "null", "{}", "\xff"}) EXPECT_FALSE(shot_of(text)) << text;
}

TEST(ShotFile, IsReadAgain) {
  const test::TempDir temp;
  EXPECT_TRUE(ShotFile(temp.path()).read().shots.empty());
  EXPECT_FALSE(fs::exists(temp / kShotFileName)) << "nothing was shot";
  for (int window = 0; window < 2; ++window) {
    ShotFile file(temp.path());
    for (std::uint64_t i = 1; i <= 2; ++i)
      ASSERT_TRUE(file.add(shot_number(2 * static_cast<std::uint64_t>(window) + i)));
  }
  const ShotFile::Kept kept = ShotFile(temp.path()).read();
  EXPECT_EQ(kept.shots, shots_to(4));
  EXPECT_FALSE(kept.fault);
}

// A crash leaves half a line. The next shot has a line of its own.
TEST(ShotFile, GoesOnAfterHalfALine) {
  const test::TempDir temp;
  ShotFile file(temp.path());
  ASSERT_TRUE(file.add(shot_number(1)));
  append(temp / kShotFileName, line_of(shot_number(9)).substr(0, 40));
  ASSERT_TRUE(file.add(shot_number(2)));
  const ShotFile::Kept kept = ShotFile(temp.path()).read();
  EXPECT_EQ(kept.shots, shots_to(2));
  ASSERT_TRUE(kept.fault);
  EXPECT_NE(kept.fault->find("line 2, is no shot"), std::string::npos) << *kept.fault;
  EXPECT_NE(kept.fault->find(kShotFileName), std::string::npos) << *kept.fault;
  append(temp / kShotFileName, "{}\n");
  EXPECT_NE(ShotFile(temp.path()).read().fault->find("2 lines"), std::string::npos);
}

TEST(ShotFile, SaysOnceThatTheDiskIsFullAndWritesAllLater) {
  const test::TempDir temp;
  ShotFile file(temp.path());
  ASSERT_TRUE(file.add(shot_number(1)));
  const std::string before = test::content(temp / kShotFileName);
  {
    const test::SizeLimit small(before.size() + 20);
    const Result<void> said = file.add(shot_number(2));
    ASSERT_FALSE(said);
    for (const char* part : {kShotFileName, "make room on the disk"})
      EXPECT_NE(said.error().message.find(part), std::string::npos) << said.error().message;
    EXPECT_EQ(said.error().message.find('\n'), std::string::npos);
    EXPECT_TRUE(file.add(shot_number(3))) << "it has been said";
    EXPECT_EQ(test::content(temp / kShotFileName), before) << "no half line";
    EXPECT_EQ(file.waiting(), 2u);
  }
  ASSERT_TRUE(file.add(shot_number(4)));
  EXPECT_EQ(file.waiting(), 0u);
  EXPECT_EQ(ShotFile(temp.path()).read().shots, shots_to(4));
  {
    const test::SizeLimit small(0);
    EXPECT_FALSE(file.add(shot_number(5))) << "a new fault is said again";
    EXPECT_FALSE(file.catch_up());
  }
  EXPECT_TRUE(file.catch_up());
  EXPECT_TRUE(file.catch_up()) << "there is nothing more to write";
  EXPECT_EQ(ShotFile(temp.path()).read().shots, shots_to(5));
}

TEST(ShotFile, WhatIsNoFileIsOneSentence) {
  const test::TempDir temp;
  fs::create_directory(temp / kShotFileName);
  ShotFile file(temp.path());
  const ShotFile::Kept kept = file.read();
  EXPECT_TRUE(kept.shots.empty());
  ASSERT_TRUE(kept.fault);
  EXPECT_NE(kept.fault->find(kShotFileName), std::string::npos);
  const Result<void> added = file.add(shot_number(1));
  ASSERT_FALSE(added);
  EXPECT_NE(added.error().message.find(kShotFileName), std::string::npos);
}

}  // namespace
}  // namespace osteon
