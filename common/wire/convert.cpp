#include "common/wire/convert.hpp"

#include <algorithm>
#include <cmath>

#include "common/tools/tool_file.hpp"

namespace osteon::wire {
namespace {

constexpr double kMostOfATool =
    1e6;  // limits a tool's force in N, its speed in 1/min and so on: the steps of packets end there
bool all_of_a_tool(std::initializer_list<double> values) {
  return std::ranges::all_of(values, [](double v) { return std::abs(v) <= kMostOfATool; });  // also false for NaN
}

constexpr double kFurthest_mm = 1e5;  // no bone is farther away, and the steps of packets end there
// For the up direction of a picture: tolerance of its length, and sine of the smallest angle to the line of sight.
constexpr double kUnitWithin = 1e-3, kLeastAcross = 0.01;

bool is_up(const Vec3& up, const Vec3& sight) {
  return up.allFinite() && std::abs(up.norm() - 1.0) <= kUnitWithin &&
         up.cross(sight).norm() > kLeastAcross * sight.norm();
}

v1::CArmShot shot_to_wire(const CArmShot& shot) {
  v1::CArmShot out;
  out.set_number(shot.number);
  out.set_time_unix_ms(shot.time_unix_ms);
  out.set_mode(static_cast<v1::ShotMode>(static_cast<int>(shot.mode) + 1));  // 0 is none
  *out.mutable_isocentre_mm() = to_wire(shot.position.isocentre_mm);
  out.set_orbit_rad(shot.position.orbit_rad);
  out.set_tilt_rad(shot.position.tilt_rad);
  *out.mutable_translation_mm() = to_wire(shot.position.translation_mm);
  out.set_exposure_s(shot.exposure_s);
  out.set_air_kerma_at_metre_ugy(shot.air_kerma_at_metre_ugy);
  out.set_dose_area_gy_cm2(shot.dose_area_gy_cm2);
  out.set_seed(shot.seed);
  return out;
}

// All but the limits of its numbers is checked.
Result<CArmShot> shot_from_wire(const v1::CArmShot& shot) {
  if (shot.mode() < v1::SHOT_MODE_SINGLE || shot.mode() > v1::SHOT_MODE_LIVE)
    return bad_field("shot.mode", "must be single, pulse or live");
  CArmShot out;
  out.number = shot.number();
  out.time_unix_ms = shot.time_unix_ms();
  out.mode = static_cast<ShotMode>(shot.mode() - 1);
  out.position.isocentre_mm = from_wire(shot.isocentre_mm());
  out.position.orbit_rad = shot.orbit_rad();
  out.position.tilt_rad = shot.tilt_rad();
  out.position.translation_mm = from_wire(shot.translation_mm());
  out.exposure_s = shot.exposure_s();
  out.air_kerma_at_metre_ugy = shot.air_kerma_at_metre_ugy();
  out.dose_area_gy_cm2 = shot.dose_area_gy_cm2();
  out.seed = shot.seed();
  return out;
}

}  // namespace

v1::Vector3 to_wire(const Vec3& v) {
  v1::Vector3 out;
  out.set_x(v.x());
  out.set_y(v.y());
  out.set_z(v.z());
  return out;
}

Vec3 from_wire(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

v1::Pose to_wire(const Pose& pose) {
  v1::Pose out;
  *out.mutable_position_mm() = to_wire(pose.position_mm);
  for (const double q : {pose.rotation.x(), pose.rotation.y(), pose.rotation.z(), pose.rotation.w()})
    out.add_rotation(static_cast<float>(q));
  return out;
}

v1::Coord to_wire(const Coord& c) {
  v1::Coord out;
  out.set_x(c.x);
  out.set_y(c.y);
  out.set_z(c.z);
  return out;
}

Coord from_wire(const v1::Coord& c) { return {c.x(), c.y(), c.z()}; }

std::string to_wire(const Digest& digest) {
  return {reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size()};
}

// Both enums have the same reasons under the same numbers.
static_assert(v1::RejectionReason_ARRAYSIZE == kRejections);
constexpr bool same(Rejection reason, v1::RejectionReason sent) { return static_cast<int>(reason) == sent; }
static_assert(same(Rejection::none, v1::REJECTION_REASON_UNSPECIFIED));
static_assert(same(Rejection::body, v1::REJECTION_REASON_BODY));
static_assert(same(Rejection::lease, v1::REJECTION_REASON_LEASE));
static_assert(same(Rejection::tool, v1::REJECTION_REASON_TOOL));
static_assert(same(Rejection::level, v1::REJECTION_REASON_LEVEL));
static_assert(same(Rejection::path, v1::REJECTION_REASON_PATH));
static_assert(same(Rejection::rotation, v1::REJECTION_REASON_ROTATION));
static_assert(same(Rejection::place, v1::REJECTION_REASON_PLACE));
static_assert(same(Rejection::sweep, v1::REJECTION_REASON_SWEEP));
static_assert(same(Rejection::spindle, v1::REJECTION_REASON_SPINDLE));
static_assert(same(Rejection::time, v1::REJECTION_REASON_TIME));
static_assert(same(Rejection::rate, v1::REJECTION_REASON_RATE));
static_assert(same(Rejection::power, v1::REJECTION_REASON_POWER));
static_assert(same(Rejection::frozen, v1::REJECTION_REASON_FROZEN));
static_assert(same(Rejection::taken, v1::REJECTION_REASON_TAKEN));
static_assert(same(Rejection::forbidden_tool, v1::REJECTION_REASON_FORBIDDEN_TOOL));
static_assert(same(Rejection::zone, v1::REJECTION_REASON_ZONE));
static_assert(same(Rejection::metal, v1::REJECTION_REASON_METAL));

v1::RejectionReason to_wire(Rejection reason) { return static_cast<v1::RejectionReason>(reason); }

Rejection from_wire(v1::RejectionReason reason) { return rejection_of(static_cast<std::uint32_t>(reason)); }

v1::Cut to_wire(const Cut& cut) {
  v1::Cut out;
  out.set_author(cut.author.value);
  out.set_author_seq(cut.author_seq);
  out.set_lease_epoch(cut.lease_epoch);
  out.set_body(cut.body.value);
  out.set_tool_hash(to_wire(cut.tool));
  out.set_level(static_cast<std::uint32_t>(cut.level));
  for (const QuantisedPose& pose : cut.path) {
    v1::QuantisedPose* knot = out.add_path();
    for (const std::int32_t p : pose.position) knot->add_position(p);
    for (const std::int16_t r : pose.rotation) knot->add_rotation(r);
  }
  out.set_spindle_rpm(cut.spindle_rpm);
  out.set_path_us(cut.path_us);
  return out;
}

v1::CuttingState to_wire(const CuttingState& state) {
  v1::CuttingState out;
  out.set_author(state.author.value);
  out.set_state_seq(state.state_seq);
  *out.mutable_pose_bone_tool() = to_wire(state.pose_bone_tool);
  *out.mutable_pose_bone_device() = to_wire(state.pose_bone_device);
  out.set_tool_name(state.tool_name);
  out.set_spindle_rpm(state.spindle_rpm);
  out.set_feed_mm_per_s(state.feed_mm_per_s);
  out.set_density_g_cm3(state.density_g_cm3);
  out.set_engaged_fraction(state.engaged_fraction);
  *out.mutable_force_physical_n() = to_wire(state.force_physical_N);
  out.set_torque_n_mm(state.torque_Nmm);
  out.set_depth_mm(state.depth_mm);
  out.set_phase(static_cast<v1::CuttingPhase>(state.phase));
  out.set_on_metal(state.on_metal);
  out.set_force_hand_n(state.force_hand_N);
  out.set_device_holds_n(state.device_holds_N);
  out.set_irrigation(state.irrigation);
  out.set_suction(state.suction);
  out.set_flutes_full(state.flutes_full);
  out.set_time_ns(state.time_ns);
  out.set_cortex_mm(state.cortex_mm);
  out.set_seated(state.seated);
  out.set_blows(state.blows);
  out.set_blow_impulse_n_s(state.blow_impulse_N_s);
  return out;
}

v1::FieldLeaf to_wire(const FieldLeaf& leaf) {
  v1::FieldLeaf out;
  out.set_body(leaf.body.value);
  out.set_level(static_cast<std::uint32_t>(leaf.level));
  *out.mutable_origin() = to_wire(leaf.origin);
  std::string* bytes = out.mutable_values();
  // Most leaves of a fragment's field are wholly cut away.
  const bool constant = std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == leaf.values.front(); });
  bytes->resize(2 * (constant ? 1 : leaf.values.size()));
  for (std::size_t i = 0; 2 * i < bytes->size(); ++i) {
    const auto value = static_cast<std::uint16_t>(leaf.values[i]);
    (*bytes)[2 * i] = static_cast<char>(value & 255);
    (*bytes)[2 * i + 1] = static_cast<char>(value >> 8);
  }
  return out;
}

