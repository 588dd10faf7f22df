#include "audio_client/analysis/displacement_file.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "common/core/bounded_text.hpp"
#include "common/core/read_number.hpp"
#include "common/runtime/files.hpp"

namespace osteon::audio {
namespace {

constexpr std::uintmax_t kMostBytes = 256U << 20U;

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    std::string_view field = line.substr(at, end - at);
    while (!field.empty() && (field.front() == ' ' || field.front() == '"')) field.remove_prefix(1);
    while (!field.empty() && (field.back() == ' ' || field.back() == '"')) field.remove_suffix(1);
    fields.push_back(field);
    at = end + 1;
  }
  return fields;
}

// The next line without its end, taken from the front of `text`.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

}  // namespace

Result<std::vector<DisplacementRow>> read_displacement(const std::filesystem::path& file, double start_s) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    return bad_input(file.string() + " is a folder; give --displacement a table in it");
  if (!std::filesystem::is_regular_file(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file.string() +
                                             "; give --displacement a table with the columns time_s and " +
                                             "displacement_mm");
  if (std::filesystem::file_size(file, error) > kMostBytes)
    return bad_input(file.string() + " has more than 256 MiB; give --displacement a shorter table");
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  std::string_view rest = *text;
  // The byte order mark of a spreadsheet's "CSV UTF-8".
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  const std::vector<std::string_view> columns = fields_of(take_line(rest));
  const auto column = [&](std::string_view name) {
    return static_cast<std::size_t>(std::ranges::find(columns, name) - columns.begin());
  };
  const std::size_t time = column("time_s");
  const std::size_t mm = std::min(column("displacement_mm"), column("depth_mm"));
  for (const auto& [at, name] : {std::pair{time, "time_s"}, std::pair{mm, "displacement_mm"}})
    if (at == columns.size())
      return bad_input(file.string() + ": line 1 has no column " + name +
                       "; begin the table with time_s,displacement_mm, separated by a comma");
  for (const std::size_t used : {time, mm})
    if (std::ranges::count(columns, columns[used]) > 1)
      return bad_input(file.string() + ": line 1 has the column " + std::string(columns[used]) +
                       " more than once; keep the one that shall be drawn");

  std::vector<DisplacementRow> rows;
  for (int number = 2; !rest.empty(); ++number) {
    const std::string_view line = take_line(rest);
    if (line.empty()) continue;
    const auto at = [&](std::string_view name) {
      return file.string() + ": line " + std::to_string(number) + ": " + std::string(name) + " ";
    };
    const std::vector<std::string_view> fields = fields_of(line);
    if (fields.size() > columns.size())
      return bad_input(file.string() + ": line " + std::to_string(number) + " has " + std::to_string(fields.size()) +
                       " fields, and line 1 has " + std::to_string(columns.size()) +
                       "; separate fields by commas, and write numbers with a point");
    for (const std::size_t needed : {time, mm})
      if (needed >= fields.size() || !read_number<double>(fields[needed]))
        return bad_input(at(columns[needed]) + "is no number" +
                         (needed < fields.size() ? " (" + bounded_text(fields[needed], 40) + ")" : "") +
                         "; write one, with a point");
    const double time_s = *read_number<double>(fields[time]) - start_s;
    if (!rows.empty() && time_s < rows.back().time_s)
      return bad_input(at("time_s") + "is less than in the line before; sort the table by time");
    rows.push_back({time_s, *read_number<double>(fields[mm])});
  }
  if (rows.empty()) return bad_input(file.string() + ": has no row below its header; add rows of numbers");
  return rows;
}

}  // namespace osteon::audio
