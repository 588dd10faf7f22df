#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/mesh_file.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/number_option.hpp"
#include "common/tools/tool_surface.hpp"
#include "common/volume/cell_collision.hpp"
#include "common/volume/field_file.hpp"
#include "common/volume/mesh_distance.hpp"
#include "server/import/bone_surface.hpp"
#include "server/import/carving.hpp"
#include "server/import/command.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

struct BoneArguments {
  std::string bone, script, out, fields, surface, report, file, stl, tool, name, title;
  std::vector<std::string> set;
  std::vector<double> at, axis;
  int level = 0, points = 2000;
  double cut_mm = 1.0;
  std::uint32_t body = 0;
};

Result<void> check_mesh_name(const std::string& path) {
  const fs::path ending = fs::path(path).extension();
  if (ending != ".stl" && ending != ".ply" && ending != ".obj")
    return failure(ErrorCode::invalid_input, path + " does not end in .stl, .ply or .obj");
  return check_free(path);
}

Result<std::string> write_surface(const CutField& field, const std::string& file, const KeepGoing& keep_going) {
  const auto mesh = bone_surface(field, keep_going);
  if (!mesh) return tl::unexpected(mesh.error());
  if (auto written = write_mesh(*mesh, file); !written) return tl::unexpected(written.error());
  char text[320];
  std::snprintf(text, sizeof text, "%s: %zu triangles, %s, %.3f cm3 within\n", file.c_str(), mesh->triangles.size(),
                to_text(edge_faults(*mesh)).c_str(), enclosed_mm3(*mesh) * 1e-3);
  return std::string(text);
}

// The bone after the cuts of --fields: one body of them.
Result<CutField> load_body(const BoneArguments& a) {
  auto bone = Case::load(a.bone);
  if (!bone) return tl::unexpected(bone.error());
  CutField field(*bone, BodyId{a.body});
  if (a.fields.empty()) return field;
  const auto saved = load_fields(a.fields, *bone);
  if (!saved) return tl::unexpected(saved.error());
  if (std::ranges::find(saved->bodies, BodyId{a.body}) == saved->bodies.end())
    return failure(ErrorCode::not_found, a.fields + " has no body " + std::to_string(a.body));
  for (const FieldLeaf& leaf : saved->leaves)
    if (leaf.body == BodyId{a.body}) field.restore(leaf);
  return field;
}

Result<std::string> run_surface(const BoneArguments& a, const StopSignal& stop) {
  if (auto good = check_mesh_name(a.out); !good) return tl::unexpected(good.error());
  const auto field = load_body(a);
  if (!field) return tl::unexpected(field.error());
  Bar bar(stop, "meshing");
  return write_surface(*field, a.out, bar.stage(0.0, 1.0));
}

// Measures one way to test whether the tool meets bone: its answer, its median time, and its memory.
template <class Ask>
std::string contact_line(const char* way, const std::vector<SamplePoint>& points, const Pose& pose,
                         std::size_t memory_bytes, Ask ask) {
  using Clock = std::chrono::steady_clock;
  std::array<double, 21> times_us;
  std::optional<std::size_t> found;
  for (double& time : times_us) {
    const auto begin = Clock::now();
    found = ask();
    time = std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
  }
  std::ranges::nth_element(times_us, times_us.begin() + times_us.size() / 2);
  std::string where = "is free of bone";
  if (found) {
    const Vec3 at = pose.point(points[*found].position_mm);
    char text[120];
    std::snprintf(text, sizeof text, "meets bone at %.2f %.2f %.2f, point %zu", at.x(), at.y(), at.z(), *found);
    where = text;
  }
  char line[240];
  std::snprintf(line, sizeof line, "%-18s %-52s %9.1f us %9.3f MB\n", way, where.c_str(), times_us[times_us.size() / 2],
                static_cast<double>(memory_bytes) * 1e-6);
  return line;
}