Result<Pose> from_wire(const v1::Pose& pose) {
  if (pose.rotation_size() != 4)
    return bad_field("rotation", "needs 4 entries, this has " + std::to_string(pose.rotation_size()));
  const Vec3 position = from_wire(pose.position_mm());
  const Eigen::Quaterniond rotation(pose.rotation(3), pose.rotation(0), pose.rotation(1), pose.rotation(2));
  if (!position.allFinite()) return bad_field("position_mm", "is not finite");
  if (!(std::abs(rotation.norm() - 1.0) < 1e-3)) return bad_field("rotation", "is not a unit quaternion");
  return Pose{position, rotation.normalized()};
}

Result<Digest> digest_from_wire(const std::string& bytes) {
  Digest digest;
  if (bytes.size() != digest.bytes.size())
    return bad_field("hash", "needs 32 bytes, this has " + std::to_string(bytes.size()));
  std::ranges::transform(bytes, digest.bytes.begin(), [](char c) { return static_cast<std::uint8_t>(c); });
  return digest;
}

Result<Cut> from_wire(const v1::Cut& cut) {
  Cut out;
  out.author = {cut.author()};
  out.author_seq = cut.author_seq();
  out.lease_epoch = cut.lease_epoch();
  out.body = {cut.body()};
  const auto tool = digest_from_wire(cut.tool_hash());
  if (!tool) return bad_field("tool_hash:", tool.error().message);
  out.tool = *tool;
  if (cut.level() >= static_cast<std::uint32_t>(kLevels)) return bad_field("level", "must be 0, 1 or 2");
  out.level = static_cast<int>(cut.level());
  if (cut.path().empty()) return bad_field("path", "needs at least one pose");
  for (const v1::QuantisedPose& knot : cut.path()) {
    if (knot.position_size() != 3 || knot.rotation_size() != 4)
      return bad_field("path", "has a pose without 3 positions and 4 rotations");
    QuantisedPose pose;
    double norm = 0.0;
    for (int i = 0; i < 3; ++i) pose.position[static_cast<std::size_t>(i)] = knot.position(i);
    for (int i = 0; i < 4; ++i) {
      if (std::abs(knot.rotation(i)) > 32767) return bad_field("path", "has a rotation beyond 32767");
      pose.rotation[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(knot.rotation(i));
      norm += static_cast<double>(knot.rotation(i)) * knot.rotation(i);
    }
    if (std::abs(std::sqrt(norm) / 32767.0 - 1.0) > 1e-3)
      return bad_field("path", "has a rotation that is not a unit quaternion");
    out.path.push_back(pose);
  }
  out.spindle_rpm = cut.spindle_rpm();
  out.path_us = cut.path_us();
  return out;
}

Result<CuttingState> from_wire(const v1::CuttingState& state) {
  CuttingState out;
  out.author = {state.author()};
  out.state_seq = state.state_seq();
  const auto tool = from_wire(state.pose_bone_tool());
  if (!tool) return failure(ErrorCode::invalid_input, "pose_bone_tool." + tool.error().message);
  const auto device = from_wire(state.pose_bone_device());
  if (!device) return failure(ErrorCode::invalid_input, "pose_bone_device." + device.error().message);
  if (tool->position_mm.norm() > kFurthest_mm) return bad_field("pose_bone_tool", "is not near the bone");
  if (device->position_mm.norm() > kFurthest_mm) return bad_field("pose_bone_device", "is not near the bone");
  out.pose_bone_tool = *tool;
  out.pose_bone_device = *device;
  out.tool_name = state.tool_name();
  out.force_physical_N = from_wire(state.force_physical_n());
  if (!all_of_a_tool({state.spindle_rpm(), state.feed_mm_per_s(), state.density_g_cm3(), state.engaged_fraction(),
                      state.torque_n_mm(), state.depth_mm(), state.flutes_full(), out.force_physical_N.norm(),
                      state.force_hand_n(), state.device_holds_n(), state.cortex_mm(), state.seated(),
                      state.blow_impulse_n_s()}))
    return bad_field("cutting state", "has a number that is not finite or too large for a tool");
  out.spindle_rpm = state.spindle_rpm();
  out.feed_mm_per_s = state.feed_mm_per_s();
  out.density_g_cm3 = state.density_g_cm3();
  out.engaged_fraction = state.engaged_fraction();
  out.torque_Nmm = state.torque_n_mm();
  out.depth_mm = state.depth_mm();
  if (state.phase() < v1::CUTTING_PHASE_IDLE || state.phase() > v1::CUTTING_PHASE_RUBBING)
    return bad_field("phase", "is not one that this program knows");
  out.phase = static_cast<CuttingPhase>(state.phase());
  out.on_metal = state.on_metal();
  out.force_hand_N = state.force_hand_n();
  out.device_holds_N = state.device_holds_n();
  out.irrigation = state.irrigation();
  out.suction = state.suction();
  out.flutes_full = state.flutes_full();
  if (state.time_ns() < 0 || state.time_ns() > kLatestState_ns) return bad_field("time_ns", "is not of a clock");
  out.time_ns = state.time_ns();
  out.cortex_mm = state.cortex_mm();
  out.seated = state.seated();
  out.blows = state.blows();
  out.blow_impulse_N_s = state.blow_impulse_n_s();
  return out;
}

Result<FieldLeaf> from_wire(const v1::FieldLeaf& leaf) {
  FieldLeaf out;
  out.body = {leaf.body()};
  if (leaf.level() >= static_cast<std::uint32_t>(kLevels)) return bad_field("level", "must be 0, 1 or 2");
  out.level = static_cast<int>(leaf.level());
  out.origin = from_wire(leaf.origin());
  if (floor_to(out.origin, kLeafSize) != out.origin) return bad_field("origin", "is not the first sample of a leaf");
  const std::size_t size = leaf.values().size();
  if (size != 2 && size != std::size_t{2} * kLeafVoxels)
    return bad_field("values", "needs 1024 bytes or 2, this has " + std::to_string(size));
  const auto value = [&](std::size_t i) {
    const auto low = static_cast<std::uint8_t>(leaf.values()[2 * i]),
               high = static_cast<std::uint8_t>(leaf.values()[2 * i + 1]);
    return static_cast<std::int16_t>(low | high << 8);
  };
  out.values.resize(size / 2);
  for (std::size_t i = 0; i < out.values.size(); ++i) out.values[i] = value(i);
  return out;
}

v1::SceneItem to_wire(const SceneItem& item) {
  v1::SceneItem out;
  out.set_item(item.id);
  out.set_body(item.body.value);
  out.set_tool_hash(to_wire(item.tool));
  *out.mutable_pose_bone_item() = to_wire(item.pose_bone_item);
  out.set_turns(item.turns);
  out.set_seated(item.seated);
  out.set_set_at(item.set_at);
  return out;
}

Result<SceneItem> from_wire(const v1::SceneItem& item) {
  SceneItem out;
  out.id = item.item();
  out.body = {item.body()};
  const auto tool = digest_from_wire(item.tool_hash());
  if (!tool) return bad_field("item.tool_hash:", tool.error().message);
  out.tool = *tool;
  const auto pose = from_wire(item.pose_bone_item());
  if (!pose) return failure(ErrorCode::invalid_input, "item.pose_bone_item." + pose.error().message);
  out.pose_bone_item = *pose;
  if (!std::isfinite(item.turns())) return bad_field("item.turns", "is not finite");
  out.turns = item.turns();
  out.seated = item.seated();
  out.set_at = item.set_at();
  return out;
}

Result<Placing> placing_from_wire(const v1::SetSceneItemRequest& request) {
  switch (request.placing_case()) {
    case v1::SetSceneItemRequest::kOntoBone: {
      const v1::OntoBone& given = request.onto_bone();
      OntoBone onto;
      onto.near_mm = from_wire(given.near_mm());
      if (given.has_axis()) onto.axis = from_wire(given.axis());
      if (given.has_across()) onto.across = from_wire(given.across());
      if (!onto.near_mm.allFinite()) return bad_field("onto_bone.near_mm", "is not finite");
      if (onto.axis && !(onto.axis->allFinite() && onto.axis->norm() > 1e-9))
        return bad_field("onto_bone.axis", "has no direction");
      if (!(onto.across.allFinite() && onto.across.norm() > 1e-9))
        return bad_field("onto_bone.across", "has no direction");
      return Placing(onto);
    }
    case v1::SetSceneItemRequest::kThreadTurns:
      if (!std::isfinite(request.thread_turns())) return bad_field("thread_turns", "is not finite");
      return Placing(ByThread{request.thread_turns()});
    case v1::SetSceneItemRequest::kDriveHomeMm:
      if (!std::isfinite(request.drive_home_mm())) return bad_field("drive_home_mm", "is not finite");
      return Placing(DriveHome{request.drive_home_mm()});
    case v1::SetSceneItemRequest::PLACING_NOT_SET:
      break;
  }
  return Placing{};
}

v1::ViewFrustum to_wire(const ViewFrustum& look) {
  v1::ViewFrustum out;
  *out.mutable_eye_mm() = to_wire(look.eye_mm);
  *out.mutable_target_mm() = to_wire(look.target_mm);
  out.set_pixel_rad(look.pixel_rad);
  out.set_view_rad(look.view_rad);
  if (look.up) *out.mutable_up() = to_wire(*look.up);
  return out;
}

Result<BlockKey> key_from_wire(const v1::MeshBlock& block) {
  if (block.level() < kCoarsestLevel || block.level() >= kLevels)
    return bad_field("mesh block: level", "must be -2 to 2");
  return BlockKey{BodyId{block.body()}, block.level(), from_wire(block.index())};
}

Result<ViewFrustum> from_wire(const v1::ViewFrustum& look) {
  ViewFrustum out{from_wire(look.eye_mm()), from_wire(look.target_mm()), look.pixel_rad(), look.view_rad()};
  const auto placed = [](const Vec3& at) { return at.allFinite() && at.norm() <= kFurthest_mm; };
  if (!placed(out.eye_mm)) return bad_field("look.eye_mm", "is not near the bone");
  if (!placed(out.target_mm)) return bad_field("look.target_mm", "is not near the bone");
  if (!(out.pixel_rad > 0.0 && out.pixel_rad < 1.0)) return bad_field("look.pixel_rad", "must be between 0 and 1");
  if (!(out.view_rad > 0.0 && out.view_rad < 1.5)) return bad_field("look.view_rad", "must be between 0 and 1.5");
  if (!look.has_up()) return out;
  const Vec3 up = from_wire(look.up());
  if (!is_up(up, out.target_mm - out.eye_mm)) return bad_field("look.up", "is no unit vector across the line of sight");
  out.up = up.normalized();
  return out;
}

v1::ToolDefinition to_wire(const Tool& tool) {
  v1::ToolDefinition out;
  out.set_tool_hash(to_wire(tool.hash()));
  out.set_yaml(to_yaml(tool));
  return out;
}

Result<Tool> from_wire(const v1::ToolDefinition& tool) {
  Result<Tool> parsed = parse_tool(tool.yaml(), "the tool definition");
  if (!parsed) return bad_field("tool.yaml:", parsed.error().message);
  if (!tool.tool_hash().empty() && tool.tool_hash() != to_wire(parsed->hash()))
    return bad_field("tool.tool_hash", "is not that of the definition");
  return parsed;
}

v1::Restrictions to_wire(const Restrictions& supervision) {
  v1::Restrictions out;
  out.set_stopped(supervision.stopped);
  out.set_taken_by(supervision.taken_by.value);
  out.set_guide(supervision.guide.value);
  out.set_guide_share(static_cast<std::uint32_t>(supervision.guide_share));
  out.set_force_limit(static_cast<std::uint32_t>(supervision.force_limit));
  if (supervision.zone) {
    for (const std::int32_t steps : supervision.zone->centre) out.mutable_zone()->add_centre(steps);
    out.mutable_zone()->set_radius(supervision.zone->radius);
  }
  for (const Digest& tool : supervision.tools) out.add_tools(to_wire(tool));
  out.set_words(supervision.words);
  return out;
}

Result<Restrictions> from_wire(const v1::Restrictions& supervision) {
  Restrictions out;
  out.stopped = supervision.stopped();
  out.taken_by = {supervision.taken_by()};
  out.guide = {supervision.guide()};
  // A value beyond 31 bits exceeds every limit, too.
  out.guide_share = static_cast<int>(std::min<std::uint32_t>(supervision.guide_share(), INT32_MAX));
  out.force_limit = static_cast<int>(std::min<std::uint32_t>(supervision.force_limit(), INT32_MAX));
  if (supervision.has_zone()) {
    const v1::ZoneLimit& zone = supervision.zone();
    if (zone.centre_size() != 3)
      return bad_field("supervision.zone.centre", "needs 3 numbers, this has " + std::to_string(zone.centre_size()));
    out.zone = ZoneLimit{{zone.centre(0), zone.centre(1), zone.centre(2)}, zone.radius()};
  }
  for (const std::string& hash : supervision.tools()) {
    const auto tool = digest_from_wire(hash);
    if (!tool) return bad_field("supervision.tools:", tool.error().message);
    out.tools.push_back(*tool);
  }
  std::ranges::sort(out.tools);
  out.tools.erase(std::unique(out.tools.begin(), out.tools.end()), out.tools.end());
  out.words = supervision.words();
  if (const Result<void> sound = check(out); !sound) return tl::unexpected(sound.error());
  return out;
}

v1::Annotation to_wire(const Annotation& annotation) {
  v1::Annotation out;
  out.set_annotation(annotation.id);
  out.set_author(annotation.author.value);
  out.set_kind(static_cast<v1::AnnotationKind>(annotation.kind));
  for (const auto& point : annotation.points)
    for (const std::int32_t steps : point) out.add_points(steps);
  out.set_words(annotation.words);
  out.set_colour(annotation.colour);
  return out;
}

Result<Annotation> from_wire(const v1::Annotation& annotation) {
  Annotation out;
  out.id = annotation.annotation();
  out.author = {annotation.author()};
  if (annotation.kind() < v1::ANNOTATION_KIND_POINTER || annotation.kind() > v1::ANNOTATION_KIND_PLANE)
    return bad_field("drawn.kind", "must be pointer, line, label, axis or plane");
  out.kind = static_cast<AnnotationKind>(annotation.kind());
  if (annotation.points_size() % 3 != 0)
    return bad_field("drawn.points",
                     "needs 3 numbers for each point, this has " + std::to_string(annotation.points_size()));
  for (int i = 0; i < annotation.points_size(); i += 3)
    out.points.push_back({annotation.points(i), annotation.points(i + 1), annotation.points(i + 2)});
  out.words = annotation.words();
  out.colour = annotation.colour();
  if (const Result<void> sound = check(out); !sound) return tl::unexpected(sound.error());
  return out;
}

v1::ShotRun to_wire(const ShotRun& run) {
  v1::ShotRun out;
  out.set_author(run.author.value);
  out.set_first_number(run.first_number);
  out.set_exposure_s(run.exposure_s);
  *out.mutable_last() = shot_to_wire(run.last);
  return out;
}

Result<ShotRun> from_wire(const v1::ShotRun& run) {
  const Result<CArmShot> last = shot_from_wire(run.last());
  if (!last) return tl::unexpected(last.error());
  ShotRun out{AuthorId{run.author()}, run.first_number(), run.exposure_s(), *last};
  if (const Result<void> sound = check(out); !sound) return tl::unexpected(sound.error());
  return out;
}

v1::ShotTotals to_wire(const ShotTotals& totals) {
  v1::ShotTotals out;
  out.set_shots(totals.shots);
  out.set_exposure_s(totals.exposure_s);
  out.set_dose_area_gy_cm2(totals.dose_area_gy_cm2);
  return out;
}

Result<ShotTotals> from_wire(const v1::ShotTotals& totals) {
  const ShotTotals out{totals.shots(), totals.exposure_s(), totals.dose_area_gy_cm2()};
  if (const Result<void> sound = check(out); !sound) return tl::unexpected(sound.error());
  return out;
}

}  // namespace osteon::wire
