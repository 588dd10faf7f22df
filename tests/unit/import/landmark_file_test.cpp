// The file in which a person writes landmarks of two scans.
#include "server/import/landmark_file.hpp"

#include <fstream>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

constexpr const char* kThree =
    "landmarks:\n"
    "  - {name: lateral epicondyle, fixed_mm: [1, 2, 3], moving_mm: [4, 5, -6.5]}\n"
    "  - {moving_mm: [+40, 5, 6], fixed_mm: [10, 2, 3]}\n"
    "  - {name: apex, fixed_mm: [1, 20, 3], moving_mm: [4, 50, 6]}\n";

TEST(LandmarkFile, HasPairsAndNames) {
  const auto landmarks = parse_landmarks(kThree, "points.yaml");
  ASSERT_TRUE(landmarks) << landmarks.error().message;
  ASSERT_EQ(landmarks->size(), 3u);
  EXPECT_EQ((*landmarks)[0].name, "lateral epicondyle");
  EXPECT_EQ((*landmarks)[1].name, "landmark 2");
  EXPECT_EQ((*landmarks)[0].at.moving_mm, Vec3(4, 5, -6.5));
  EXPECT_EQ((*landmarks)[1].at.fixed_mm, Vec3(10, 2, 3));
  EXPECT_EQ((*landmarks)[1].at.moving_mm, Vec3(40, 5, 6));
}

TEST(LandmarkFile, WrongTextIsOneSentence) {
  const auto refused = [](const std::string& text, const std::string& what) {
    const auto landmarks = parse_landmarks(text, "points.yaml");
    ASSERT_FALSE(landmarks) << text;
    EXPECT_EQ(landmarks.error().code, ErrorCode::invalid_input);
    EXPECT_TRUE(landmarks.error().message.starts_with("points.yaml")) << landmarks.error().message;
    expect_one_sentence(landmarks.error(), what);
  };
  const auto with = [](const std::string& third) {
    return "landmarks: [{fixed_mm: [0, 0, 0], moving_mm: [1, 1, 1]}, {fixed_mm: [9, 0, 0], moving_mm: [10, 1, 1]}, " +
           third + "]";
  };
  refused("", "landmarks is not a list");
  refused("landmarks: []", "landmarks is not a list");
  refused("landmarks: [", "this is not YAML");
  refused("points: [1]", "landmarks is not a list");
  refused("landmarks: [{}]\nscale: 2", "another field beside landmarks");
  refused("landmarks: [{fixed_mm: [0, 0, 0], moving_mm: [1, 1, 1]}]", "has 1 landmark; write at least 3");
  refused("landmarks: [{fixed_mm: [0, 0, 0], moving_mm: [1, 1, 1]}, {fixed_mm: [9, 0, 0], moving_mm: [1, 1, 1]}]",
          "has 2 landmarks; write at least 3");
  refused(with("7"), "landmark 3: it has no fields");
  refused(with("{fixed_mm: [0, 9, 0]}"), "landmark 3: moving_mm is missing");
  refused(with("{fixed_mm: [0, 9], moving_mm: [1, 2, 3]}"), "landmark 3: fixed_mm does not have three numbers");
  refused(with("{fixed_mm: [0, 9, nan], moving_mm: [1, 2, 3]}"), "landmark 3: fixed_mm is \"nan\"");
  refused(with("{fixed_mm: [0, 9, 1e6], moving_mm: [1, 2, 3]}"), "landmark 3: fixed_mm is \"1e6\"");
  refused(with("{fixed_mm: [0, 9, 0], moving_mm: [1, 2, 3], weight: 2}"), "\"weight\" is no field of a landmark");
  refused(with("{fixed_mm: [0, 9, 0], moving_mm: [1, 2, 3], fixed_mm: [0, 0, 1]}"), "fixed_mm is there twice");
  refused(with("{fixed_mm: [0, 9, 0], moving_mm: [1, 2, 3], name: [a]}"), "landmark 3: name is not");
  refused(with("{fixed_mm: [0, 9, 0], moving_mm: [1, 2, 3], name: landmark 1}"), "as that of another landmark");
}

TEST(LandmarkFile, AnAbsentOrLongFileIsRefused) {
  const test::TempDir folder;
  const auto absent = read_landmarks(folder / "none.yaml");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::not_found);
  std::ofstream(folder / "points.yaml") << kThree << std::string(2 << 20, '#');
  const auto large = read_landmarks(folder / "points.yaml");
  ASSERT_FALSE(large);
  expect_one_sentence(large.error(), "longer than 1 MiB");
}

}  // namespace
}  // namespace osteon::import
