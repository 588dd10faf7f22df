// A large bone is drawn in full detail only where somebody looks. What viewers hold follows their view frusta and stays
// one closed surface.
#include <gtest/gtest.h>

#include <map>
#include <mutex>
#include <set>

#include "common/surface/weld.hpp"
#include "common/wire/convert.hpp"
#include "server/rooms/room_runtime.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/room/parts.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr double kPitch_mm = 0.8, kRadius_mm = 30.0;

Case ball() {
  return test::make_bone(
      {Vec3::Constant(-kRadius_mm - 4), Vec3::Constant(kRadius_mm + 4)}, kPitch_mm,
      [](const Vec3& p) { return p.norm() - kRadius_mm; }, [](const Vec3&) { return 1.9; });
}

// A view close enough for full detail, with `wide_mm` from the middle of the picture to its corner.
ViewFrustum close_to(const Vec3& target_mm, double wide_mm) {
  return {target_mm + Vec3(0, -40, 0), target_mm, 0.3 * kPitch_mm / 40, std::atan(wide_mm / 40)};
}

class Reader final : public MeshSubscriber {
 public:
  explicit Reader(AuthorId author) : author_(author) {}
  AuthorId author() const override { return author_; }
  void begin(MeshUpdate whole_surface) override {
    enqueue(whole_surface);
    for (const auto& [key, mesh] : whole_surface.blocks) first_.insert(key.level);
  }
  void enqueue(const MeshUpdate& update) override {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, bytes] : update.blocks) {
      v1::WatchMeshResponse response;
      ASSERT_TRUE(response.ParseFromString(*bytes));
      const v1::MeshBlock& block = response.blocks(0);
      EXPECT_EQ(wire::key_from_wire(block).value(), key);
      if (block.payload().empty())
        blocks_.erase(key);
      else
        blocks_[key] = {{block.payload().begin(), block.payload().end()}};
    }
  }
  void end(const std::string&) override {}
  std::size_t waiting() const override { return 0; }

  Digest hash() const {
    const std::lock_guard lock(mutex_);
    std::map<BlockKey, Digest> hashes;
    for (const auto& [key, payload] : blocks_) hashes[key] = mesh_hash(payload);
    return surface_hash(hashes);
  }
  std::set<int> levels() const {
    const std::lock_guard lock(mutex_);
    std::set<int> levels;
    for (const auto& [key, payload] : blocks_) levels.insert(key.level);
    return levels;
  }
  // The finest level of the blocks that are nearest to the point.
  int level_at(const Vec3& place_mm) const {
    const std::lock_guard lock(mutex_);
    double nearest = 1e9;
    int level = kCoarsestLevel;
    for (const auto& [key, payload] : blocks_) {
      const auto mesh = decode_block(key, payload, level_pitch_mm(kPitch_mm, key.level));
      for (const auto& p : mesh->positions_mm)
        if (const double distance = (Vec3(p[0], p[1], p[2]) - place_mm).norm(); distance < nearest) {
          nearest = distance;
          level = key.level;
        }
    }
    return level;
  }
  const std::set<int>& first_levels() const { return first_; }
  std::set<BodyId> bodies() const {
    const std::lock_guard lock(mutex_);
    std::set<BodyId> bodies;
    for (const auto& [key, payload] : blocks_) bodies.insert(key.body);
    return bodies;
  }
  std::size_t triangles() const { return whole().triangles.size(); }
  // The number of edges without a matching edge in the other direction.
  int open_edges() const {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : whole().triangles)
      for (std::size_t i = 0; i < 3; ++i) {
        ++edges[{t[i], t[(i + 1) % 3]}];
        --edges[{t[(i + 1) % 3], t[i]}];
      }
    return static_cast<int>(std::ranges::count_if(edges, [](const auto& edge) { return edge.second != 0; }));
  }

 private:
  Mesh whole() const {
    const std::lock_guard lock(mutex_);
    std::vector<Mesh> meshes;
    for (const auto& [key, payload] : blocks_)
      meshes.push_back(decode_block(key, payload, level_pitch_mm(kPitch_mm, key.level)).value());
    return weld(meshes);
  }

  const AuthorId author_;
  mutable std::mutex mutex_;
  std::map<BlockKey, BlockPayload> blocks_;
  std::set<int> first_;
};

RuntimeRates fast() { return {.tick = 1ms, .mesh = 3ms, .looks = 5ms}; }

