#include "haptic_client/app/laws_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <numbers>
#include <sstream>
#include <vector>

#include "common/mechanics/force_law.hpp"
#include "common/runtime/command_line.hpp"
#include "common/tools/tool_file.hpp"
#include "common/tools/tool_rules.hpp"

namespace osteon::haptic {
namespace {

using nlohmann::json;

constexpr std::size_t kWidth = 100;

// "  equation   text", further lines under the text.
void paragraph(std::ostream& out, std::string_view label, std::string_view text) {
  constexpr std::size_t kIndent = 13;
  std::string line = "  " + std::string(label);
  line.resize(kIndent, ' ');
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;) {
    if (line.size() > kIndent && line.size() + 1 + word.size() > kWidth) {
      out << line << "\n";
      line.assign(kIndent, ' ');
    }
    line += (line.size() > kIndent ? " " : "") + word;
  }
  out << line << "\n";
}

std::string defaults_of(const ForceLaw& law) {
  std::string names;
  for (const auto& [kind, name] : tool_kinds()) {
    Tool tool;
    tool.kind = kind;
    if (tool.cuts() && &default_law(tool) == &law) names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names.empty() ? "none; it is chosen" : names;
}

std::string tools_of(const ForceLaw& law) {
  std::string names;
  for (const auto& [kind, name] : tool_kinds()) {
    Tool tool;
    tool.kind = kind;
    if (tool.cuts() && law.fits(kind)) names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names;
}

json span(const Span& s) { return s.lowest == 0.0 && s.highest == 0.0 ? json() : json::array({s.lowest, s.highest}); }

// A tool whose whole point is in bone, at a speed and a feed.
struct Point {
  std::string_view law, tool;
  double diameter_mm, rpm, feed_mm_per_s, density_g_cm3;
};

std::vector<Point> comparison_points() {
  std::vector<Point> points;
  for (const double density : {0.3, 0.5, 1.0, 1.8, 1.9, 2.0})
    points.push_back({"chi", "drill-3.2", 3.2, 1000, 1, density});
  for (const double diameter : {2.5, 3.2, 4.5, 7.94})
    points.push_back({"allotta", "drill-3.2", diameter, 1000, 1, 1.9});
  points.push_back({"spring-damper", "drill-3.2", 3.2, 1000, 1, 1.9});
  points.push_back({"multi-point", "drill-3.2", 3.2, 1000, 1, 1.9});
  points.push_back({"agus", "burr-round-5", 5.0, 20000, 5, 1.9});
  points.push_back({"milling", "burr-round-5", 5.0, 20000, 5, 1.9});
  points.push_back({"saw", "saw-oscillating-1", 0, 12000, 1, 1.9});
  points.push_back({"reamer", "reamer-sphere", 50, 250, 0.5, 0.4});
  points.push_back({"broach", "broach-1", 0, 60, 1, 0.3});
  return points;
}

json computed(const Point& point) {
  const ForceLaw& law = *find_force_law(point.law);
  Tool tool = *find_tool(point.tool);
  if (point.diameter_mm > 0.0) tool.diameter_mm = point.diameter_mm;
  const LawTool of = law_tool(tool);
  const LawInputs in{.spindle_rpm = point.rpm, .density_g_cm3 = point.density_g_cm3, .engaged = 1.0};
  const FeedLaw feed_law = law.feed_law(of, in);
  const double force_n = resistance_n(feed_law, point.feed_mm_per_s);
  const double torque_nmm = law.torque_nmm(of, in, force_n);
  // Work of the torque per turn, for each volume of the hole.
  const double per_turn_mm3 = 60.0 * point.feed_mm_per_s / point.rpm * of.leading_area_mm2;
  return {{"law", point.law},
          {"tool", point.tool},
          {"diameter_mm", of.diameter_mm},
          {"spindle_rpm", point.rpm},
          {"feed_mm_per_s", point.feed_mm_per_s},
          {"density_g_cm3", point.density_g_cm3},
          {"force_n", force_n},
          {"torque_nmm", torque_nmm},
          {"work_mj_per_mm3", 2.0 * std::numbers::pi * torque_nmm / per_turn_mm3},
          {"feed_of_force_mm_per_s", feed_at_mm_per_s(feed_law, force_n)},
          {"most_feed_mm_per_s", feed_law.max_feed_mm_per_s},
          {"outside_range", out_of_range_sentence(law, out_of_range(law, of, in, point.feed_mm_per_s))}};
}

}  // namespace

std::string laws_text() {
  std::ostringstream out;
  out << "Force laws of Osteon. Whole point or edge in bone; [A] marks an assumption. N rpm, v mm/s, rho g/cm3, D "
         "mm.\n";
  for (const ForceLaw& law : force_laws()) {
    out << "\n" << law.name << ": " << law.title << "\n";
    paragraph(out, "equation",
              std::string(law.equation) +
                  (law.number.empty() ? "" : " (" + std::string(law.number) + " of the dissertation)"));
    paragraph(out, "source", law.source);
    paragraph(out, "units", law.inputs);
    paragraph(out, "constants", law.constants);
    paragraph(out, "wear", law.wear);
    paragraph(out, "range", law.range);
    paragraph(out, "notes", law.notes);
    paragraph(out, "fits", tools_of(law));
    paragraph(out, "default of", defaults_of(law));
  }
  out << "\nA tool file chooses with a line such as \"law: allotta\". The laws disagree with each other; wear 1 is "
         "sharp, a\n"
         "blunt tool needs about twice the force.\n";
  return out.str();
}

std::string laws_json() {
  json laws = json::array(), defaults = json::object(), points = json::array();
  for (const ForceLaw& law : force_laws()) {
    json kinds = json::array();
    for (const auto& [kind, name] : tool_kinds()) {
      Tool tool;
      tool.kind = kind;
      if (!tool.cuts()) continue;
      if (law.fits(kind)) kinds.push_back(name);
      if (&default_law(tool) == &law) defaults[std::string(name)] = law.name;
    }
    laws.push_back({{"name", law.name},
                    {"title", law.title},
                    {"equation", law.equation},
                    {"number", law.number},
                    {"source", law.source},
                    {"units", law.inputs},
                    {"constants", law.constants},
                    {"wear", law.wear},
                    {"range", law.range},
                    {"notes", law.notes},
                    {"tools", kinds},
                    {"limits",
                     {{"spindle_rpm", span(law.limits.spindle_rpm)},
                      {"feed_mm_per_s", span(law.limits.feed_mm_per_s)},
                      {"density_g_cm3", span(law.limits.density_g_cm3)},
                      {"diameter_mm", span(law.limits.diameter_mm)},
                      {"depth_um", span(law.limits.depth_um)},
                      {"tooth_mm_per_s", span(law.limits.tooth_mm_per_s)}}}});
  }
  for (const Point& point : comparison_points()) points.push_back(computed(point));
  return json{{"laws", laws}, {"defaults", defaults}, {"points", points}}.dump(2) + "\n";
}

int run_laws(int argc, const char* const* argv) {
  bool as_json = false;
  CLI::App app("Lists the force laws: equation, source, units, constants, wear, range, and the tools that obey them.",
               "osteon-haptic laws");
  app.add_flag("--json", as_json, "As JSON, with the forces at the points of comparison");
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  const std::string text = as_json ? laws_json() : laws_text();
  return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0 ? 0 : 1;
}

}  // namespace osteon::haptic
