// The render loop with other people in the room: what it shows of them, and what it asks the room for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "picture.hpp"
#include "synthetic.hpp"
#include "tests/support/temp_dir.hpp"
#include "viewer_client/app/viewer.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr AuthorId kPartner{3}, kOther{4}, kMe{8};

// A room as on a server, as far as a viewer asks for it.
class SmallRoom final : public SupervisionClient {
 public:
  std::vector<PersonSeen> people_here;
  std::vector<Annotation> drawn;
  std::vector<WordsSeen> said;
  bool closed = false;

  AuthorId self() const override { return kMe; }
  std::vector<PersonSeen> people() const override { return people_here; }
  std::vector<Annotation> annotations() const override { return drawn; }
  std::vector<WordsSeen> words() const override { return said; }
  bool wait(const std::function<bool()>& done, std::chrono::milliseconds) const override { return done(); }
  Result<std::uint32_t> draw(const Annotation& one) override {
    if (closed) return refused();
    drawn.push_back(one);
    drawn.back().author = kMe;
    return drawn.back().id = ++given_;
  }
  Result<void> wipe_off(std::uint32_t id) override {
    if (closed) return refused();
    std::erase_if(drawn, [&](const Annotation& one) { return id == 0 ? one.author == kMe : one.id == id; });
    return {};
  }
  Result<RoomSeq> say(AuthorId to, const std::string& words) override {
    said.push_back({RoomSeq{said.size() + 1}, kMe, to, words});
    return said.back().place;
  }
  Result<RoomSeq> supervise(AuthorId, const Restrictions&) override { return refused(); }
  Result<std::pair<RoomSeq, std::size_t>> undo(const UndoSelection&) override { return refused(); }
  Result<std::pair<RoomSeq, std::size_t>> redo(std::uint32_t) override { return refused(); }
  Result<RoomSeq> mark(const std::string&) override { return refused(); }
  Result<std::pair<AuthorId, std::size_t>> demonstrate(const DemonstrationSource&) override { return refused(); }
  Result<void> end_demonstration(AuthorId) override { return refused(); }
  Result<std::vector<std::pair<std::string, Digest>>> tools() override { return refused(); }
  Result<RoomSeen> status() override { return refused(); }

 private:
  static tl::unexpected<Error> refused() { return failure(ErrorCode::denied, "the room refuses this"); }
  std::uint32_t given_ = 0;
};

class Company : public test::Picture {
 protected:
  void SetUp() override {
    test::Picture::SetUp();
    PersonSeen ada, berg;
    ada.author = kPartner;
    ada.name = "Ada";
    ada.hand = true;
    berg.author = kOther;
    berg.name = "Dr. Berg";
    berg.role = Role::instructor;
    ada.here = berg.here = true;
    berg.look = ViewFrustum{Vec3(0, -200, 100), Vec3(1, 2, 3), 0.001, 0.5};
    room_.people_here = {ada, berg};
  }
  // Carries out some lines. Returns what ended it.
  Result<void> obey(const std::string& lines, const std::string& hand = {}) {
    ViewerOptions options;
    options.bounds = {Vec3(-20, -20, -20), Vec3(20, 20, 20)};
    options.people = &room_;
    options.hand = hand;
    options.stop_at_error = true;
    RenderQueue render_queue;
    render_queue.begin_stream();
    std::vector<ReceivedBlock> blocks;
    blocks.push_back(test::block({BodyId{0}, 0, {0, 0, 0}}, 1, "ball", test::sphere_mesh(Vec3::Zero(), 15.0, 0)));
    render_queue.put_mesh(RoomSeq{1}, std::move(blocks), true, 1, 0);
    auto viewer = Viewer::make(options, *window_, render_queue, ScriptReader::of("wait surface\n" + lines));
    if (!viewer) return tl::unexpected(viewer.error());
    for (int i = 0; i < 2000; ++i) {
      if (on_turn_) on_turn_(i);
      const auto state = viewer->turn(false);
      if (!state) return tl::unexpected(state.error());
      if (*state == Viewer::State::finished) {
        status_ = nlohmann::json::parse(viewer->summary_json());
        return {};
      }
    }
    return failure(ErrorCode::unavailable, "it does not end");
  }
  static std::string why(const Result<void>& outcome) { return outcome ? "ok" : outcome.error().message; }

  SmallRoom room_;
  std::function<void(int)> on_turn_;
  nlohmann::json status_;
};

TEST_F(Company, AScriptDrawsAndWipes) {
  EXPECT_EQ(why(obey("point 1 2 3 here\nlabel 4 5 6 a nerve\ndraw 0 0 0 0 0 9\nwait drawn 3")), "ok");
  ASSERT_EQ(room_.drawn.size(), 3u);
  EXPECT_EQ(room_.drawn[0].kind, AnnotationKind::pointer);
  EXPECT_EQ(room_.drawn[0].points.front(), (std::array<std::int32_t, 3>{1024, 2048, 3072}));
  EXPECT_EQ(room_.drawn[0].words, "here");
  EXPECT_EQ(room_.drawn[1].words, "a nerve");
  EXPECT_EQ(room_.drawn[2].points.size(), 2u);
  EXPECT_EQ(status_["drawn"], 3);
  EXPECT_EQ(why(obey("wipe 2\nwait drawn 2\nwipe all\nwait drawn 0")), "ok");
  EXPECT_TRUE(room_.drawn.empty());
  // What the room would reject is reported before the room is asked.
  EXPECT_THAT(why(obey("label 0 0 0 " + std::string(300, 'x'))), HasSubstr("words"));
  room_.closed = true;
  EXPECT_EQ(why(obey("point 0 0 0")), "the room refuses this");
}