Result<std::string> run_contact(const BoneArguments& a) {
  constexpr double kMostSamples = 1e8;
  const auto tool = tool_named(a.tool, fs::current_path());
  if (!tool) return tl::unexpected(tool.error());
  const Vec3 axis(a.axis[0], a.axis[1], a.axis[2]);
  if (!axis.allFinite() || !(axis.stableNorm() > 1e-6))
    return failure(ErrorCode::invalid_input, "--axis has no length, or is not finite");
  const Vec3 at(a.at[0], a.at[1], a.at[2]);
  if (!at.allFinite()) return failure(ErrorCode::invalid_input, "--at is not finite; give X,Y,Z in mm");
  const Pose pose = pose_along(at, axis.stableNormalized());
  const auto field = load_body(a);
  if (!field) return tl::unexpected(field.error());

  // The samples round the tool, as far as there is bone.
  const std::vector<SamplePoint> points = sample_points(*tool, a.points);
  const double pitch = level_pitch_mm(field->bone().pitch_mm(), a.level);
  const Box bone = field->bone().bounds().grown(2.0 * pitch);
  Box box{pose.position_mm, pose.position_mm};
  for (const SamplePoint& point : points) {
    box.min_mm = box.min_mm.cwiseMin(pose.point(point.position_mm));
    box.max_mm = box.max_mm.cwiseMax(pose.point(point.position_mm));
  }
  box = box.grown(2.0 * pitch);
  box = {box.min_mm.cwiseMax(bone.min_mm), box.max_mm.cwiseMin(bone.max_mm)};
  if (!(box.min_mm.array() < box.max_mm.array()).all()) return tool->name + " is beyond the bone\n";
  if ((box.max_mm - box.min_mm).prod() / (pitch * pitch * pitch) > kMostSamples)
    return failure(ErrorCode::invalid_input,
                   "the box round " + tool->name + " has more than 100 million samples; choose a lower --level");
  const CoordBox samples = covering_samples(box, pitch);
  const BoneCells cells(*field, a.level, samples);
  const BoneDistance distance(*field, a.level, samples);
  const auto of_cells = [&](MixedCell rule) {
    return [&cells, &points, &pose, rule] { return first_contact(cells, rule, points, pose); };
  };
  return contact_line("cells, nearest", points, pose, cells.memory_bytes(), of_cells(MixedCell::nearest)) +
         contact_line("cells, trilinear", points, pose, cells.memory_bytes(), of_cells(MixedCell::trilinear)) +
         contact_line("distance", points, pose, distance.memory_bytes(),
                      [&] { return first_contact(distance, points, pose); });
}

// Peak memory of this process, MB; zero if the system does not report it.
double peak_memory_mb() {
  const auto status = read_file("/proc/self/status");
  if (!status) return 0.0;
  const std::size_t at = status->find("VmHWM:");
  return at == std::string::npos ? 0.0 : std::strtod(status->c_str() + at + 6, nullptr) / 1024.0;
}

