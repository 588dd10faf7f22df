#include "server/import/subvolume_report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"
#include "common/subvolumes/subvolume_file.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;
using subvolumes::SubdivisionCounts;

template <class... Values>
std::string line_of(const char* format, Values... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

double over(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }
double over(std::int64_t part, std::int64_t whole) {
  return over(static_cast<double>(part), static_cast<double>(whole));
}

// Ratios of Table 5.2.
struct Ratios {
  const char* name;
  double file, voxels, surface, processing;
};
std::vector<Ratios> ratios_of(const SubVolumeMeasures& m) {
  const auto ratio = [](const char* name, const DataRow& part, const DataRow& whole) {
    return Ratios{name, over(part.file_bytes, whole.file_bytes), over(part.voxels, whole.voxels),
                  over(part.surface_s, whole.surface_s), over(part.processing_s(), whole.processing_s())};
  };
  return {ratio("sections / original", m.section_sum, m.original), ratio("object / original", m.object_box, m.original),
          ratio("sections / object", m.section_sum, m.object_box), ratio("tree / original", m.tree, m.original)};
}

std::string table_1(const SubVolumeMeasures& m) {
  std::string text =
      "Table 5.1         file, kB      voxels  memory, MB  triangles  surface, s  frame, s  processing, s\n";
  for (const DataRow* row : {&m.original, &m.object_box, &m.section_sum, &m.tree})
    text += line_of("%-14s %11s %11lld %11.2f %10zu %11.4f %9.4f %14.4f\n", row->name.c_str(),
                    row->file_bytes == 0 ? "-" : line_of("%.1f", 1e-3 * static_cast<double>(row->file_bytes)).c_str(),
                    static_cast<long long>(row->voxels), 1e-6 * static_cast<double>(row->memory_bytes), row->triangles,
                    row->surface_s, row->frame_s, row->processing_s());
  return text;
}

std::string table_2(const SubVolumeMeasures& m) {
  std::string text = "\nTable 5.2                 file     voxels    surface  processing\n";
  for (const Ratios& r : ratios_of(m))
    text += line_of("%-20s %9s %9.2f%% %9.2f%% %10.2f%%\n", r.name,
                    r.file == 0.0 ? "-" : line_of("%.2f%%", 100.0 * r.file).c_str(), 100.0 * r.voxels,
                    100.0 * r.surface, 100.0 * r.processing);
  return text + "Niu 2008 has 2.12% of the voxels and 2.16 / 136.24 = 1.59% of the processing time (printed: 1.89%).\n";
}

// "56+134": found by each subdivision that found any; "0" if none did.
std::string sum_text(const std::vector<std::int64_t>& parts) {
  std::string text;
  for (const std::int64_t part : parts)
    if (part != 0) text += (text.empty() ? "" : "+") + std::to_string(part);
  return text.empty() ? "0" : text;
}

std::string table_3(const SubVolumeMeasures& m) {
  std::string text =
      "\nTable 5.3    uniform                  full  partly full                 empty   mean voxels    kept\n";
  for (std::size_t n = 0; n < m.subdivisions.size(); ++n) {
    const SubdivisionCounts& row = m.subdivisions[n];
    text += line_of("%-10zu %9lld %21s %12lld %21s %13.0f %6.2f%%\n", n, static_cast<long long>(row.uniform),
                    sum_text(row.full).c_str(), static_cast<long long>(row.partly_full), sum_text(row.empty).c_str(),
                    row.mean_voxels, 100.0 * row.kept());
  }
  return text +
         line_of("list       %lld sub-volumes with %lld voxels, %.2f MB; tree %zu leaves with %lld voxels, %.2f MB\n",
                 static_cast<long long>(m.listed), static_cast<long long>(m.listed_voxels),
                 1e-6 * static_cast<double>(m.list_memory_bytes), m.leaves,
                 static_cast<long long>(m.leaves) * kLeafVoxels, 1e-6 * static_cast<double>(m.tree.memory_bytes));
}

struct Spread {
  double mean = 0.0;
  std::int64_t most = 0;
};
Spread spread_of(const std::vector<std::int64_t>& values) {
  if (values.empty()) return {};
  return {
      over(std::accumulate(values.begin(), values.end(), std::int64_t{0}), static_cast<std::int64_t>(values.size())),
      std::ranges::max(values)};
}

std::string table_of_steps(const SubVolumeMeasures& m) {
  if (m.steps.empty()) return "";
  std::string text =
      "\nActive                       poses  active mean/most     visited    computed    modified     removed    made "
      "emptied    left         ms      MB\n";
  for (std::size_t i = 0; i < m.steps.size(); ++i) {
    const ActiveReport& s = m.steps[i];
    const auto row = [&](const std::string& name, const std::vector<std::int64_t>& active,
                         const subvolumes::WalkCounts& walk, std::int64_t made, std::int64_t emptied, std::int64_t left,
                         double ms, std::size_t bytes) {
      const Spread spread = spread_of(active);
      text += line_of("%-26s %7lld %12.1f/%-5lld %11lld %11lld %11lld %11lld %7lld %7lld %7lld %10.3f %7.2f\n",
                      name.c_str(), static_cast<long long>(s.poses), spread.mean, static_cast<long long>(spread.most),
                      static_cast<long long>(walk.visited), static_cast<long long>(walk.computed),
                      static_cast<long long>(walk.modified), static_cast<long long>(walk.removed),
                      static_cast<long long>(made), static_cast<long long>(emptied), static_cast<long long>(left), ms,
                      1e-6 * static_cast<double>(bytes));
    };
    row(line_of("%zu %s", i + 1, s.tool.substr(0, 20).c_str()), s.queued, s.walk, s.made, s.emptied, s.left, s.ms,
        s.memory_bytes);
    row("  OpenVDB tree, leaves", s.touched, s.leaf_walk, 0, s.leaves_emptied, s.leaves_left, s.leaf_ms,
        s.leaf_memory_bytes);
  }
  return text;
}

nlohmann::json as_json(const DataRow& row) {
  nlohmann::json json{{"voxels", row.voxels},       {"memory_bytes", row.memory_bytes},
                      {"triangles", row.triangles}, {"surface_s", row.surface_s},
                      {"frame_s", row.frame_s},     {"processing_s", row.processing_s()}};
  if (row.file_bytes > 0) json["file_bytes"] = row.file_bytes;
  return json;
}

nlohmann::json as_json(const CoordBox& box) {
  return {{"first", {box.min.x, box.min.y, box.min.z}}, {"last", {box.max.x, box.max.y, box.max.z}}};
}

nlohmann::json as_json(const subvolumes::WalkCounts& walk) {
  return {
      {"visited", walk.visited}, {"computed", walk.computed}, {"modified", walk.modified}, {"removed", walk.removed}};
}

nlohmann::json as_json(const ActiveReport& s) {
  return {{"tool", s.tool},
          {"poses", s.poses},
          {"sub_volumes",
           {{"active", s.queued},
            {"voxels", as_json(s.walk)},
            {"made", s.made},
            {"emptied", s.emptied},
            {"left", s.left},
            {"bone_left", s.bone},
            {"ms", s.ms},
            {"memory_bytes", s.memory_bytes}}},
          {"openvdb_tree",
           {{"touched", s.touched},
            {"voxels", as_json(s.leaf_walk)},
            {"emptied", s.leaves_emptied},
            {"left", s.leaves_left},
            {"bone_left", s.leaf_bone},
            {"ms", s.leaf_ms},
            {"memory_bytes", s.leaf_memory_bytes}}}};
}

// Writes a text and reads it again by `parse`. Error: internal, if it reads otherwise than it was written.
template <class Parse>
Result<void> write_and_read(const fs::path& file, const std::string& text, Parse parse) {
  if (auto written = write_file(file, text); !written) return written;
  const auto again = read_file(file);
  if (!again) return tl::unexpected(again.error());
  const auto parsed = parse(*again, file.filename().string());
  if (!parsed) return tl::unexpected(parsed.error());
  if (subvolumes::to_text(*parsed) != text)
    return failure(ErrorCode::internal, file.string() + " reads otherwise than it was written; check the disk");
  return {};
}

Result<void> write_data(const SubVolumeInput& input, const SubVolumeMeasures& measures, const fs::path& folder,
                        const KeepGoing& keep_going) {
  const int subdivisions = static_cast<int>(measures.subdivisions.size()) - 1;
  const subvolumes::MetaFile meta = subvolumes::meta_of(measures.sections, subdivisions);
  if (auto written = write_and_read(folder / subvolumes::kMetaFile, subvolumes::to_text(meta), subvolumes::parse_meta);
      !written)
    return written;
  for (std::size_t i = 0; i < measures.sections.size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(measures.sections.size())))
      return stopped_while("writing the sub-volumes");
    const auto data = subvolumes::data_of(input.voxels(), measures.sections[i]);
    if (auto written =
            write_and_read(folder / meta.entries[i].file, subvolumes::to_text(data), subvolumes::parse_sub_volume);
        !written)
      return written;
  }
  return {};
}

}  // namespace

