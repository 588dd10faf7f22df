#include "common/wire/convert.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace osteon {
namespace {

Cut sample_cut() {
  const Tool drill = *find_tool("drill-3.2");
  return {.author = {7},
          .author_seq = 12,
          .lease_epoch = 3,
          .body = {2},
          .tool = drill.hash(),
          .level = 2,
          .path = {quantise(pose_along({1, 2, 3}, {0, 0.3, -1})), quantise(pose_along({-100.5, 2, 3}, {0, 0.3, -1}))},
          .spindle_rpm = 1000};
}

TEST(Wire, ACutComesBackByteForByte) {
  v1::Cut parsed;
  ASSERT_TRUE(parsed.ParseFromString(wire::to_wire(sample_cut()).SerializeAsString()));
  const auto back = wire::from_wire(parsed);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, sample_cut());
}

TEST(Wire, ALeafComesBackByteForByte) {
  FieldLeaf leaf{{1}, 2, {-8, 16, 24}, std::vector<std::int16_t>(kLeafVoxels)};
  for (std::size_t i = 0; i < leaf.values.size(); ++i)
    leaf.values[i] = static_cast<std::int16_t>(static_cast<int>(i) * 17 - 4096);
  const auto back = wire::from_wire(wire::to_wire(leaf));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, leaf);
}

TEST(Wire, AStateComesBack) {
  CuttingState state;
  state.author = {4};
  state.state_seq = 99;
  state.pose_bone_tool = pose_along({1, 2, 3}, {1, 0, 0});
  state.tool_name = "burr-round-5";
  state.spindle_rpm = 20000;
  state.force_physical_N = {1, -2, 3};
  state.phase = CuttingPhase::cutting;
  state.on_metal = true;
  state.force_hand_N = 0.5;
  state.device_holds_N = 0.875;
  state.suction = true;
  state.flutes_full = 0.375;
  state.time_ns = 123'456'789'012'345;
  state.cortex_mm = 4.5;
  state.seated = 0.25;
  state.blows = 17;
  state.blow_impulse_N_s = 2.75;
  const auto back = wire::from_wire(wire::to_wire(state));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->state_seq, 99u);
  EXPECT_EQ(back->tool_name, "burr-round-5");
  EXPECT_EQ(back->phase, CuttingPhase::cutting);
  EXPECT_TRUE(back->on_metal);
  EXPECT_EQ(back->force_hand_N, 0.5);
  EXPECT_EQ(back->device_holds_N, 0.875);
  EXPECT_FALSE(back->irrigation);
  EXPECT_TRUE(back->suction);
  EXPECT_EQ(back->flutes_full, 0.375);
  EXPECT_EQ(back->time_ns, state.time_ns);
  EXPECT_EQ(back->cortex_mm, 4.5);
  EXPECT_EQ(back->seated, 0.25);
  EXPECT_EQ(back->blows, 17u);
  EXPECT_EQ(back->blow_impulse_N_s, 2.75);
  EXPECT_EQ(back->force_physical_N, state.force_physical_N);
  EXPECT_LT((back->pose_bone_tool.position_mm - state.pose_bone_tool.position_mm).norm(), 1e-9);
}

// What a client of an older version sends has no such fields.
TEST(Wire, AStateWithoutTheOtherHandHasNone) {
  v1::CuttingState sent = wire::to_wire(CuttingState{});
  for (const bool irrigation : {false, true}) {
    sent.set_irrigation(irrigation);
    const auto back = wire::from_wire(sent);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->irrigation, irrigation);
    EXPECT_FALSE(back->suction);
    EXPECT_EQ(back->flutes_full, 0.0);
  }
  sent.set_flutes_full(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(wire::from_wire(sent));
}

TEST(Wire, AStateOfNoClockIsRefused) {
  v1::CuttingState sent = wire::to_wire(CuttingState{});
  for (const std::int64_t time_ns : {std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()}) {
    sent.set_time_ns(time_ns);
    const auto back = wire::from_wire(sent);
    ASSERT_FALSE(back) << time_ns;
    EXPECT_NE(back.error().message.find("time_ns"), std::string::npos) << back.error().message;
  }
}

