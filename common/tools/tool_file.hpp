// Tool files: one surgical tool in YAML. A new tool needs no code. The allowed fields depend on its kind.
//
//   name: burr-round-5
//   title: Round bur 5 mm
//   kind: round-burr
//   diameter_mm: 5
//   ...
//   cut_level: 2        # its cuts go to pitch h / 2^2
//   law: agus           # force law, see `osteon-haptic laws`; without this line, that of its kind
//
// Angles are in degrees (`point_angle_deg`). Two lengths are not written: the cutting length of a round bur is its
// diameter, and that of a sphere reamer is half its diameter.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// Computes the distances of a kind `mesh` from the triangle file that its tool file names, on a lattice of that pitch.
using MeshLoader =
    std::function<Result<std::shared_ptr<const SampledDistance>>(const std::string& file, double pitch_mm)>;

// `file_name`: for messages. Every error is one sentence that names the file, the field and the remedy.
[[nodiscard]] Result<Tool> parse_tool(std::string_view text, const std::string& file_name,
                                      const MeshLoader& load_mesh = {});
[[nodiscard]] Result<Tool> load_tool(const std::filesystem::path& file, const MeshLoader& load_mesh = {});

// A tool file that gives the same tool again, bit for bit, and so the same hash. A mesh is written as its samples.
[[nodiscard]] std::string to_yaml(const Tool& tool);

// The tool with one of editable_fields() changed, checked by the same rules as a file.
[[nodiscard]] Result<Tool> edited(const Tool& tool, std::string_view field, double value);

// What a user may change in a tool of this kind, with limits: diameter, length, sizes, spindle speed, teeth, feed.
struct EditableField {
  std::string name;  // "diameter_mm"
  double lowest, highest;
  bool whole;  // a whole number: teeth
};
[[nodiscard]] std::vector<EditableField> editable_fields(ToolKind kind);

// "round-burr": the name of a kind in files and messages.
[[nodiscard]] std::string_view kind_name(ToolKind kind);

}  // namespace osteon
