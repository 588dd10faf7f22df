#include "server/import/slicer_segments.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "common/core/bounded_text.hpp"
#include "common/core/read_number.hpp"

namespace osteon::import {
namespace {

constexpr std::string_view kSegment = "Segment";
constexpr int kMostSegmentNumber = 65534, kMostSegmentValue = 65535;
constexpr std::size_t kMostShownField = 60;  // bytes in an error

struct FoundSegment {
  std::string name, type;
  std::optional<int> layer, value;
};

// "Segment12_Name" is field "Name" of segment 12.
std::optional<std::pair<int, std::string_view>> split_key(std::string_view key) {
  const std::size_t bar = key.find('_');
  if (!key.starts_with(kSegment) || bar == std::string_view::npos) return std::nullopt;
  const auto number = read_number<int>(std::string(key.substr(kSegment.size(), bar - kSegment.size())));
  if (!number || *number < 0) return std::nullopt;
  return std::pair(*number, key.substr(bar + 1));
}

// The type of "TerminologyEntry:Contexts~SCT^123^Anatomical Structure~SCT^456^Femur~...|": the word of the second code.
std::string type_of(std::string_view tags) {
  const std::size_t entry = tags.find("TerminologyEntry:");
  if (entry == std::string_view::npos) return "";
  std::string_view text = tags.substr(entry);
  text = text.substr(0, text.find('|'));
  for (int part = 0; part < 2; ++part) {
    const std::size_t next = text.find('~');
    if (next == std::string_view::npos) return "";
    text = text.substr(next + 1);
  }
  text = text.substr(0, text.find('~'));
  const std::size_t word = text.rfind('^');
  return word == std::string_view::npos ? "" : std::string(text.substr(word + 1));
}

}  // namespace

Result<std::vector<SlicerSegment>> slicer_segments(const HeaderFields& fields) {
  std::map<int, FoundSegment> found;
  for (const auto& [key, value] : fields) {
    const auto split = split_key(key);
    if (!split) continue;
    if (split->first > kMostSegmentNumber) return bad_input("its header has more than 65535 segments");
    FoundSegment& segment = found[split->first];
    if (split->second == "Name") segment.name = value;
    if (split->second == "Tags") segment.type = type_of(value);
    if (split->second != "Layer" && split->second != "LabelValue") continue;
    const auto number = read_number<int>(value);
    if (!number || *number < 0 || *number > kMostSegmentValue)
      return bad_input("its field " + bounded_text(key, kMostShownField) + " is \"" +
                       bounded_text(value, kMostShownField) + "\", not a number from 0 to 65535");
    (split->second == "Layer" ? segment.layer : segment.value) = *number;
  }
  std::vector<SlicerSegment> segments;
  std::set<std::pair<int, int>> taken;
  for (auto& [number, segment] : found) {
    const SlicerSegment made{std::move(segment.name), std::move(segment.type),
                             segment.layer.value_or(segment.value ? 0 : number), segment.value.value_or(1)};
    if (made.value == 0) return bad_input("its segment " + std::to_string(number) + " has the value 0, which is none");
    if (!taken.emplace(made.layer, made.value).second)
      return bad_input("two of its segments have the value " + std::to_string(made.value) + " in layer " +
                       std::to_string(made.layer));
    segments.push_back(made);
  }
  return segments;
}

}  // namespace osteon::import
