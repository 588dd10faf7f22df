#include "common/tools/tool_rules.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

// A wall or an end cannot be thinner than this, mm.
constexpr double kThinnest_mm = 0.2;

constexpr std::array<KindName, 19> kKinds{{
    {ToolKind::drill, "drill"},
    {ToolKind::round_burr, "round-burr"},
    {ToolKind::end_drill, "end-drill"},
    {ToolKind::barrel_burr, "barrel-burr"},
    {ToolKind::contoured_burr, "contoured-burr"},
    {ToolKind::oscillating_saw, "oscillating-saw"},
    {ToolKind::reciprocating_saw, "reciprocating-saw"},
    {ToolKind::sphere_reamer, "sphere-reamer"},
    {ToolKind::cylinder_reamer, "cylinder-reamer"},
    {ToolKind::outside_reamer, "outside-reamer"},
    {ToolKind::broach, "broach"},
    {ToolKind::drill_sleeve, "drill-sleeve"},
    {ToolKind::distal_block, "distal-block"},
    {ToolKind::four_in_one_block, "four-in-one-block"},
    {ToolKind::pin, "pin"},
    {ToolKind::screw, "screw"},
    {ToolKind::trial_cup, "trial-cup"},
    {ToolKind::trial_stem, "trial-stem"},
    {ToolKind::mesh, "mesh"},
}};

enum class Need { required, optional };
enum class Edit { no, yes };

FieldRule length(std::string_view name, double Tool::*member, double lowest, double highest, Edit edit = Edit::no,
                 Need need = Need::required) {
  return {name, member, nullptr, lowest, highest, need == Need::required, edit == Edit::yes};
}
FieldRule angle(std::string_view name, double Tool::*member, double lowest_deg, double highest_deg) {
  return {name, member, nullptr, lowest_deg * kRadPerDegree, highest_deg * kRadPerDegree, true, false};
}

FieldRule diameter(double lowest, double highest) {
  return length("diameter_mm", &Tool::diameter_mm, lowest, highest, Edit::yes);
}
FieldRule cutting_length(double lowest, double highest) {
  return length("cutting_length_mm", &Tool::cutting_length_mm, lowest, highest, Edit::yes);
}

void add_shank(std::vector<FieldRule>& rules, double widest) {
  rules.push_back(length("shank_diameter_mm", &Tool::shank_diameter_mm, 0.3, widest));
  rules.push_back(length("shank_length_mm", &Tool::shank_length_mm, 0.0, 500.0));
}

void add_drive(std::vector<FieldRule>& rules, double slowest, double fastest, int most_teeth) {
  rules.push_back(length("spindle_rpm", &Tool::spindle_rpm, slowest, fastest, Edit::yes));
  rules.push_back({"teeth", nullptr, &Tool::teeth, 1, static_cast<double>(most_teeth), true, true});
  rules.push_back(length("feed_mm_per_rev", &Tool::feed_mm_per_rev, 0.0, 5.0, Edit::yes));
}

std::string written(double value) {
  // A value in degrees must not show the rounding of radians.
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6).ptr;
  return {text.data(), end};
}

bool is_angle(const FieldRule& rule) { return rule.name.ends_with("_rad"); }
std::string shown_name(const FieldRule& rule) {
  return is_angle(rule) ? std::string(rule.name.substr(0, rule.name.size() - 3)) + "deg" : std::string(rule.name);
}