// Each change makes a cut that no correct client sends. The message must name the field.
TEST(Wire, RefusesBadCutsByTheNameOfTheField) {
  const auto refused = [](const std::function<void(v1::Cut&)>& change, const std::string& field) {
    v1::Cut cut = wire::to_wire(sample_cut());
    change(cut);
    const auto back = wire::from_wire(cut);
    ASSERT_FALSE(back) << field;
    EXPECT_NE(back.error().message.find(field), std::string::npos) << back.error().message;
  };
  refused([](v1::Cut& c) { c.set_tool_hash("short"); }, "tool_hash");
  refused([](v1::Cut& c) { c.set_level(3); }, "level");
  refused([](v1::Cut& c) { c.clear_path(); }, "path");
  refused([](v1::Cut& c) { c.mutable_path(0)->add_position(4); }, "path");
  refused([](v1::Cut& c) { c.mutable_path(0)->set_rotation(3, 0); }, "path");
  refused([](v1::Cut& c) { c.mutable_path(1)->set_rotation(0, 40000); }, "path");
}

Digest all_of(std::uint8_t byte) {
  Digest out;
  out.bytes.fill(byte);
  return out;
}

Restrictions sample_supervision() {
  return {.stopped = true,
          .taken_by = {3},
          .guide = {4},
          .guide_share = 250,
          .force_limit = 1234,
          .zone = ZoneLimit{{-5, 6, -7}, 8},
          .tools = {all_of(1), all_of(2)},
          .words = "f\xc3\xbcnf"};
}

TEST(Wire, ASupervisionComesBackWhole) {
  for (const Restrictions& one : {Restrictions{}, sample_supervision()}) {
    v1::Restrictions parsed;
    ASSERT_TRUE(parsed.ParseFromString(wire::to_wire(one).SerializeAsString()));
    const auto back = wire::from_wire(parsed);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, one);
  }
  // Tools may arrive in any order, and more than once.
  v1::Restrictions message;
  for (const std::uint8_t tool : {2, 1, 2}) message.add_tools(wire::to_wire(all_of(tool)));
  EXPECT_EQ(wire::from_wire(message).value().tools, (std::vector{all_of(1), all_of(2)}));
}

