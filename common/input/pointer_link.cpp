#include "common/input/pointer_link.hpp"

#include <nlohmann/json.hpp>

#include "common/input/link_message.hpp"

namespace osteon {

namespace {

using nlohmann::json;

constexpr double kFarthest_mm = 1e5, kMostRpm = 2e5, kMostForce_n = 1e6;
constexpr LinkMessageNames kPointerMessage{"a pointer's", "the pointer", "osteon and osteon-haptic"};

json numbers(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }
json numbers(const Eigen::Quaterniond& q) { return json::array({q.w(), q.x(), q.y(), q.z()}); }
std::string text_of(const json& message) { return message.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

LocalLinkNames pointer_link_names() { return {"the pointer's socket", "a haptic client"}; }

std::string encode(const PointerInput& input) {
  json message{{"version", kLinkVersion},
               {"target_mm", numbers(input.target_mm)},
               {"rotation", numbers(input.rotation_bone_tool)},
               {"on_bone", input.on_bone},
               {"push", input.push},
               {"irrigation", input.irrigation},
               {"suction", input.suction},
               {"push_n", input.push_n},
               {"fine", input.fine},
               {"spindle", input.spindle},
               {"spindle_rpm", input.spindle_rpm},
               {"tool", shortened(input.tool)},
               {"empty_hand", input.empty_hand},
               {"law", shortened(input.law)},
               {"source", name_of(input.source)}};
  if (input.wear) message["wear"] = *input.wear;
  return text_of(message);
}

std::string encode(const PointerOutput& output) {
  json message{{"version", kLinkVersion},
               {"position_mm", numbers(output.pose_bone_tool.position_mm)},
               {"rotation", numbers(output.pose_bone_tool.rotation)},
               {"force_hand_n", numbers(output.force_hand_n)},
               {"force_bone_n", numbers(output.force_bone_n)},
               {"device_holds_n", output.device_holds_n},
               {"push_n", output.push_n},
               {"depth_mm", output.depth_mm},
               {"pushing", output.pushing},
               {"on_metal", output.on_metal},
               {"saturated", output.saturated},
               {"tool", shortened(output.tool)},
               {"law", shortened(output.law)},
               {"trouble", shortened(output.trouble)}};
  if (output.wear) message["wear"] = *output.wear;
  return text_of(message);
}

Result<PointerInput> read_pointer_input(std::string_view text) {
  Result<LinkMessage> fields = LinkMessage::read(text, kPointerMessage);
  if (!fields) return tl::unexpected(fields.error());
  PointerInput input;
  input.target_mm = fields->vector("target_mm", kFarthest_mm);
  input.rotation_bone_tool = fields->rotation("rotation");
  input.on_bone = fields->boolean("on_bone");
  input.push = fields->boolean("push");
  input.irrigation = fields->optional_boolean("irrigation");
  input.suction = fields->optional_boolean("suction");
  input.push_n = fields->number("push_n", kLeastPush_n, kMostPush_n);
  input.fine = fields->boolean("fine");
  input.spindle = fields->number("spindle", 0.0, 1.0);
  input.spindle_rpm = fields->number("spindle_rpm", 0.0, kMostRpm);
  input.tool = fields->text("tool");
  input.empty_hand = fields->optional_boolean("empty_hand");
  input.wear = fields->optional_number("wear", kSharp, kBluntest);
  input.law = fields->optional_text("law");
  input.source = static_cast<PointerSource>(fields->choice("source", kPointerSources));
  if (const Result<void> read = fields->outcome(); !read) return tl::unexpected(read.error());
  return input;
}

Result<PointerOutput> read_pointer_output(std::string_view text) {
  Result<LinkMessage> fields = LinkMessage::read(text, kPointerMessage);
  if (!fields) return tl::unexpected(fields.error());
  PointerOutput output;
  output.pose_bone_tool.position_mm = fields->vector("position_mm", kFarthest_mm);
  output.pose_bone_tool.rotation = fields->rotation("rotation");
  output.force_hand_n = fields->vector("force_hand_n", kMostForce_n);
  output.force_bone_n = fields->vector("force_bone_n", kMostForce_n);
  output.device_holds_n = fields->number("device_holds_n", 0.0, kMostForce_n);
  output.push_n = fields->number("push_n", 0.0, kMostForce_n);
  output.depth_mm = fields->number("depth_mm", -kFarthest_mm, kFarthest_mm);
  output.pushing = fields->boolean("pushing");
  output.on_metal = fields->boolean("on_metal");
  output.saturated = fields->boolean("saturated");
  output.tool = fields->text("tool");
  output.wear = fields->optional_number("wear", kSharp, kBluntest);
  output.law = fields->optional_text("law");
  output.trouble = fields->text("trouble");
  if (const Result<void> read = fields->outcome(); !read) return tl::unexpected(read.error());
  return output;
}

}  // namespace osteon
