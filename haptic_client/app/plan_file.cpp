#include "haptic_client/app/plan_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/runtime/files.hpp"

namespace osteon::haptic {
namespace {

using nlohmann::json;

// Thrown and caught within this file only: the message for a wrong field.
struct Wrong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double number(const json& object, const char* field, double otherwise, double low, double high) {
  if (!object.contains(field)) return otherwise;
  const json& value = object.at(field);
  if (!value.is_number() || !(value.get<double>() >= low && value.get<double>() <= high))
    throw Wrong(std::string("\"") + field + "\" must be a number from " + json(low).dump() + " to " +
                json(high).dump());
  return value.get<double>();
}

constexpr double kFarthest = 1e5;  // mm; no bone is so far away, and larger numbers make messages unreadable

template <std::size_t N>
std::array<double, N> numbers(const json& object, const char* field) {
  const json& value = object.at(field);
  std::array<double, N> result{};
  bool right = value.is_array() && value.size() == N;
  for (std::size_t i = 0; right && i < N; ++i) {
    right = value[i].is_number() && std::abs(value[i].get<double>()) <= kFarthest;
    if (right) result[i] = value[i].get<double>();
  }
  if (!right)
    throw Wrong(std::string("\"") + field + "\" must be a list of " + std::to_string(N) +
                " numbers from -100000 to 100000");
  return result;
}

Vec3 vector(const json& object, const char* field) {
  const auto v = numbers<3>(object, field);
  return {v[0], v[1], v[2]};
}

std::string text(const json& object, const char* field, const char* otherwise) {
  if (!object.contains(field)) return otherwise;
  if (!object.at(field).is_string()) throw Wrong(std::string("\"") + field + "\" must be a text");
  return object.at(field).get<std::string>();
}

bool flag(const json& object, const char* field) {
  if (!object.contains(field)) return false;
  if (!object.at(field).is_boolean()) throw Wrong(std::string("\"") + field + "\" must be true or false");
  return object.at(field).get<bool>();
}

void only(const json& object, const std::set<std::string>& known) {
  for (const auto& [key, value] : object.items())
    if (!known.contains(key)) {
      std::string names;
      for (const std::string& name : known) names.append(names.empty() ? "" : ", ").append(name);
      throw Wrong("\"" + key + "\" is not known here; choose from " + names);
    }
}

PlanEntry read_entry(const json& step) {
  if (!step.contains("entry") || !step.at("entry").is_object())
    throw Wrong(
        "\"entry\" is missing; give {\"toward\": [x, y, z]}, or {\"point_mm\": [x, y, z]} with \"axis\" or "
        "\"target_mm\"");
  const json& entry = step.at("entry");
  only(entry, {"toward", "point_mm", "axis", "target_mm", "beside_last_mm"});
  PlanEntry result;
  if (entry.contains("toward")) result.toward = vector(entry, "toward");
  if (entry.contains("point_mm") != (entry.contains("axis") != entry.contains("target_mm")) ||
      (entry.contains("axis") && entry.contains("target_mm")))
    throw Wrong("\"entry\" needs \"point_mm\" together with either \"axis\" or \"target_mm\"");
  if (entry.contains("point_mm")) result.point_mm = vector(entry, "point_mm");
  if (entry.contains("axis")) result.axis = vector(entry, "axis");
  if (entry.contains("target_mm")) {
    result.target_mm = vector(entry, "target_mm");
    result.axis = *result.target_mm - *result.point_mm;
  }
  if (entry.contains("beside_last_mm")) result.beside_last_mm = numbers<2>(entry, "beside_last_mm");
  if (result.toward.has_value() + result.point_mm.has_value() + result.beside_last_mm.has_value() != 1)
    throw Wrong(
        "\"entry\" needs exactly one of \"toward\", \"point_mm\" with \"axis\" or \"target_mm\", and "
        "\"beside_last_mm\"");
  return result;
}

// The force law; empty if none is named. A tool that is not in the tool box may be the room's own. Then only the room
// can say whether it exists and which laws suit it.
std::string read_law(const json& object, const std::string& tool) {
  std::string law = text(object, "law", "");
  if (const Result<void> well = check_law(tool, law); !well) throw Wrong("\"law\": " + well.error().message);
  return law;
}

PlanStep read_step(const json& object) {
  if (!object.is_object()) throw Wrong("it must be an object with an \"action\"");
  PlanStep step;
  const std::string action = text(object, "action", "");
  if (action == "wait") {
    only(object, {"action", "seconds"});
    step.action = Action::wait;
    step.seconds = number(object, "seconds", 0.0, 0.0, 3600.0);
    return step;
  }
  if (action == "place") {
    only(object, {"action", "tool", "entry", "seconds"});
    step.action = Action::place;
    step.tool = text(object, "tool", "guide-1");
    step.seconds = number(object, "seconds", 0.5, 0.0, 3600.0);
    step.entry = read_entry(object);
    return step;
  }
  if (action == "screw") {
    only(object, {"action", "tool", "spindle_rpm", "entry", "tremor_mm", "wear", "law"});
    step.action = Action::screw;
    step.tool = text(object, "tool", "screw-1");
    step.spindle_rpm = number(object, "spindle_rpm", 0.0, 50.0, 600.0);
    step.tremor_mm = number(object, "tremor_mm", 0.0, 0.0, 5.0);
    step.wear = number(object, "wear", step.wear, 1.0, 5.0);
    step.law = read_law(object, step.tool);
    step.entry = read_entry(object);
    return step;
  }
  if (action != "drill" && action != "burr")
    throw Wrong("\"action\" is \"" + action + "\"; choose \"drill\", \"burr\", \"screw\", \"place\" or \"wait\"");
  const bool drill = action == "drill";
  only(object, {"action",
                "tool",
                "spindle_rpm",
                "hand",
                "feed_mm_per_s",
                "push_n",
                "entry",
                "beyond_mm",
                "window_mm",
                "depth_mm",
                "sweep_mm_per_s",
                "wear",
                "law",
                "guide",
                "tremor_mm",
                "to_mm",
                "leave",
                "hand_stiffness_n_per_mm",
                "hand_damping_n_s_per_mm",
                "hand_across_n_per_mm",
                "irrigation",
                "suction"});
  step.action = drill ? Action::drill : Action::burr;
  step.tool = text(object, "tool", drill ? "drill-3.2" : "burr-round-5");
  const std::string hand = text(object, "hand", "expert");
  if (hand == "expert")
    step.hand = HandKind::expert;
  else if (hand == "novice")
    step.hand = HandKind::novice;
  else if (hand == "rig")
    step.hand = HandKind::rig;
  else
    throw Wrong("\"hand\" is \"" + hand + "\"; choose \"expert\", \"novice\" or \"rig\"");
  step.spindle_rpm = number(object, "spindle_rpm", 0.0, 100.0, 100000.0);
  step.feed_mm_per_s = number(object, "feed_mm_per_s", step.feed_mm_per_s, 0.01, 20.0);
  step.push_n = number(object, "push_n", step.push_n, 1.0, 200.0);
  step.hand_stiffness_n_per_mm = number(object, "hand_stiffness_n_per_mm", 0.0, 0.1, 50.0);
  step.hand_damping_n_s_per_mm = number(object, "hand_damping_n_s_per_mm", 0.0, 0.001, 5.0);
  step.hand_across_n_per_mm = number(object, "hand_across_n_per_mm", 0.0, 0.1, 50.0);
  step.beyond_mm = number(object, "beyond_mm", step.beyond_mm, 0.0, 40.0);
  step.to_mm = number(object, "to_mm", step.to_mm, 0.1, 200.0);
  step.depth_mm = number(object, "depth_mm", step.depth_mm, 0.1, 20.0);
  step.sweep_mm_per_s = number(object, "sweep_mm_per_s", step.sweep_mm_per_s, 0.5, 60.0);
  step.wear = number(object, "wear", step.wear, 1.0, 5.0);
  step.law = read_law(object, step.tool);
  if (object.contains("window_mm")) {
    const auto window = numbers<2>(object, "window_mm");
    if (!(window[0] > 0.0 && window[1] > 0.0 && window[0] <= 100.0 && window[1] <= 100.0))
      throw Wrong("\"window_mm\" must be two lengths from 0 to 100");
    step.window_u_mm = window[0];
    step.window_v_mm = window[1];
  }
  step.tremor_mm = number(object, "tremor_mm", 0.0, 0.0, 5.0);
  step.irrigation = flag(object, "irrigation");
  step.suction = flag(object, "suction");
  if (object.contains("guide")) {
    if (!object.at("guide").is_boolean() || !drill)
      throw Wrong("\"guide\" must be true or false, and belongs to a drill");
    step.through_guide = object.at("guide").get<bool>();
  }
  if (object.contains("leave")) {
    if (!object.at("leave").is_boolean() || !drill || !object.contains("to_mm"))
      throw Wrong("\"leave\" must be true or false, and belongs to a drill with a pin and \"to_mm\"");
    step.leave = object.at("leave").get<bool>();
  }
  if (step.through_guide && object.contains("entry"))
    throw Wrong("\"entry\" and \"guide\" exclude each other: the guide says where");
  if (!step.through_guide) step.entry = read_entry(object);
  return step;
}

}  // namespace

Result<void> check_law(const std::string& tool, const std::string& law) {
  if (const Result<Tool> known = find_tool(tool)) {
    if (const auto chosen = choose_law(*known, law); !chosen) return tl::unexpected(chosen.error());
  } else if (!law.empty() && !find_force_law(law)) {
    return failure(ErrorCode::invalid_input, "there is no force law \"" + law + "\"; osteon-haptic laws lists them");
  }
  return {};
}

Result<std::vector<PlanStep>> read_plan(const std::filesystem::path& file) {
  const Result<std::string> content = read_file(file);
  if (!content) return failure(content.error().code, "--plan: " + content.error().message);
  const json plan = json::parse(*content, nullptr, false);
  const std::string name = "the plan " + file.string();
  if (plan.is_discarded())
    return failure(ErrorCode::invalid_input, name + " is not JSON; see the plans that deploy/demo writes");
  if (!plan.is_object() || !plan.contains("steps") || !plan.at("steps").is_array() || plan.at("steps").empty())
    return failure(ErrorCode::invalid_input, name + " needs \"steps\", a list with at least one step");
  std::vector<PlanStep> steps;
  for (const json& object : plan.at("steps")) {
    try {
      steps.push_back(read_step(object));
    } catch (const std::exception& wrong) {
      return failure(ErrorCode::invalid_input,
                     name + ", step " + std::to_string(steps.size() + 1) + ": " + wrong.what());
    }
  }
  return steps;
}

}  // namespace osteon::haptic