TEST(Wire, RefusesBadSupervisionsByTheNameOfTheField) {
  const auto refused = [](const std::function<void(v1::Restrictions&)>& change, const std::string& field) {
    v1::Restrictions message = wire::to_wire(sample_supervision());
    change(message);
    const auto back = wire::from_wire(message);
    ASSERT_FALSE(back) << field;
    EXPECT_EQ(back.error().code, ErrorCode::invalid_input);
    EXPECT_NE(back.error().message.find(field), std::string::npos) << back.error().message;
  };
  refused([](v1::Restrictions& s) { s.set_guide_share(1001); }, "guide_share");
  refused([](v1::Restrictions& s) { s.set_guide_share(~0u); }, "guide_share");
  refused([](v1::Restrictions& s) { s.set_force_limit(10'001); }, "force_limit");
  refused([](v1::Restrictions& s) { s.set_force_limit(~0u); }, "force_limit");
  refused([](v1::Restrictions& s) { s.mutable_zone()->add_centre(1); }, "zone.centre");
  refused([](v1::Restrictions& s) { s.mutable_zone()->clear_centre(); }, "zone.centre");
  refused([](v1::Restrictions& s) { s.mutable_zone()->clear_radius(); }, "zone.radius");
  refused([](v1::Restrictions& s) { s.mutable_zone()->set_radius(-1); }, "zone.radius");
  refused([](v1::Restrictions& s) { s.add_tools("short"); }, "tools");
  refused(
      [](v1::Restrictions& s) {
        for (std::uint8_t n = 3; n < 90; ++n) s.add_tools(wire::to_wire(all_of(n)));
      },
      "tools");
  refused([](v1::Restrictions& s) { s.set_words(std::string(257, 'x')); }, "words");
}

Annotation sample_line() {
  return {.id = 3,
          .author = {4},
          .kind = AnnotationKind::line,
          .points = {{1, -2, 3}, {4, 5, -6}},
          .words = "cut here",
          .colour = 0xff0001};
}

TEST(Wire, AnAnnotationComesBackWhole) {
  const Annotation pointer{.points = {{7, 8, 9}}};
  const Annotation label{.kind = AnnotationKind::label, .points = {{7, 8, 9}}, .words = "nerve", .colour = 0};
  const Annotation axis{.kind = AnnotationKind::axis, .points = {{0, 0, 0}, {0, 0, -30720}}, .words = "screw"};
  const Annotation plane{.kind = AnnotationKind::plane, .points = {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}}};
  for (const Annotation& one : {sample_line(), pointer, label, axis, plane}) {
    v1::Annotation parsed;
    ASSERT_TRUE(parsed.ParseFromString(wire::to_wire(one).SerializeAsString()));
    const auto back = wire::from_wire(parsed);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, one);
  }
}

TEST(Wire, RefusesBadAnnotationsByTheNameOfTheField) {
  const auto refused = [](const std::function<void(v1::Annotation&)>& change, const std::string& field) {
    v1::Annotation message = wire::to_wire(sample_line());
    change(message);
    const auto back = wire::from_wire(message);
    ASSERT_FALSE(back) << field;
    EXPECT_NE(back.error().message.find(field), std::string::npos) << back.error().message;
  };
  refused([](v1::Annotation& a) { a.clear_kind(); }, "kind");
  refused([](v1::Annotation& a) { a.set_kind(static_cast<v1::AnnotationKind>(6)); }, "kind");
  refused([](v1::Annotation& a) { a.add_points(1); }, "points");
  refused([](v1::Annotation& a) { a.clear_points(); }, "points");
  refused([](v1::Annotation& a) { a.set_kind(v1::ANNOTATION_KIND_POINTER); }, "points");
  refused(
      [](v1::Annotation& a) {
        for (int i = 0; i < 3 * 1023; ++i) a.add_points(0);
      },
      "points");
  refused(
      [](v1::Annotation& a) {
        a.mutable_points()->Truncate(3);
        a.set_kind(v1::ANNOTATION_KIND_LABEL);
        a.clear_words();
      },
      "words");
  refused([](v1::Annotation& a) { a.set_words(std::string(257, 'x')); }, "words");
  refused([](v1::Annotation& a) { a.set_colour(1 << 24); }, "colour");
}

ShotRun sample_run() {
  CArmShot shot;
  shot.number = std::uint64_t{1} << 53U;
  shot.time_unix_ms = 1796050000123;
  shot.mode = ShotMode::live;
  shot.position = {{1.5, -2.25, 0.1}, 0.3, -0.1, {0, 10, -200}};
  shot.exposure_s = 1.0 / 15.0;
  shot.air_kerma_at_metre_ugy = 1.0 / 3.0;
  shot.dose_area_gy_cm2 = 1.35e-3;
  shot.seed = std::numeric_limits<std::uint64_t>::max();
  return {AuthorId{4}, 17, 2.5, shot};
}

TEST(Wire, AShotComesBackBitForBit) {
  for (const ShotMode mode : {ShotMode::single, ShotMode::pulse, ShotMode::live}) {
    ShotRun run = sample_run();
    run.last.mode = mode;
    v1::ShotRun parsed;
    ASSERT_TRUE(parsed.ParseFromString(wire::to_wire(run).SerializeAsString()));
    EXPECT_EQ(parsed.last().mode(), mode == ShotMode::single  ? v1::SHOT_MODE_SINGLE
                                    : mode == ShotMode::pulse ? v1::SHOT_MODE_PULSE
                                                              : v1::SHOT_MODE_LIVE);
    const auto back = wire::from_wire(parsed);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, run);
  }
  const ShotTotals totals{40, 2.75, 0.125};
  const auto back = wire::from_wire(wire::to_wire(totals));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, totals);
}