TEST(NearDetail, FollowsTheViewsOfAllViewers) {
  RoomRuntime runtime(Room(ball()), fast(), {}, Detail::near);
  RoomRuntime in_full(Room(ball()), fast(), {}, Detail::full);
  Reader full(in_full.join(MemberKind::watcher).value());
  in_full.watch_mesh(full);
  EXPECT_EQ(full.levels(), std::set<int>{0});
  EXPECT_EQ(full.open_edges(), 0);

  // Nobody has looked yet. The first viewer is sent the coarse bone at once and then what it looks at.
  const Vec3 north(0, 0, kRadius_mm), east(kRadius_mm, 0, 0), south(0, 0, -kRadius_mm);
  Reader one(runtime.join(MemberKind::watcher).value());
  runtime.watch_mesh(one, close_to(north, 8));
  EXPECT_EQ(one.first_levels(), std::set<int>{kCoarsestLevel});
  ASSERT_TRUE(test::wait_until([&] { return one.level_at(north) == 0; }, 20s));
  EXPECT_LT(one.level_at(south), 0);
  EXPECT_EQ(one.open_edges(), 0);
  EXPECT_EQ(one.hash(), runtime.surface_hash());
  EXPECT_LT(one.triangles(), 2 * full.triangles() / 3);

  // Its view moves, and another viewer joins elsewhere. Each has the detail that it needs, and both hold the same
  // surface.
  runtime.look(one.author(), close_to(east, 8));
  ASSERT_TRUE(test::wait_until([&] { return one.level_at(east) == 0 && one.level_at(north) < 0; }, 20s));
  EXPECT_EQ(one.open_edges(), 0);
  Reader two(runtime.join(MemberKind::watcher).value());
  runtime.watch_mesh(two, close_to(south, 8));
  EXPECT_EQ(two.hash(), runtime.surface_hash()) << "the surface of this moment";
  EXPECT_EQ(two.first_levels(), one.levels());
  ASSERT_TRUE(test::wait_until([&] { return two.level_at(south) == 0; }, 20s));
  EXPECT_EQ(two.level_at(east), 0);
  EXPECT_EQ(one.open_edges(), 0);
  EXPECT_EQ(one.hash(), two.hash());
  EXPECT_EQ(one.hash(), runtime.surface_hash());

  // The bone at a tool is drawn in full wherever the tool works.
  CuttingState state;
  state.author = runtime.join(MemberKind::surgeon).value();
  state.pose_bone_tool = pose_along(north, {0, 0, -1});
  runtime.publish_state(state);
  ASSERT_TRUE(test::wait_until([&] { return one.level_at(north) == 0; }, 20s));
  EXPECT_EQ(one.open_edges(), 0);

  // A viewer that never sends its view receives everything, with the same bytes as from a room that draws all in full.
  Reader all(runtime.join(MemberKind::watcher).value());
  runtime.watch_mesh(all);
  ASSERT_TRUE(test::wait_until([&] { return all.hash() == full.hash(); }, 20s));
  EXPECT_EQ(one.hash(), full.hash());
  runtime.leave(all);
  runtime.look(two.author(), close_to(east, 9));
  ASSERT_TRUE(test::wait_until([&] { return one.level_at(south) < 0; }, 20s));
  EXPECT_EQ(one.open_edges(), 0);
  EXPECT_EQ(one.hash(), runtime.surface_hash());
  for (Reader* reader : {&one, &two}) runtime.leave(*reader);
  in_full.leave(full);
}

// The part of the ball between two planes across x.
Fragment cap(const Case& bone, double from_mm, double to_mm) {
  return test::part(bone, [=](int x) { return kPitch_mm * x >= from_mm && kPitch_mm * x < to_mm; });
}

TEST(NearDetail, ABodyTakesAllItsBlocksAndNoOthers) {
  Room room(ball());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  ASSERT_TRUE(room.split(BodyId{0}, {cap(room.bone(), 15, 99)}, room.bone_epoch()));
  ASSERT_TRUE(room.split(BodyId{0}, {cap(room.bone(), -99, -15)}, room.bone_epoch()));
  RuntimeRates rates = fast();
  rates.pieces = 0ms;
  RoomRuntime runtime(std::move(room), rates, {}, Detail::near);
  Reader one(runtime.join(MemberKind::watcher).value());
  runtime.watch_mesh(one, close_to({0, 0, kRadius_mm}, 8));  // From here both fragments are far away.
  ASSERT_TRUE(test::wait_until([&] { return one.level_at({0, 0, kRadius_mm}) == 0; }, 20s));
  const auto remove = [&](BodyId body) {
    runtime.queue_event([=](Room& r) { return r.remove_body(surgeon, body); },
                        [](const Result<RoomEvent>& event) { EXPECT_TRUE(event); });
  };
  using Bodies = std::set<BodyId>;
  ASSERT_EQ(one.bodies(), (Bodies{BodyId{0}, BodyId{1}, BodyId{2}}));
  remove(BodyId{1});
  EXPECT_TRUE(test::wait_until([&] { return one.bodies() == Bodies{BodyId{0}, BodyId{2}}; }, 20s));
  EXPECT_EQ(one.open_edges(), 0) << "the body beside it lost no block";
  remove(BodyId{0});
  EXPECT_TRUE(test::wait_until([&] { return one.bodies() == Bodies{BodyId{2}}; }, 20s));
  EXPECT_EQ(one.open_edges(), 0);
  EXPECT_EQ(one.hash(), runtime.surface_hash());
  runtime.leave(one);
}

TEST(NearDetail, IsForLargeBonesUnlessAskedFor) {
  EXPECT_FALSE(RoomRuntime(Room(ball()), fast(), {}).draws_near());
  EXPECT_TRUE(RoomRuntime(Room(ball()), fast(), {}, Detail::near).draws_near());
}

}  // namespace
}  // namespace osteon