std::string to_text(const SubVolumeMeasures& m) {
  const Coord object = m.object.dims();
  return "scan       " + m.what +
         line_of("\nbone       %lld voxels within %dx%dx%d, %zu sections of", static_cast<long long>(m.bone), object.x,
                 object.y, object.z, m.sections.size()) +
         std::accumulate(m.sections.begin(), m.sections.end(), std::string(),
                         [](std::string text, const CoordBox& section) {
                           return std::move(text) + " " + std::to_string(section.dims().z);
                         }) +
         " slices\n\n" + table_1(m) + table_2(m) + table_3(m) + table_of_steps(m);
}

std::string to_json(const SubVolumeMeasures& m) {
  nlohmann::json ratios, sections = nlohmann::json::array(), subdivisions = nlohmann::json::array(),
                         steps = nlohmann::json::array();
  for (const Ratios& r : ratios_of(m)) {
    nlohmann::json& of = ratios[r.name];
    of = {{"voxels", r.voxels}, {"surface", r.surface}, {"processing", r.processing}};
    if (r.file > 0.0) of["file"] = r.file;
  }
  for (const CoordBox& section : m.sections) sections.push_back(as_json(section));
  for (const SubdivisionCounts& row : m.subdivisions)
    subdivisions.push_back({{"uniform", row.uniform},
                            {"full", row.full},
                            {"partly_full", row.partly_full},
                            {"empty", row.empty},
                            {"mean_voxels", row.mean_voxels},
                            {"kept", row.kept()}});
  for (const ActiveReport& step : m.steps) steps.push_back(as_json(step));
  const nlohmann::json report{
      {"scan", m.what},
      {"bone_voxels", m.bone},
      {"object_box", as_json(m.object)},
      {"sections", sections},
      {"table_5_1",
       {{"original", as_json(m.original)},
        {"object_box", as_json(m.object_box)},
        {"section_sum", as_json(m.section_sum)},
        {"openvdb_tree", as_json(m.tree)}}},
      {"table_5_2", ratios},
      {"table_5_3", subdivisions},
      {"list", {{"sub_volumes", m.listed}, {"voxels", m.listed_voxels}, {"memory_bytes", m.list_memory_bytes}}},
      {"leaves", m.leaves},
      {"steps", steps}};
  return report.dump(2) + "\n";
}

Result<void> write_sub_volumes(const SubVolumeInput& input, const SubVolumeMeasures& measures, const fs::path& folder,
                               const KeepGoing& keep_going) {
  return write_new_folder(folder, [&](const fs::path& partial) -> Result<void> {
    if (auto written = write_data(input, measures, partial, part(keep_going, 0.0, 0.6)); !written) return written;
    const auto picture = boxes_picture(input, measures, part(keep_going, 0.6, 1.0));
    if (!picture) return tl::unexpected(picture.error());
    const auto png = picture->png();
    if (!png) return tl::unexpected(png.error());
    if (auto written = write_file(partial / "boxes.png", *png); !written) return written;
    if (auto written = write_file(partial / "report.txt", to_text(measures)); !written) return written;
    if (auto written = write_file(partial / "report.json", to_json(measures)); !written) return written;
    if (!keep_going(1.0)) return stopped_while("writing the report");
    return {};
  });
}

}  // namespace osteon::import