TEST(Wire, RefusesBadShotsByTheNameOfTheField) {
  using Shot = v1::CArmShot;
  const auto refused = [](const std::function<void(v1::ShotRun&)>& change, const std::string& field) {
    v1::ShotRun message = wire::to_wire(sample_run());
    change(message);
    const auto back = wire::from_wire(message);
    ASSERT_FALSE(back) << field;
    EXPECT_EQ(back.error().code, ErrorCode::invalid_input);
    EXPECT_EQ(back.error().message.find(field), 0u) << back.error().message;
  };
  // Every number that is not finite or beyond its limit.
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  using Set = void (Shot::*)(double);
  for (const double bad : {nan, inf, -inf, -1e300, 1.001e9})
    for (const auto& [set, field] : {std::pair<Set, std::string>(&Shot::set_orbit_rad, "shot.orbit_rad"),
                                     {&Shot::set_tilt_rad, "shot.tilt_rad"},
                                     {&Shot::set_exposure_s, "shot.exposure_s"},
                                     {&Shot::set_air_kerma_at_metre_ugy, "shot.air_kerma_at_metre_ugy"},
                                     {&Shot::set_dose_area_gy_cm2, "shot.dose_area_gy_cm2"}})
      refused([&, set = set](v1::ShotRun& run) { (run.mutable_last()->*set)(bad); }, field);
  for (const double bad : {nan, inf, -1.001e6, 1.001e6}) {
    refused([&](v1::ShotRun& run) { run.mutable_last()->mutable_isocentre_mm()->set_y(bad); }, "shot.isocentre_mm");
    refused([&](v1::ShotRun& run) { run.mutable_last()->mutable_translation_mm()->set_z(bad); }, "shot.translation_mm");
  }
  refused([](v1::ShotRun& run) { run.mutable_last()->set_orbit_rad(100.5); }, "shot.orbit_rad");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_exposure_s(-0.02); }, "shot.exposure_s");
  refused([](v1::ShotRun& run) { run.mutable_last()->clear_air_kerma_at_metre_ugy(); }, "shot.air_kerma_at_metre_ugy");
  refused([](v1::ShotRun& run) { run.mutable_last()->clear_mode(); }, "shot.mode");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_mode(static_cast<v1::ShotMode>(4)); }, "shot.mode");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_time_unix_ms(-1); }, "shot.time_unix_ms");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_time_unix_ms(100'000'000'000'001); }, "shot.time_unix_ms");
  refused([](v1::ShotRun& run) { run.mutable_last()->clear_number(); }, "shot.number");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_number((1ULL << 53U) + 1); }, "shot.number");
  refused([](v1::ShotRun& run) { run.clear_last(); }, "shot.mode");
  refused([](v1::ShotRun& run) { run.clear_first_number(); }, "run.first_number");
  refused([](v1::ShotRun& run) { run.mutable_last()->set_number(16); }, "run.first_number");
  for (const double bad : {nan, -1.0, 1.001e9})
    refused([&](v1::ShotRun& run) { run.set_exposure_s(bad); }, "run.exposure_s");

  const auto bad_totals = [](const ShotTotals& totals, const std::string& field) {
    const auto back = wire::from_wire(wire::to_wire(totals));
    ASSERT_FALSE(back) << field;
    EXPECT_EQ(back.error().message.find(field), 0u) << back.error().message;
  };
  bad_totals({0, 1.0, 1.0}, "session.shots");
  for (const double bad : {nan, inf, -1e-9, 1.001e9}) {
    bad_totals({1, bad, 1.0}, "session.exposure_s");
    bad_totals({1, 1.0, bad}, "session.dose_area_gy_cm2");
  }
}