TEST_F(Company, WordsGoToWhomTheyAreMeantFor) {
  EXPECT_EQ(why(obey("say good morning\nsay Ada slower\nsay \"Dr. Berg\" may I?\nsay #3 here\n"
                     "say all Ada is good\nsay hello")),
            "ok");
  ASSERT_EQ(room_.said.size(), 6u);
  EXPECT_EQ(room_.said[0].words, "good morning");
  EXPECT_EQ(room_.said[0].to, AuthorId{});
  EXPECT_EQ(room_.said[1].words, "slower");
  EXPECT_EQ(room_.said[1].to, kPartner);
  EXPECT_EQ(room_.said[2].to, kOther);
  EXPECT_EQ(room_.said[3].to, kPartner);
  EXPECT_EQ(room_.said[4].words, "Ada is good");
  EXPECT_EQ(room_.said[4].to, AuthorId{});
  EXPECT_EQ(room_.said[5].words, "hello");
  EXPECT_THAT(why(obey("say #99 hello")), HasSubstr("#99"));
  EXPECT_THAT(why(obey("say Ada")), HasSubstr("no words"));
}

TEST_F(Company, TheCameraGoesWhereAnotherLooks) {
  EXPECT_EQ(why(obey("look as Dr. Berg")), "ok");
  EXPECT_EQ(status_["camera"]["eye_mm"], (std::vector<double>{0, -200, 100}));
  EXPECT_EQ(status_["camera"]["target_mm"], (std::vector<double>{1, 2, 3}));
  EXPECT_THAT(why(obey("look as Ada")), HasSubstr("where Ada looks"));
  EXPECT_THAT(why(obey("follow Cy")), HasSubstr("Ada, Dr. Berg"));
}

TEST_F(Company, TheCameraFollowsEveryLookUntilItIsLetGo) {
  const Vec3 later(300, 0, 0);
  // The room receives a new view while the viewer waits for an annotation. The annotation comes with it.
  on_turn_ = [&](int turn) {
    if (turn != 30) return;
    room_.people_here[1].look->eye_mm = later;
    room_.drawn.push_back({.id = 50, .kind = AnnotationKind::label, .points = {{0, 0, 0}}, .words = "now"});
  };
  EXPECT_EQ(why(obey("follow Dr. Berg\nwait drawn 1")), "ok");
  EXPECT_EQ(status_["camera"]["eye_mm"], (std::vector<double>{300, 0, 0}));
  room_.drawn.clear();
  room_.people_here[1].look->eye_mm = Vec3(0, -200, 100);
  EXPECT_EQ(why(obey("follow Dr. Berg\nfollow off\nwait drawn 1")), "ok");
  EXPECT_EQ(status_["camera"]["eye_mm"], (std::vector<double>{0, -200, 100}));
}

TEST_F(Company, TheHandBeforeTheWindowSeesWhatWasDecided) {
  room_.people_here[0].supervision.stopped = true;
  EXPECT_EQ(why(obey("", "Ada")), "ok");
  EXPECT_THAT(status_["said"], ElementsAre("Dr. Berg has stopped your hand"));
  EXPECT_EQ(status_["holding"], "Your hand is stopped");
  EXPECT_EQ(why(obey("")), "ok");
  EXPECT_THAT(status_["said"], ElementsAre("Dr. Berg has stopped Ada's hand"));
  EXPECT_EQ(status_["holding"], "");
}

TEST_F(Company, DrawingsOfOthersAreSeen) {
  EXPECT_EQ(why(obey("look at 0 0 0 from 0 -100 0 up 0 0 1\nwait drawn 0")), "ok");
  const Image bare = window_->scene().image();
  Annotation line{.id = 1, .kind = AnnotationKind::line, .colour = 0x10e040};
  for (const double x : {-8.0, 8.0}) line.points.push_back(in_steps(Vec3(x, -16, 0)));
  room_.drawn = {line};
  EXPECT_EQ(why(obey("look at 0 0 0 from 0 -100 0 up 0 0 1\nwait drawn 1")), "ok");
  EXPECT_GT(test::differing_pixels(window_->scene().image(), bare), 200);
  const Vec3 middle = colour(window_->scene().image(), test::kWidth / 2, test::kHeight / 2);
  EXPECT_GT(middle.y(), 1.25 * middle.x());
}

TEST_F(Company, WithoutARoomThereIsNobody) {
  ViewerOptions options;
  options.stop_at_error = true;
  RenderQueue render_queue;
  auto viewer = Viewer::make(options, *window_, render_queue, ScriptReader::of("say hello"));
  ASSERT_TRUE(viewer);
  const auto state = viewer->turn(false);
  ASSERT_FALSE(state);
  EXPECT_EQ(state.error().code, ErrorCode::unavailable);
}

}  // namespace
}  // namespace osteon
