#include "viewer_client/app/viewer.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "picture.hpp"
#include "synthetic.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::sphere_mesh;

class ViewerLoop : public test::Picture {};

// Tests the render loop between a network thread's render queue and the window.
TEST_F(ViewerLoop, TheLoopShowsWhatTheRenderQueueBrings) {
  const test::TempDir folder;
  ViewerOptions options;
  options.bounds = {Vec3(-20, -20, -20), Vec3(20, 20, 20)};
  options.frame_log = folder / "frames.csv";
  RenderQueue render_queue;
  auto viewer = Viewer::make(options, *window_, render_queue,
                             ScriptReader::of("wait surface\nwait seq 5\nstatus " + (folder / "status.json").string()));
  ASSERT_TRUE(viewer);

  const BlockKey key{BodyId{0}, 0, {0, 0, 0}};
  const auto deliver = [&](std::uint64_t seq, double radius_mm, bool complete) {
    std::vector<ReceivedBlock> blocks;
    blocks.push_back(test::block(key, seq + 1, std::to_string(seq), sphere_mesh(Vec3::Zero(), radius_mm, 0)));
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    render_queue.put_mesh(RoomSeq{seq}, std::move(blocks), complete, 1, std::chrono::nanoseconds(now).count());
  };
  const auto turns = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const auto state = viewer->turn(false);
      if (!state || *state == Viewer::State::finished) return true;
    }
    return false;
  };
  // Nothing of the surface is drawn until the whole surface is there.
  render_queue.begin_stream();
  deliver(3, 15.0, false);
  EXPECT_FALSE(turns(8));
  const Image before = window_->scene().image();
  deliver(4, 15.0, true);
  EXPECT_FALSE(turns(8));
  EXPECT_GT(differing_pixels(window_->scene().image(), before), 1000);
  deliver(5, 18.0, true);
  EXPECT_TRUE(turns(100));

  const auto status = nlohmann::json::parse(std::ifstream(folder / "status.json"));
  EXPECT_EQ(status["room_seq"], 5);
  EXPECT_EQ(status["blocks"], 1);
  EXPECT_EQ(status["triangles"], sphere_mesh(Vec3::Zero(), 18.0, 0).triangles.size());
  EXPECT_EQ(status["updates"], 2);

  std::ifstream log(folder / "frames.csv");
  std::string line;
  std::getline(log, line);
  EXPECT_EQ(line, "room_seq,received_mono_ns,rendered_mono_ns");
  std::vector<std::uint64_t> seqs;
  while (std::getline(log, line)) {
    long long seq = 0, received = 0, rendered = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lld,%lld,%lld", &seq, &received, &rendered), 3);
    EXPECT_LT(received, rendered);
    seqs.push_back(static_cast<std::uint64_t>(seq));
  }
  EXPECT_EQ(seqs, (std::vector<std::uint64_t>{3, 4, 5}));
}

}  // namespace
}  // namespace osteon