bool good_name(const std::string& name) {
  return !name.empty() && name.size() <= 64 && name.front() != '-' && name.front() != '.' &&
         std::ranges::all_of(
             name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.'; });
}

// UTF-8 without control characters. Other text can be neither written to a tool file nor sent.
bool is_plain_text(std::string_view text) {
  while (!text.empty()) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const std::size_t size = byte(0) < 0x80 ? 1 : byte(0) < 0xe0 ? 2 : byte(0) < 0xf0 ? 3 : 4;
    if (size > text.size() || byte(0) < 0x20 || byte(0) == 0x7f || byte(0) > 0xf4 || (size > 1 && byte(0) < 0xc2))
      return false;
    char32_t code = size == 1 ? byte(0) : byte(0) & (0x7fu >> size);
    for (std::size_t i = 1; i < size; ++i) {
      if ((byte(i) & 0xc0) != 0x80) return false;
      code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr char32_t kLeast[] = {0, 0, 0xa0, 0x800, 0x10000};  // by size; 0x80 to 0x9f are controls
    if (code < kLeast[size] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string at_most(const char* field, double value, const std::string& what, double limit) {
  return std::string("\"") + field + "\" is " + written(value) + " mm, wider than " + what + " of " + written(limit) +
         " mm; make it narrower";
}

// Checks how the fields fit together. Each field is already within its own limits.
std::optional<std::string> fit_fault(const Tool& t) {
  const double radius = 0.5 * t.diameter_mm, shank = 0.5 * t.shank_diameter_mm;
  switch (t.kind) {
    case ToolKind::drill:
    case ToolKind::end_drill:
    case ToolKind::round_burr:
    case ToolKind::sphere_reamer:
    case ToolKind::cylinder_reamer:
    case ToolKind::outside_reamer:
      if (shank > radius) return at_most("shank_diameter_mm", t.shank_diameter_mm, "the cutting part", t.diameter_mm);
      break;
    default:
      break;
  }
  switch (t.kind) {
    case ToolKind::drill:
    case ToolKind::pin:
      if (point_height_mm(t) > t.cutting_length_mm)
        return "\"point_angle_deg\" makes a point of " + written(point_height_mm(t)) +
               " mm, longer than cutting_length_mm; make the angle wider";
      break;
    case ToolKind::barrel_burr: {
      const double half = 0.5 * t.cutting_length_mm;
      if (t.corner_mm < half)
        return "\"corner_mm\" is " + written(t.corner_mm) +
               ", less than half the cutting length; make the bulge's radius at least " + written(half);
      const double end = radius - (t.corner_mm - std::sqrt(t.corner_mm * t.corner_mm - half * half));
      if (end < std::max(shank, kThinnest_mm))
        return "\"shank_diameter_mm\" is " + written(t.shank_diameter_mm) + ", wider than the barrel's end of " +
               written(2.0 * end) + " mm; make it narrower or corner_mm larger";
      break;
    }
    case ToolKind::contoured_burr:
      if (shank > radius) return at_most("shank_diameter_mm", t.shank_diameter_mm, "the cutting part", t.diameter_mm);
      if (end_radius_mm(t) < 0.5 * kThinnest_mm)
        return "\"taper_deg\" comes to a point before the tip; make it smaller, or diameter_mm larger, or "
               "cutting_length_mm "
               "shorter";
      if (end_radius_mm(t) * (1.0 - std::sin(t.taper_rad)) > t.cutting_length_mm)
        return "\"cutting_length_mm\" is " + written(t.cutting_length_mm) +
               ", shorter than its rounded end; make it longer or diameter_mm smaller";
      break;
    case ToolKind::cylinder_reamer:
      if (t.corner_mm > radius - kThinnest_mm || t.corner_mm > t.cutting_length_mm)
        return "\"corner_mm\" is " + written(t.corner_mm) +
               ", more than the reamer's end has room for; make it smaller than half of diameter_mm and than "
               "cutting_length_mm";
      break;
    case ToolKind::outside_reamer:
      if (t.bore_mm > t.diameter_mm - 2.0 * kThinnest_mm)
        return "\"bore_mm\" is " + written(t.bore_mm) + ", which leaves no wall inside diameter_mm; make it smaller";
      break;
    case ToolKind::oscillating_saw: {
      if (t.pivot_mm < t.width_mm)
        return "\"pivot_mm\" is " + written(t.pivot_mm) +
               ", nearer than the blade is wide; make it larger than width_mm";
      if (t.cutting_length_mm < tooth_line_drop_mm(t) + kThinnest_mm)
        return "\"cutting_length_mm\" is " + written(t.cutting_length_mm) +
               ", less than the bow of its tooth line; make it at least " +
               written(std::ceil(10.0 * (tooth_line_drop_mm(t) + kThinnest_mm)) / 10.0);
      if (t.reach_mm() > t.pivot_mm + 1e-9)
        return "\"pivot_mm\" is " + written(t.pivot_mm) +
               ", so the blade would reach behind its pivot; make cutting_length_mm and shank_length_mm shorter";
      break;
    }
    case ToolKind::broach:
    case ToolKind::trial_stem: {
      const double narrow = std::min(t.width_mm, t.thickness_mm) - 2.0 * t.cutting_length_mm * std::tan(t.taper_rad);
      if (narrow < 2.0 * kThinnest_mm)
        return "\"taper_deg\" comes to an edge before the tip; make it smaller, or cutting_length_mm shorter, or "
               "width_mm and "
               "thickness_mm larger";
      if (t.corner_mm > 0.9 * narrow)
        return "\"corner_mm\" is " + written(t.corner_mm) + ", more than the tip is wide; make it smaller";
      if (t.shank_diameter_mm > std::min(t.width_mm, t.thickness_mm))
        return at_most("shank_diameter_mm", t.shank_diameter_mm, "its upper end", std::min(t.width_mm, t.thickness_mm));
      break;
    }
    case ToolKind::drill_sleeve:
      if (t.bore_mm > t.diameter_mm - 2.0 * kThinnest_mm)
        return "\"bore_mm\" is " + written(t.bore_mm) + ", which leaves no wall inside diameter_mm; make it smaller";
      break;
    case ToolKind::distal_block:
    case ToolKind::four_in_one_block: {
      // Pin holes are in the ends. The space between them is for the slots.
      if (t.width_mm < 8.0 * t.diameter_mm)
        return "\"diameter_mm\" is " + written(t.diameter_mm) +
               ", too wide for pin holes beside the slots; make it at most an eighth of width_mm";
      if (t.thickness_mm < t.diameter_mm + 2.0 * kThinnest_mm)
        return "\"diameter_mm\" is " + written(t.diameter_mm) +
               ", too wide for the block; make the pin holes smaller than thickness_mm";
      const double share = t.kind == ToolKind::distal_block ? 0.5 : 0.1;
      if (t.bore_mm > share * t.thickness_mm)
        return "\"bore_mm\" is " + written(t.bore_mm) + ", too high a slot for the block; make it at most " +
               written(share * t.thickness_mm);
      break;
    }
    case ToolKind::screw:
      if (t.core_diameter_mm > t.diameter_mm - kThinnest_mm)
        return "\"core_diameter_mm\" is " + written(t.core_diameter_mm) +
               ", which leaves no thread on diameter_mm; make it smaller";
      if (point_height_mm(t) * t.diameter_mm / t.core_diameter_mm > t.cutting_length_mm)
        return "\"point_angle_deg\" makes a point longer than cutting_length_mm; make the angle wider";
      break;
    case ToolKind::trial_cup:
      if (t.thickness_mm > radius - kThinnest_mm)
        return "\"thickness_mm\" is " + written(t.thickness_mm) +
               ", thicker than the cup; make it less than half of diameter_mm";
      break;
    default:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::span<const KindName> tool_kinds() { return kKinds; }

std::vector<FieldRule> field_rules(ToolKind kind) {
  std::vector<FieldRule> rules;
  const auto add = [&](const FieldRule& rule) { rules.push_back(rule); };
  const FieldRule point = angle("point_angle_rad", &Tool::point_angle_rad, 15, 175);
  const auto width = [](double lowest, double highest) {
    return length("width_mm", &Tool::width_mm, lowest, highest, Edit::yes);
  };
  const auto thickness = [](double lowest, double highest) {
    return length("thickness_mm", &Tool::thickness_mm, lowest, highest, Edit::yes);
  };
  const auto corner = [](double highest) {
    return length("corner_mm", &Tool::corner_mm, 0.0, highest, Edit::no, Need::optional);
  };
  switch (kind) {
    case ToolKind::drill:
      for (const auto& rule : {diameter(0.5, 25), cutting_length(2, 300), point}) add(rule);
      add_shank(rules, 25);
      add_drive(rules, 1, 150000, 8);
      break;
    case ToolKind::end_drill:
      for (const auto& rule : {diameter(0.5, 25), cutting_length(2, 300)}) add(rule);
      add_shank(rules, 25);
      add_drive(rules, 1, 150000, 8);
      break;
    case ToolKind::round_burr:
      add(diameter(0.5, 20));
      add_shank(rules, 20);
      add_drive(rules, 1, 150000, 64);
      break;
    case ToolKind::barrel_burr:
      for (const auto& rule : {diameter(0.5, 20), cutting_length(0.5, 40)}) add(rule);
      add(length("corner_mm", &Tool::corner_mm, 0.5, 200));
      add_shank(rules, 20);
      add_drive(rules, 1, 150000, 64);
      break;
    case ToolKind::contoured_burr:
      for (const auto& rule : {diameter(0.5, 20), cutting_length(0.5, 40)}) add(rule);
      add(angle("taper_rad", &Tool::taper_rad, 0, 45));
      add_shank(rules, 20);
      add_drive(rules, 1, 150000, 64);
      break;
    case ToolKind::oscillating_saw:
      for (const auto& rule : {cutting_length(0.5, 50), width(2, 60), thickness(0.1, 3)}) add(rule);
      add(length("set_mm", &Tool::set_mm, 0.0, 2.0));
      add(angle("swing_rad", &Tool::swing_rad, 0.5, 20));
      add(length("pivot_mm", &Tool::pivot_mm, 5, 250));
      add(length("shank_length_mm", &Tool::shank_length_mm, 0, 250));
      add_drive(rules, 100, 40000, 200);
      break;
    case ToolKind::reciprocating_saw:
      for (const auto& rule : {cutting_length(1, 150), width(1, 40), thickness(0.1, 3)}) add(rule);
      add(length("set_mm", &Tool::set_mm, 0.0, 2.0));
      add(length("stroke_mm", &Tool::stroke_mm, 0.2, 30));
      add(length("shank_length_mm", &Tool::shank_length_mm, 0, 250));
      add_drive(rules, 100, 40000, 200);
      break;
    case ToolKind::sphere_reamer:
      add(diameter(36, 64));
      add_shank(rules, 30);
      add_drive(rules, 1, 5000, 200);
      break;
    case ToolKind::cylinder_reamer:
      for (const auto& rule : {diameter(3, 30), cutting_length(2, 300)}) add(rule);
      add(corner(10));
      add_shank(rules, 30);
      add_drive(rules, 1, 5000, 32);
      break;
    case ToolKind::outside_reamer:
      for (const auto& rule : {diameter(10, 80), cutting_length(2, 80)}) add(rule);
      add(length("bore_mm", &Tool::bore_mm, 5, 78));
      add(length("thickness_mm", &Tool::thickness_mm, kThinnest_mm, 20));
      add_shank(rules, 30);
      add_drive(rules, 1, 5000, 64);
      break;
    case ToolKind::broach:
      for (const auto& rule : {cutting_length(5, 250), width(3, 100), thickness(3, 60)}) add(rule);
      add(angle("taper_rad", &Tool::taper_rad, 0, 30));
      add(corner(20));
      add_shank(rules, 40);
      add_drive(rules, 1, 5000, 1000);
      break;
    case ToolKind::drill_sleeve:
      for (const auto& rule : {diameter(2, 40), cutting_length(3, 200)}) add(rule);
      add(length("bore_mm", &Tool::bore_mm, 0.6, 38));
      break;
    case ToolKind::distal_block:
    case ToolKind::four_in_one_block:
      for (const auto& rule : {diameter(1, 10), cutting_length(3, 100), width(20, 150), thickness(5, 120)}) add(rule);
      add(length("bore_mm", &Tool::bore_mm, 0.2, 6));
      break;
    case ToolKind::pin:
      for (const auto& rule : {diameter(0.5, 10), cutting_length(2, 300), point}) add(rule);
      add_shank(rules, 20);
      add_drive(rules, 1, 5000, 8);
      break;
    case ToolKind::screw:
      for (const auto& rule : {diameter(1, 12), cutting_length(3, 200), point}) add(rule);
      add(length("core_diameter_mm", &Tool::core_diameter_mm, 0.5, 11));
      add(length("thread_pitch_mm", &Tool::thread_pitch_mm, 0.2, 8));
      add_shank(rules, 20);
      add_drive(rules, 1, 2000, 4);
      break;
    case ToolKind::trial_cup:
      for (const auto& rule : {diameter(36, 80), thickness(1, 20)}) add(rule);
      break;
    case ToolKind::trial_stem:
      for (const auto& rule : {cutting_length(5, 250), width(3, 100), thickness(3, 60)}) add(rule);
      add(angle("taper_rad", &Tool::taper_rad, 0, 30));
      add(corner(20));
      add_shank(rules, 40);
      break;
    case ToolKind::mesh:
      add_drive(rules, 1, 150000, 1000);
      break;
  }
  return rules;
}

double get_field(const Tool& tool, const FieldRule& rule) {
  return rule.count != nullptr ? static_cast<double>(tool.*rule.count) : tool.*rule.number;
}

void set_field(Tool& tool, const FieldRule& rule, double value) {
  // A value that does not fit into a count becomes -1, which is below every limit, so it is reported as a fault.
  if (rule.count != nullptr)
    tool.*rule.count = value == std::floor(value) && std::abs(value) < 1e6 ? static_cast<int>(value) : -1;
  else
    tool.*rule.number = value + 0.0;  // no −0
}

void derive_fields(Tool& tool) {
  if (tool.kind == ToolKind::round_burr) tool.cutting_length_mm = tool.diameter_mm;
  if (tool.kind == ToolKind::sphere_reamer || tool.kind == ToolKind::trial_cup)
    tool.cutting_length_mm = 0.5 * tool.diameter_mm;
  if (tool.kind == ToolKind::mesh && tool.mesh) {
    // The lattice contains the solid, so its size is a bound of the solid's size.
    const CoordBox& box = tool.mesh->box;
    const double pitch_mm = tool.mesh->pitch * kQuantum_mm;
    tool.diameter_mm =
        2.0 * pitch_mm * std::max({std::abs(box.min.x), std::abs(box.max.x), std::abs(box.min.y), std::abs(box.max.y)});
    tool.cutting_length_mm = pitch_mm * std::max(0, -box.min.z);
  }
}

std::string limits_sentence(const FieldRule& rule) {
  const double unit = is_angle(rule) ? kRadPerDegree : 1.0;
  return "from " + written(rule.lowest / unit) + " to " + written(rule.highest / unit);
}

std::optional<std::string> value_fault(const FieldRule& rule, double value) {
  const double unit = is_angle(rule) ? kRadPerDegree : 1.0;
  if (!std::isfinite(value)) return "\"" + shown_name(rule) + "\" is not a number; choose it " + limits_sentence(rule);
  if (rule.whole() && value != std::floor(value))
    return "\"" + shown_name(rule) + "\" is " + written(value) + "; write a whole number";
  if (value < rule.lowest || value > rule.highest)
    return "\"" + shown_name(rule) + "\" is " + written(value / unit) + "; choose it " + limits_sentence(rule);
  return std::nullopt;
}

std::optional<std::string> tool_fault(const Tool& tool) {
  if (std::ranges::find(kKinds, tool.kind, &KindName::kind) == kKinds.end())
    return "its kind is unknown; use a newer version of this program";
  if (!good_name(tool.name))
    return "\"name\" is \"" + tool.name +
           "\"; use up to 64 lower-case letters, digits, '-' and '.', a letter or digit first";
  if (tool.title.empty() || tool.title.size() > 200 || !is_plain_text(tool.title))
    return "\"title\" must have from 1 to 200 letters in UTF-8 without control characters; write what people shall "
           "read";
  for (const FieldRule& rule : field_rules(tool.kind))
    if (auto fault = value_fault(rule, get_field(tool, rule))) return fault;
  if (tool.cut_level < 0 || tool.cut_level >= kLevels)
    return "\"cut_level\" is " + std::to_string(tool.cut_level) + "; choose 0, 1 or 2";
  if (!tool.law.empty() && (!good_name(tool.law) || !tool.cuts()))
    return "\"law\" is \"" + tool.law + "\"; write the name of a force law such as chi, for a tool that cuts";
  if (tool.kind == ToolKind::mesh && !tool.mesh) return "\"mesh\" is missing; name the STL file of its solid";
  return fit_fault(tool);
}

}  // namespace osteon