TEST(Wire, RefusesPosesAndStatesThatAreNotNumbers) {
  v1::CuttingState state = wire::to_wire(CuttingState{});
  state.set_torque_n_mm(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(wire::from_wire(state));
  v1::Pose pose = wire::to_wire(Pose{});
  pose.mutable_position_mm()->set_y(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(wire::from_wire(pose));
  pose = wire::to_wire(Pose{});
  pose.set_rotation(3, 0.5f);
  EXPECT_FALSE(wire::from_wire(pose));
  v1::FieldLeaf leaf = wire::to_wire(FieldLeaf{{}, 0, {8, 0, 0}, std::vector<std::int16_t>(kLeafVoxels)});
  leaf.mutable_origin()->set_x(5);
  EXPECT_FALSE(wire::from_wire(leaf));
}

TEST(Wire, ALeafOfOneValueTravelsAsThatValue) {
  const FieldLeaf gone{{3}, 0, {8, 0, -16}, std::vector<std::int16_t>(kLeafVoxels, -2048)};
  const v1::FieldLeaf message = wire::to_wire(gone);
  EXPECT_EQ(message.values().size(), 2u);
  const auto back = wire::from_wire(message);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, gone);
  v1::FieldLeaf bad = message;
  for (const std::size_t size : {0u, 1u, 4u, 1023u}) {
    bad.set_values(std::string(size, 'x'));
    EXPECT_FALSE(wire::from_wire(bad)) << size;
  }
}

TEST(Wire, EveryBuiltinToolComesBackWithItsHash) {
  for (const Tool& tool : builtin_tools()) {
    const auto back = wire::from_wire(wire::to_wire(tool));
    ASSERT_TRUE(back) << tool.name << ": " << back.error().message;
    EXPECT_EQ(back->hash(), tool.hash()) << tool.name;
    EXPECT_EQ(back->cut_body(), tool.cut_body()) << tool.name;
  }
}

TEST(Wire, RefusesToolsThatAreNotWhatTheySay) {
  v1::ToolDefinition tool = wire::to_wire(*find_tool("drill-3.2"));
  tool.set_tool_hash(std::string(32, 'x'));
  EXPECT_FALSE(wire::from_wire(tool));
  tool.clear_tool_hash();
  EXPECT_TRUE(wire::from_wire(tool)) << "the sender need not know it";
  for (const char* text : {"", "name: a\n", "{", "- 1", "name: drill-3.2\nkind: spoon\n"}) {
    tool.set_yaml(text);
    EXPECT_FALSE(wire::from_wire(tool)) << text;
  }
}

TEST(Wire, ASceneItemComesBackAndBadOnesAreRefused) {
  SceneItem item;
  item.id = 4;
  item.body = {2};
  item.tool = find_tool("screw-1")->hash();
  item.pose_bone_item = pose_along({1, 2, 3}, {0, 1, 0});
  item.turns = 7.5;
  item.seated = true;
  item.set_at = 99;
  const auto back = wire::from_wire(wire::to_wire(item));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->id, 4u);
  EXPECT_EQ(back->body, item.body);
  EXPECT_EQ(back->tool, item.tool);
  EXPECT_EQ(back->turns, 7.5);
  EXPECT_TRUE(back->seated);
  EXPECT_EQ(back->set_at, 99u);
  EXPECT_LT((back->pose_bone_item.position_mm - item.pose_bone_item.position_mm).norm(), 1e-9);
  v1::SceneItem bad = wire::to_wire(item);
  bad.set_tool_hash("short");
  EXPECT_FALSE(wire::from_wire(bad));
  bad = wire::to_wire(item);
  bad.clear_pose_bone_item();
  EXPECT_FALSE(wire::from_wire(bad));
  bad = wire::to_wire(item);
  bad.set_turns(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(wire::from_wire(bad));
}

TEST(Wire, APlacingIsReadAndBadOnesAreRefused) {
  v1::SetSceneItemRequest request;
  const auto read = [&] { return wire::placing_from_wire(request); };
  EXPECT_TRUE(read() && std::holds_alternative<std::monostate>(*read()));
  *request.mutable_onto_bone()->mutable_near_mm() = wire::to_wire(Vec3(1, 2, 3));
  ASSERT_TRUE(read());
  EXPECT_EQ(std::get<OntoBone>(*read()).near_mm, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<OntoBone>(*read()).axis, std::nullopt);
  EXPECT_EQ(std::get<OntoBone>(*read()).across, Vec3::UnitX());
  *request.mutable_onto_bone()->mutable_axis() = wire::to_wire(Vec3(0, 0, -2));
  *request.mutable_onto_bone()->mutable_across() = wire::to_wire(Vec3(0, 1, 0));
  ASSERT_TRUE(read());
  EXPECT_EQ(std::get<OntoBone>(*read()).axis, Vec3(0, 0, -2));
  EXPECT_EQ(std::get<OntoBone>(*read()).across, Vec3(0, 1, 0));
  *request.mutable_onto_bone()->mutable_axis() = wire::to_wire(Vec3(0, 0, 0));
  EXPECT_FALSE(read());
  request.mutable_onto_bone()->clear_axis();
  request.mutable_onto_bone()->mutable_near_mm()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(read());
  request.set_thread_turns(-2.5);
  ASSERT_TRUE(read());
  EXPECT_EQ(std::get<ByThread>(*read()).turns, -2.5);
  request.set_thread_turns(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(read());
  request.set_drive_home_mm(7.0);
  ASSERT_TRUE(read());
  EXPECT_EQ(std::get<DriveHome>(*read()).most_mm, 7.0);
  request.set_drive_home_mm(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(read());
}

TEST(Wire, ABlocksLevelHasASign) {
  for (int level = -2; level <= 2; ++level) {
    v1::MeshBlock block, parsed;
    block.set_body(3);
    block.set_level(level);
    *block.mutable_index() = wire::to_wire(Coord{-1, 2, -3});
    ASSERT_TRUE(parsed.ParseFromString(block.SerializeAsString()));
    const auto key = wire::key_from_wire(parsed);
    ASSERT_TRUE(key) << level;
    EXPECT_EQ(*key, (BlockKey{{3}, level, {-1, 2, -3}}));
  }
  for (const int level : {-3, 3, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    v1::MeshBlock block;
    block.set_level(level);
    EXPECT_FALSE(wire::key_from_wire(block)) << level;
  }
}

TEST(Wire, AViewFrustumComesBackAndBadOnesAreRefusedByTheNameOfTheField) {
  const ViewFrustum look{{1, -2, 300}, {4, 5, 6}, 0.0005, 0.4};
  const auto back = wire::from_wire(wire::to_wire(look));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, look);
  const auto refused = [&](const std::function<void(v1::ViewFrustum&)>& change, const std::string& field) {
    v1::ViewFrustum bad = wire::to_wire(look);
    change(bad);
    const auto answer = wire::from_wire(bad);
    ASSERT_FALSE(answer) << field;
    EXPECT_NE(answer.error().message.find(field), std::string::npos) << answer.error().message;
  };
  refused([](v1::ViewFrustum& l) { l.mutable_eye_mm()->set_x(std::numeric_limits<double>::quiet_NaN()); }, "eye_mm");
  refused([](v1::ViewFrustum& l) { l.mutable_target_mm()->set_z(1e300); }, "target_mm");
  refused([](v1::ViewFrustum& l) { l.set_pixel_rad(0); }, "pixel_rad");
  refused([](v1::ViewFrustum& l) { l.set_view_rad(std::numeric_limits<double>::infinity()); }, "view_rad");
  refused([](v1::ViewFrustum& l) { l.Clear(); }, "pixel_rad");
  EXPECT_FALSE(back->up) << "a client need not send its up direction";

  ViewFrustum upright = look;
  upright.up = Vec3(1, 0, 0);
  const auto with_up = wire::from_wire(wire::to_wire(upright));
  ASSERT_TRUE(with_up);
  EXPECT_EQ(*with_up, upright);
  const auto up_of = [](double x, double y, double z) {
    return [=](v1::ViewFrustum& l) {
      l.mutable_up()->set_x(x);
      l.mutable_up()->set_y(y);
      l.mutable_up()->set_z(z);
    };
  };
  refused(up_of(0, 0, 0), "look.up");
  refused(up_of(0, 1.1, 0), "look.up");
  refused(up_of(0, std::numeric_limits<double>::infinity(), 0), "look.up");
  refused(up_of(std::numeric_limits<double>::quiet_NaN(), 1, 0), "look.up");
  const Vec3 sight = (look.target_mm - look.eye_mm).normalized();
  refused(up_of(sight.x(), sight.y(), sight.z()), "look.up");
  refused(up_of(-sight.x(), -sight.y(), -sight.z()), "look.up");
  refused(
      [&](v1::ViewFrustum& l) {
        *l.mutable_target_mm() = l.eye_mm();
        up_of(0, 1, 0)(l);
      },
      "look.up");
}

}  // namespace
}  // namespace osteon