// Explains to a person why a step removed nothing: what the tip meets on its path, and where bone is.
std::string nothing_removed(std::size_t number, const CarveStep& step, const StepReport& report, const Case& bone) {
  bool in_bone = false;
  // a lower bound of the distance to bone along the whole path
  double free_mm = std::numeric_limits<double>::infinity();
  const auto look = [&](const Vec3& tip) {
    in_bone = in_bone || bone.surface_mm(tip) < 0.0;
    free_mm = std::min(free_mm, std::max(bone.clearance_mm(tip), std::max(0.0, bone.surface_mm(tip))));
  };
  look(step.path.front().position_mm);
  for (std::size_t i = 1; i < step.path.size(); ++i) {
    const Vec3 &from = step.path[i - 1].position_mm, &to = step.path[i].position_mm;
    const int parts = std::clamp(static_cast<int>((to - from).norm() / bone.pitch_mm()), 1, 10'000);
    for (int part = 1; part <= parts; ++part) look(from + (to - from) * part / parts);
  }
  const Box box = bone.bounds();
  char why[120], text[320];
  if (report.metal_refused > 0)
    std::snprintf(why, sizeof why, "it meets metal, which no tool cuts");
  else if (in_bone)
    std::snprintf(why, sizeof why, "what its tip meets was removed before");
  else
    std::snprintf(why, sizeof why, "its tip stays at least %.1f mm from bone", free_mm);
  std::snprintf(text, sizeof text,
                "       step %zu removed nothing: %s; bone lies within x %.0f..%.0f, y %.0f..%.0f, z %.0f..%.0f mm\n",
                number, why, box.min_mm.x(), box.max_mm.x(), box.min_mm.y(), box.max_mm.y(), box.min_mm.z(),
                box.max_mm.z());
  return text;
}

Result<std::string> run_carve(const BoneArguments& a, const StopSignal& stop) {
  for (const std::string& file : {a.out, a.report})
    if (!file.empty())
      if (auto is_free = check_free(file); !is_free) return tl::unexpected(is_free.error());
  if (!a.surface.empty())
    if (auto good = check_mesh_name(a.surface); !good) return tl::unexpected(good.error());
  const auto steps = read_carve_script(a.script);
  if (!steps) return tl::unexpected(steps.error());
  auto bone = Case::load(a.bone);
  if (!bone) return tl::unexpected(bone.error());

  Carving carving(std::move(*bone), a.cut_mm);
  std::vector<StepReport> reports;
  std::string text = heading();
  {
    Bar bar(stop, "carving");
    for (std::size_t i = 0; i < steps->size(); ++i) {
      const double count = static_cast<double>(steps->size());
      const auto report =
          carving.run((*steps)[i], bar.stage(static_cast<double>(i) / count, static_cast<double>(i + 1) / count));
      if (!report) return tl::unexpected(report.error());
      reports.push_back(*report);
      text += line(i + 1, *report);
      if (report->removed_mm3 <= 0.0) text += nothing_removed(i + 1, (*steps)[i], *report, carving.bone());
    }
  }
  if (stop.requested()) return tl::unexpected(stopped());
  const SavedFields fields = carving.fields();
  if (auto saved = save_fields(a.out, fields); !saved) return tl::unexpected(saved.error());
  if (!a.report.empty())
    if (auto written = write_file(a.report, to_json(reports, fields)); !written) return tl::unexpected(written.error());
  double removed = 0;
  for (const StepReport& report : reports) removed += report.removed_mm3;
  char totals[320];
  std::snprintf(totals, sizeof totals,
                "removed    %.2f mm3\nbodies     %zu\nmemory     %.0f MB at most\nhash       %s\n", removed,
                carving.bodies(), peak_memory_mb(), to_hex(field_hash(fields.leaves, fields.pitch_mm)).c_str());
  text += totals;
  if (!a.surface.empty()) {
    Bar bar(stop, "meshing");
    const auto written = write_surface(carving.field(0), a.surface, bar.stage(0.0, 1.0));
    if (!written) return tl::unexpected(written.error());
    text += *written;
  }
  return text;
}

// The dimensions that describe a kind's size best, in words.
std::string dimensions(const Tool& tool) {
  std::string text;
  for (const EditableField& field : editable_fields(tool.kind)) {
    if (!field.name.ends_with("_mm") && !field.name.ends_with("_rpm")) continue;
    double value = 0;
    if (field.name == "diameter_mm")
      value = tool.diameter_mm;
    else if (field.name == "cutting_length_mm")
      value = tool.cutting_length_mm;
    else if (field.name == "width_mm")
      value = tool.width_mm;
    else if (field.name == "thickness_mm")
      value = tool.thickness_mm;
    else if (field.name == "set_mm")
      value = tool.set_mm;
    else if (field.name == "bore_mm")
      value = tool.bore_mm;
    else if (field.name == "stroke_mm")
      value = tool.stroke_mm;
    else if (field.name == "spindle_rpm")
      value = tool.spindle_rpm;
    else
      continue;
    if (value == 0) continue;
    char part[64];
    const std::string unit = field.name.substr(field.name.rfind('_') + 1);
    std::snprintf(part, sizeof part, "%s%s %.6g %s", text.empty() ? "" : ", ",
                  field.name.substr(0, field.name.rfind('_')).c_str(), value, unit == "rpm" ? "/min" : "mm");
    text += part;
  }
  std::ranges::replace(text, '_', ' ');
  return text;
}

// Applies `field=value` settings, each by the rules of a tool file. Returns the changes in words.
Result<std::string> change(Tool& tool, const std::vector<std::string>& settings) {
  std::string changes;
  for (const std::string& setting : settings) {
    const std::size_t equals = std::min(setting.find('='), setting.size());
    const std::string field = setting.substr(0, equals);
    double value = 0;
    const char *begin = setting.data() + std::min(equals + 1, setting.size()), *end = setting.data() + setting.size();
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (begin == end || error != std::errc{} || stop != end)
      return failure(ErrorCode::invalid_input, "--set " + setting + " is not FIELD=NUMBER, such as diameter_mm=3");
    auto changed = edited(tool, field, value);
    if (!changed) return tl::unexpected(changed.error());
    tool = std::move(*changed);
    changes += ", " + field + " " + setting.substr(equals + 1);
  }
  return changes;
}

// Writes the tool with the changes of --set, --name and --title as a tool file. A room identifies tools by name, so a
// changed tool gets another name: that of its file, unless --name gives one.
Result<void> write_changed(Tool& tool, const BoneArguments& a) {
  const fs::path file(a.out);
  if (file.extension() != ".yaml" && file.extension() != ".yml")
    return failure(ErrorCode::invalid_input, a.out + " does not end in .yaml");
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  const auto changes = change(tool, a.set);
  if (!changes) return tl::unexpected(changes.error());
  tool.name = a.name.empty() ? file.stem().string() : a.name;
  tool.title = a.title.empty() ? tool.title + *changes : a.title;
  const std::string text = to_yaml(tool);
  auto good = parse_tool(text, a.out);
  if (!good) return tl::unexpected(good.error());
  tool = std::move(*good);
  return write_file(a.out, text);
}

std::string limits(ToolKind kind) {
  std::string text;
  for (const EditableField& field : editable_fields(kind)) {
    char line[120];
    std::snprintf(line, sizeof line, "  %-20s %g to %g%s\n", field.name.c_str(), field.lowest, field.highest,
                  field.whole ? ", whole" : "");
    text += line;
  }
  return text;
}

Result<std::string> run_tools(const BoneArguments& a) {
  std::vector<Tool> tools(builtin_tools().begin(), builtin_tools().end());
  if (!a.file.empty()) {
    auto own = load_tool_file(a.file);  // with the STL that it may name
    if (!own) return tl::unexpected(own.error());
    if (const auto law = choose_law(*own); !law)
      return failure(law.error().code, a.file + ": \"law\": " + law.error().message);
    tools = {std::move(*own)};
  }
  if (!a.tool.empty()) {
    auto known = find_tool(a.tool);
    if (!known) return tl::unexpected(known.error());
    tools = {std::move(*known)};
  }
  if (a.out.empty() != a.set.empty())
    return failure(ErrorCode::invalid_input, "a changed tool needs --set FIELD=NUMBER and --out FILE.yaml, both");
  if (!a.set.empty()) {
    if (tools.size() != 1)
      return failure(ErrorCode::invalid_input, "--set changes one tool: name it, or give its --file");
    if (auto written = write_changed(tools.front(), a); !written) return tl::unexpected(written.error());
  }
  if (!a.stl.empty()) {
    std::error_code error;
    fs::create_directories(a.stl, error);
    if (error) return failure(ErrorCode::internal, "cannot make the folder " + a.stl + ": " + error.message());
    for (const Tool& tool : tools)
      if (auto is_free = check_free((fs::path(a.stl) / (tool.name + ".stl")).string()); !is_free)
        return tl::unexpected(is_free.error());
  }
  std::string text;
  for (const Tool& tool : tools) {
    char line[400];
    std::snprintf(line, sizeof line, "%-20s %-18s %-7s %.16s  %s\n", tool.name.c_str(),
                  std::string(kind_name(tool.kind)).c_str(),
                  tool.cuts() ? ("level " + std::to_string(tool.cut_level)).c_str() : "-", to_hex(tool.hash()).c_str(),
                  dimensions(tool).c_str());
    text += line;
    if (!a.tool.empty() && a.set.empty()) text += limits(tool.kind);
    if (a.stl.empty()) continue;
    const TriangleMesh mesh = tool_surface(tool, 0.5);
    if (auto written = write_stl(mesh, fs::path(a.stl) / (tool.name + ".stl")); !written)
      return tl::unexpected(written.error());
  }
  return text;
}

Result<std::string> run_hash(const BoneArguments& a) {
  const auto saved = load_fields(a.fields);
  if (!saved) return tl::unexpected(saved.error());
  return to_hex(field_hash(saved->leaves, saved->pitch_mm)) + "\n";
}

}  // namespace

