// Runs several viewers of one room as processes. What a person draws and says in one viewer appears in the others, and
// one viewer follows another's view.
#include <gtest/gtest.h>
#include <png.h>

#include <thread>

#include "tests/integration/stage.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

struct Photo {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  [[nodiscard]] std::array<int, 3> at(int x, int y) const {
    const std::size_t i =
        3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    return i + 2 < rgb.size() ? std::array<int, 3>{rgb[i], rgb[i + 1], rgb[i + 2]} : std::array<int, 3>{};
  }
};

Photo read_photo(const std::filesystem::path& file) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  Photo photo;
  if (png_image_begin_read_from_file(&header, file.c_str()) == 0) return photo;
  header.format = PNG_FORMAT_RGB;
  photo.width = static_cast<int>(header.width);
  photo.height = static_cast<int>(header.height);
  photo.rgb.resize(PNG_IMAGE_SIZE(header));
  png_image_finish_read(&header, nullptr, photo.rgb.data(), 0, nullptr);
  return photo;
}

int difference(const std::array<int, 3>& a, const std::array<int, 3>& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

// Number of pixels that differ in a square in the middle of the picture.
int changed_in_middle(const Photo& a, const Photo& b, int half) {
  int changed = 0;
  for (int y = a.height / 2 - half; y < a.height / 2 + half; ++y)
    for (int x = a.width / 2 - half; x < a.width / 2 + half; ++x)
      changed += difference(a.at(x, y), b.at(x, y)) > 60 ? 1 : 0;
  return changed;
}

class Annotations : public testing::Test {
 protected:
  void SetUp() override {
    screen_ = Xvfb::start();
    ASSERT_TRUE(screen_) << "Xvfb, of Debian's package xvfb, did not start";
  }
  // View from above on the block. Its top is at z = 0, round the origin.
  static constexpr const char* kFromAbove = "look at 0 0 0 from 0 0 120 up 0 1 0";

  Photo photo(ScriptedViewer& viewer, const std::string& name) {
    EXPECT_TRUE(viewer.tell("screenshot " + (stage_ / name).string()));
    return read_photo(stage_ / name);
  }
  json status(ScriptedViewer& viewer) {
    EXPECT_TRUE(viewer.tell("status " + (stage_ / "status.json").string()));
    return read_json(stage_ / "status.json");
  }
  // Asks again until the condition holds, for at most a minute.
  template <class Is>
  bool becomes(ScriptedViewer& viewer, Is is) {
    for (int i = 0; i < 600; ++i) {
      if (is(status(viewer))) return true;
      std::this_thread::sleep_for(100ms);
    }
    return false;
  }

  std::optional<Xvfb> screen_;
  Stage stage_{20.0};
};

TEST_F(Annotations, WhatOneDrawsTheOtherSeesUntilItIsWiped) {
  ScriptedViewer berg(stage_.address(), *screen_, {"--plain", "--name", "Dr. Berg"}),
      ada(stage_.address(), *screen_, {"--plain", "--name", "Ada"});
  for (ScriptedViewer* viewer : {&berg, &ada}) ASSERT_TRUE(viewer->tell("wait surface"));
  ASSERT_TRUE(ada.tell(kFromAbove));
  const Photo bare = photo(ada, "bare.png");
  ASSERT_GT(bare.width, 0);

  const std::string drawn = berg.ask("draw -8 0 0 8 0 0");
  ASSERT_TRUE(drawn.starts_with("ok")) << drawn;
  ASSERT_TRUE(ada.tell("wait drawn 1"));
  const Photo line = photo(ada, "line.png");
  // 16 mm over the middle of the picture, along its middle row of pixels.
  int along = 0;
  for (int x = line.width / 2 - 30; x <= line.width / 2 + 30; ++x)
    along += difference(line.at(x, line.height / 2), bare.at(x, bare.height / 2)) > 60 ? 1 : 0;
  EXPECT_EQ(along, 61);
  EXPECT_LT(changed_in_middle(line, bare, 30), 61 * 16) << "only a line is drawn";

  // Only the author of an annotation can remove it.
  ASSERT_TRUE(ada.tell("wipe all"));
  EXPECT_EQ(status(ada)["drawn"], 1);
  ASSERT_TRUE(berg.tell("wipe all"));
  ASSERT_TRUE(ada.tell("wait drawn 0"));
  EXPECT_EQ(changed_in_middle(photo(ada, "again.png"), bare, 30), 0);
  EXPECT_TRUE(ada.ask("wipe 77").starts_with("error"));
  EXPECT_TRUE(ada.ask("draw 1 2 3").starts_with("error"));
}

TEST_F(Annotations, WhoComesLaterSeesWhatIsThere) {
  ScriptedViewer berg(stage_.address(), *screen_, {"--plain", "--name", "Dr. Berg"});
  ASSERT_TRUE(berg.tell("wait surface"));
  ASSERT_TRUE(berg.tell("label 1 2 0 a nerve"));
  ASSERT_TRUE(berg.tell("point 3 4 0 look here"));
  ASSERT_TRUE(berg.tell("point 4 4 0 no, here"));
  ScriptedViewer late(stage_.address(), *screen_);
  ASSERT_TRUE(late.tell("wait surface"));
  EXPECT_TRUE(late.tell("wait drawn 2")) << "an arrow is moved, not doubled";
}

TEST_F(Annotations, OneFollowsWhereAnotherLooks) {
  ScriptedViewer berg(stage_.address(), *screen_, {"--plain", "--name", "Dr. Berg"}),
      ada(stage_.address(), *screen_, {"--plain", "--name", "Ada"});
  for (ScriptedViewer* viewer : {&berg, &ada}) ASSERT_TRUE(viewer->tell("wait surface"));
  const auto looks_from = [](double x, double y, double z) {
    return [=](const json& status) {
      const json eye = status["camera"]["eye_mm"];
      return std::abs(eye[0].get<double>() - x) + std::abs(eye[1].get<double>() - y) +
                 std::abs(eye[2].get<double>() - z) <
             1e-6;
    };
  };
  ASSERT_TRUE(ada.tell(kFromAbove));
  EXPECT_TRUE(ada.ask("follow Cy").starts_with("error"));
  ASSERT_TRUE(ada.tell("follow Dr. Berg"));
  ASSERT_TRUE(berg.tell("look at 1 2 3 from 70 -80 40 up 0 0 1"));
  EXPECT_TRUE(becomes(ada, looks_from(70, -80, 40)));
  ASSERT_TRUE(berg.tell("look at 1 2 3 from -70 -80 40 up 0 0 1"));
  EXPECT_TRUE(becomes(ada, looks_from(-70, -80, 40)));
  EXPECT_EQ(status(ada)["camera"]["target_mm"], (json{1.0, 2.0, 3.0}));

  // After "follow off" the camera stays. The room sends Dr. Berg's next view to a third viewer, but the second has not
  // moved.
  ASSERT_TRUE(ada.tell("follow off"));
  ASSERT_TRUE(berg.tell("look overview"));
  ScriptedViewer other(stage_.address(), *screen_, {"--plain", "--name", "other"});
  ASSERT_TRUE(other.tell("wait surface"));
  EXPECT_TRUE(becomes(other, [&](const json&) {
    EXPECT_TRUE(other.tell("look as Dr. Berg"));
    return !looks_from(-70, -80, 40)(status(other));
  })) << "the room has the new view";
  EXPECT_TRUE(looks_from(-70, -80, 40)(status(ada)));
}

TEST_F(Annotations, WordsReachWhomTheyAreFor) {
  ScriptedViewer berg(stage_.address(), *screen_, {"--plain", "--name", "Dr. Berg"}),
      ada(stage_.address(), *screen_, {"--plain", "--name", "Ada"});
  for (ScriptedViewer* viewer : {&berg, &ada}) ASSERT_TRUE(viewer->tell("wait surface"));
  const auto says = [](const std::string& text) {
    return [text](const json& status) { return status["said"].dump().find(text) != std::string::npos; };
  };
  ASSERT_TRUE(berg.tell("say good morning"));
  EXPECT_TRUE(becomes(ada, says("Dr. Berg: good morning")));
  ASSERT_TRUE(berg.tell("say Ada slower"));
  EXPECT_TRUE(becomes(ada, says("Dr. Berg to you: slower")));
  ASSERT_TRUE(ada.tell("say \"Dr. Berg\" yes"));
  EXPECT_TRUE(becomes(berg, says("Ada to you: yes")));
}

}  // namespace
}  // namespace osteon::test