void add_bone_commands(CLI::App& app, std::vector<Command>& commands) {
  // Shared by the options that write into it and the command that reads it, both for the life of the program.
  const auto shared = std::make_shared<BoneArguments>();
  BoneArguments& a = *shared;

  CLI::App* surface = app.add_subcommand("surface", "Write a bone's surface, cut or not, as a closed mesh");
  surface->add_option("CASE_DIR", a.bone, "Folder of the case")->required();
  surface->add_option("--out", a.out, "File to write: .stl, .ply or .obj")->required();
  surface->add_option("--fields", a.fields, "Cut fields: a file from carve or from osteon-server --save");
  surface->add_option("--body", a.body, "Body in the fields: 0 is the bone, others are separated pieces")
      ->capture_default_str();
  commands.push_back({surface, [shared](const StopSignal& stop) { return run_surface(*shared, stop); }});

  CLI::App* contact = app.add_subcommand(
      "contact", "Test whether a tool meets bone: two ways with the segmentation's cells, and with the distance field");
  contact->add_option("CASE_DIR", a.bone, "Folder of the case")->required();
  contact->add_option("TOOL", a.tool, "Name of a tool in the tool box, or a tool file")->required();
  contact->add_option("--at", a.at, "Its tip, X,Y,Z, mm")->delimiter(',')->expected(3)->required();
  contact->add_option("--axis", a.axis, "Direction out of its tip, X,Y,Z")->delimiter(',')->expected(3)->required();
  contact->add_option("--fields", a.fields, "Cut fields: a file from carve or from osteon-server --save");
  contact->add_option("--body", a.body, "Body in the fields")->capture_default_str();
  contact->add_option("--level", a.level, "Test at pitch h / 2^level")
      ->check(CLI::Range(0, kLevels - 1))
      ->capture_default_str();
  contact->add_option("--points", a.points, "Approximate number of points on the tool")
      ->check(CLI::Range(100, 100000))
      ->capture_default_str();
  commands.push_back({contact, [shared](const StopSignal&) { return run_contact(*shared); }});

  CLI::App* carve = app.add_subcommand("carve", "Cut a bone by a script, and report what every step did and cost");
  carve->add_option("CASE_DIR", a.bone, "Folder of the case")->required();
  carve
      ->add_option("SCRIPT", a.script,
                   "YAML: steps: [{tool: burr-round-5, from: [x, y, z], to: [x, y, z], axis: [x, y, z]}]")
      ->required();
  carve->add_option("--out", a.out, "File of the cut fields, .vdb")->required();
  carve->add_option("--surface", a.surface, "Also write what is left of the bone: .stl, .ply or .obj");
  carve->add_option("--report", a.report, "Also write the steps' numbers as JSON");
  carve->add_option("--cut", a.cut_mm, "Longest path of one cut, mm")
      ->check(number_in(0.01, 25.0))
      ->capture_default_str();
  commands.push_back({carve, [shared](const StopSignal& stop) { return run_carve(*shared, stop); }});

  CLI::App* tools = app.add_subcommand(
      "tools", "List the tool box: name, kind, level of its cuts, hash, dimensions; or change a tool");
  CLI::Option* named =
      tools->add_option("NAME", a.tool, "Show only this tool, its fields that --set may change, and their limits");
  tools->add_option("--file", a.file, "Show a tool file instead")->excludes(named);
  tools->add_option("--set", a.set, "Change a field, such as diameter_mm=3 or teeth=4; may be given again")
      ->expected(1)
      ->take_all();
  tools->add_option("--out", a.out, "Write the changed tool to this file, .yaml");
  tools->add_option("--name", a.name, "Its name; default: its file's, without .yaml");
  tools->add_option("--title", a.title, "Its title; default: the old one and what was changed");
  tools->add_option("--stl", a.stl, "Also write each tool as NAME.stl into this folder");
  commands.push_back({tools, [shared](const StopSignal&) { return run_tools(*shared); }});

  CLI::App* hash = app.add_subcommand("hash", "Print the hash of cut fields");
  hash->add_option("FIELDS", a.fields, "File from carve or from osteon-server --save")->required();
  commands.push_back({hash, [shared](const StopSignal&) { return run_hash(*shared); }});
}

}  // namespace osteon::import
