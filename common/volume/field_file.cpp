#include "common/volume/field_file.hpp"

#include <fcntl.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <tuple>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/tools/tool_file.hpp"
#include "common/volume/openvdb_start.hpp"
#include "common/volume/vdb_size.hpp"
#include "common/volume/vdb_writer.hpp"

namespace osteon {
namespace {

using Grid = openvdb::FloatGrid;
namespace fs = std::filesystem;

constexpr std::int64_t kFormatVersion = 1;
// A body that is cut everywhere at 0.1 mm has about this many leaves. A file with more is damaged or hostile.
constexpr std::size_t kMostLeaves = 4'000'000;
constexpr std::size_t kMostBodies = 4096;
// Largest coordinate in samples. A larger one would be kilometres away from the bone.
constexpr std::int32_t kFarthestSample = 1 << 22;

constexpr VdbLimits kFieldLimits{
    .memory_bytes = std::uint64_t{16} << 30, .leaves = kMostLeaves, .grids = std::uint32_t{kMostBodies} * kLevels};

constexpr const char* kFormatKey = "osteon_format";
constexpr const char* kCaseKey = "osteon_case_hash";
constexpr const char* kKernelKey = "osteon_kernel_version";
constexpr const char* kSeqKey = "osteon_room_seq";
constexpr const char* kPitchKey = "osteon_pitch_mm";
constexpr const char* kBodiesKey = "osteon_bodies";
constexpr const char* kItemsKey = "osteon_items";
constexpr const char* kToolsKey = "osteon_tools";  // number of tools; each is stored under this key and its number
constexpr std::size_t kMostItems = 4096, kMostTools = 1024;

auto place_of(const FieldLeaf& leaf) { return std::tuple(leaf.body, leaf.level, leaf.origin); }

std::string grid_name(BodyId body, int level) {
  return "cuts.body" + std::to_string(body.value) + ".level" + std::to_string(level);
}

// The body and level of a grid's name. Only the exact form is accepted.
std::optional<std::pair<BodyId, int>> parse_name(const std::string& name) {
  unsigned body = 0, level = 0;
  if (std::sscanf(name.c_str(), "cuts.body%9u.level%1u", &body, &level) != 2) return std::nullopt;
  if (level >= static_cast<unsigned>(kLevels) || grid_name({body}, static_cast<int>(level)) != name)
    return std::nullopt;
  return std::pair(BodyId{body}, static_cast<int>(level));
}

void put_leaf(Grid& grid, const FieldLeaf& leaf) {
  const openvdb::Coord origin(leaf.origin.x, leaf.origin.y, leaf.origin.z);
  const float first = static_cast<float>(leaf.values[0]) * static_cast<float>(kQuantum_mm);
  if (std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == leaf.values[0]; })) {
    if (first != grid.background()) grid.tree().addTile(1, origin, first, true);
    return;
  }
  auto* node = grid.tree().touchLeaf(origin);
  node->setValuesOn();
  std::ranges::transform(leaf.values, node->buffer().data(),
                         [](std::int16_t v) { return static_cast<float>(v) * static_cast<float>(kQuantum_mm); });
}

// The .vdb data is followed by a word and the SHA-256 of everything before it. OpenVDB finds its grids by their offsets
// and never reads there. A damaged file must not reach OpenVDB's reader, which trusts every length that it reads.
constexpr std::string_view kSeal = "osteon-fields-1\n";
constexpr std::size_t kSealBytes = kSeal.size() + sizeof(Digest::bytes);

Result<Digest> digest_of(std::ifstream& in, const fs::path& file, std::uintmax_t bytes) {
  Hasher hasher;
  std::vector<char> part(std::size_t{1} << 20);
  while (bytes > 0) {
    const auto count = static_cast<std::size_t>(std::min<std::uintmax_t>(bytes, part.size()));
    if (!in.read(part.data(), static_cast<std::streamsize>(count)))
      return failure(ErrorCode::invalid_input, "cannot read " + file.string());
    hasher.bytes(std::as_bytes(std::span(part.data(), count)));
    bytes -= count;
  }
  return hasher.finish();
}

Result<void> seal(const fs::path& file) {
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  const auto digest = digest_of(in, file, error ? 0 : bytes);
  if (error || !digest) return failure(ErrorCode::internal, "cannot read back " + file.string());
  std::ofstream out(file, std::ios::binary | std::ios::app);
  out << kSeal;
  for (const std::uint8_t byte : digest->bytes) out.put(static_cast<char>(byte));
  out.close();
  if (!out) return failure(ErrorCode::internal, "cannot write " + file.string() + "; is the disk full?");
  return {};
}

Result<void> check_seal(const fs::path& file) {
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  const auto broken = [&](const char* why) { return failure(ErrorCode::invalid_input, file.string() + " " + why); };
  if (error || !in || bytes < kSealBytes) return broken("is not a file of cut fields");
  const auto digest = digest_of(in, file, bytes - kSealBytes);
  std::array<char, kSealBytes> end{};
  if (!digest || !in.read(end.data(), end.size())) return broken("cannot be read");
  if (std::string_view(end.data(), kSeal.size()) != kSeal) return broken("is not a whole file of cut fields");
  if (!std::equal(digest->bytes.begin(), digest->bytes.end(), end.begin() + kSeal.size(),
                  [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }))
    return broken("is damaged: its content does not match its hash");
  return {};
}

// After a power cut, the file's name must not appear with incomplete content.
Result<void> sync(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::fsync(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (!synced) return failure(ErrorCode::internal, "cannot sync " + path.string() + "; is the disk full?");
  return {};
}

// One line for each item: its number, body, tool, position, rotation (x y z w), turns, whether it is seated, and when
// it was set.
std::string text_of(const std::vector<SceneItem>& items) {
  std::string text;
  for (const SceneItem& item : items) {
    const Vec3& p = item.pose_bone_item.position_mm;
    const Eigen::Quaterniond& q = item.pose_bone_item.rotation;
    std::array<char, 400> line{};
    std::snprintf(line.data(), line.size(), "%u %u %s %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %d %llu\n",
                  item.id, item.body.value, to_hex(item.tool).c_str(), p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w(),
                  item.turns, item.seated ? 1 : 0, static_cast<unsigned long long>(item.set_at));
    text += line.data();
  }
  return text;
}

std::optional<std::vector<SceneItem>> items_of(const std::string& text) {
  std::vector<SceneItem> items;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream in(line);
    SceneItem item;
    std::string tool, rest;
    std::array<double, 8> number{};
    int seated = 0;
    in >> item.id >> item.body.value >> tool;
    for (double& value : number) in >> value;
    in >> seated >> item.set_at;
    const auto hash = digest_from_hex(tool);
    if (!in || in >> rest || !hash || item.id == 0 || seated < 0 || seated > 1 || items.size() >= kMostItems)
      return std::nullopt;
    if (!std::ranges::all_of(number, [](double v) { return std::isfinite(v) && std::abs(v) < 1e6; }))
      return std::nullopt;
    item.tool = *hash;
    item.pose_bone_item.position_mm = {number[0], number[1], number[2]};
    item.pose_bone_item.rotation = Eigen::Quaterniond(number[6], number[3], number[4], number[5]);
    if (!(std::abs(item.pose_bone_item.rotation.norm() - 1.0) < 1e-3)) return std::nullopt;
    item.turns = number[7];
    item.seated = seated == 1;
    if (!items.empty() && items.back().id >= item.id) return std::nullopt;
    items.push_back(item);
  }
  return items;
}

// Files from before the scene was saved have none.
Result<void> read_scene(const fs::path& file, const openvdb::MetaMap& meta, SavedFields& fields) {
  if (const auto text = meta.getMetadata<openvdb::StringMetadata>(kItemsKey)) {
    auto items = items_of(text->value());
    if (!items) return failure(ErrorCode::invalid_input, file.string() + ": its list of items is broken");
    fields.items = std::move(*items);
  }
  const auto count = meta.getMetadata<openvdb::Int64Metadata>(kToolsKey);
  if (count && (count->value() < 0 || count->value() > static_cast<std::int64_t>(kMostTools)))
    return failure(ErrorCode::invalid_input, file.string() + ": its list of tools is broken");
  for (std::int64_t i = 0; count && i < count->value(); ++i) {
    const auto text = meta.getMetadata<openvdb::StringMetadata>(kToolsKey + std::to_string(i));
    if (!text) return failure(ErrorCode::invalid_input, file.string() + ": its list of tools is broken");
    Result<Tool> tool = parse_tool(text->value(), file.filename().string() + ", tool " + std::to_string(i));
    if (!tool) return tl::unexpected(tool.error());
    fields.tools.push_back(std::move(*tool));
  }
  return {};
}

Result<void> write_grids(const fs::path& file, const SavedFields& fields) {
  try {
    start_openvdb();
    openvdb::GridPtrVec grids;
    Grid::Ptr grid;
    std::optional<std::pair<BodyId, int>> current;
    for (const FieldLeaf& leaf : fields.leaves) {
      const std::pair<BodyId, int> key(leaf.body, leaf.level);
      if (current != key) {
        const double pitch = level_pitch_mm(fields.pitch_mm, leaf.level);
        current = key;
        grid = Grid::create(band_mm(pitch));
        grid->setName(grid_name(leaf.body, leaf.level));
        grid->setTransform(openvdb::math::Transform::createLinearTransform(pitch));
        grids.push_back(grid);
      }
      put_leaf(*grid, leaf);
    }
    openvdb::MetaMap meta;
    meta.insertMeta(kFormatKey, openvdb::Int64Metadata(kFormatVersion));
    meta.insertMeta(kCaseKey, openvdb::StringMetadata(to_hex(fields.case_hash)));
    meta.insertMeta(kKernelKey, openvdb::Int64Metadata(fields.kernel_version));
    meta.insertMeta(kSeqKey, openvdb::Int64Metadata(static_cast<std::int64_t>(fields.room_seq.value)));
    meta.insertMeta(kPitchKey, openvdb::DoubleMetadata(fields.pitch_mm));
    std::string bodies;
    for (const BodyId body : fields.bodies) bodies += (bodies.empty() ? "" : " ") + std::to_string(body.value);
    meta.insertMeta(kBodiesKey, openvdb::StringMetadata(bodies));
    meta.insertMeta(kItemsKey, openvdb::StringMetadata(text_of(fields.items)));
    meta.insertMeta(kToolsKey, openvdb::Int64Metadata(static_cast<std::int64_t>(fields.tools.size())));
    for (std::size_t i = 0; i < fields.tools.size(); ++i)
      meta.insertMeta(kToolsKey + std::to_string(i), openvdb::StringMetadata(to_yaml(fields.tools[i])));
    write_vdb(file, openvdb::GridCPtrVec(grids.begin(), grids.end()), meta);
    return {};
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + e.what());
  }
}

Result<SavedFields> read_head(const fs::path& file, const openvdb::MetaMap& meta) {
  const auto integer = [&](const char* key) -> std::optional<std::int64_t> {
    const auto found = meta.getMetadata<openvdb::Int64Metadata>(key);
    return found ? std::optional(found->value()) : std::nullopt;
  };
  const auto format = integer(kFormatKey), kernel = integer(kKernelKey), seq = integer(kSeqKey);
  const auto name = meta.getMetadata<openvdb::StringMetadata>(kCaseKey);
  const auto pitch = meta.getMetadata<openvdb::DoubleMetadata>(kPitchKey);
  const auto bodies = meta.getMetadata<openvdb::StringMetadata>(kBodiesKey);
  if (!format || !kernel || !seq || !name || !pitch || !bodies)
    return failure(ErrorCode::invalid_input,
                   file.string() + " is not a file of cut fields: it does not say of which case and place it is");
  if (*format != kFormatVersion)
    return failure(ErrorCode::unsupported, file.string() + ": format " + std::to_string(*format) +
                                               ", but this program reads " + std::to_string(kFormatVersion));
  if (*kernel != kKernelVersion)
    return failure(ErrorCode::unsupported, file.string() + " was cut by kernel version " + std::to_string(*kernel) +
                                               ", but this program has version " + std::to_string(kKernelVersion));
  SavedFields fields;
  const auto hash = digest_from_hex(name->value());
  if (!hash) return failure(ErrorCode::invalid_input, file.string() + ": the case's hash: " + hash.error().message);
  if (*seq < 0 || !(pitch->value() >= 1e-3 && pitch->value() <= 8.0))  // 4 voxels in 16-bit quanta: at most 8 mm
    return failure(ErrorCode::invalid_input, file.string() + ": no room has such a pitch or place");
  fields.case_hash = *hash;
  fields.kernel_version = static_cast<std::uint32_t>(*kernel);
  fields.room_seq = {static_cast<std::uint64_t>(*seq)};
  fields.pitch_mm = pitch->value();
  std::uint64_t number = 0;
  bool digits = false;
  for (const char c : bodies->value() + " ") {
    if (c >= '0' && c <= '9' && number < (1u << 30)) {
      number = 10 * number + static_cast<std::uint64_t>(c - '0');
      digits = true;
      continue;
    }
    if (c != ' ' || (!digits && !bodies->value().empty()) || fields.bodies.size() >= kMostBodies)
      return failure(ErrorCode::invalid_input, file.string() + ": its list of bodies is broken");
    if (digits) fields.bodies.push_back({static_cast<std::uint32_t>(number)});
    number = 0;
    digits = false;
  }
  if (!std::ranges::is_sorted(fields.bodies, std::less_equal{}))
    return failure(ErrorCode::invalid_input, file.string() + ": its list of bodies is broken");
  return fields;
}

// Appends the leaves of one grid. Returns the fault, if any.
std::optional<std::string> read_grid(const Grid& grid, BodyId body, int level, double pitch_mm,
                                     std::vector<FieldLeaf>& out) {
  const std::int32_t band = band_quanta(level_pitch_mm(pitch_mm, level));
  if (grid.background() != band_mm(level_pitch_mm(pitch_mm, level)))
    return "its background is not the band of its level";
  const auto add = [&](const openvdb::Coord& at, const float* values, bool constant) -> std::optional<std::string> {
    FieldLeaf leaf{body, level, {at.x(), at.y(), at.z()}, {}};
    for (const std::int32_t c : {at.x(), at.y(), at.z()})
      if (c < -kFarthestSample || c > kFarthestSample) return "it has samples farther off than any bone";
    if (out.size() >= kMostLeaves) return "it has more leaves than a bone can";
    bool cut = false;
    leaf.values.resize(constant ? 1 : kLeafVoxels);
    for (std::size_t i = 0; i < leaf.values.size(); ++i) {
      const float quanta = values[i] * 1024.0f;
      if (!(quanta >= static_cast<float>(-band) && quanta <= static_cast<float>(band)) || quanta != std::floor(quanta))
        return "it has values that no cut leaves";
      leaf.values[i] = static_cast<std::int16_t>(quanta);
      cut |= leaf.values[i] != band;
    }
    if (cut) out.push_back(std::move(leaf));
    return std::nullopt;
  };
  for (auto it = grid.tree().cbeginLeaf(); it; ++it)
    if (auto wrong = add(it->origin(), it->buffer().data(), false)) return wrong;
  // Tiles, active or not: values that differ from the background count.
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(Grid::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const float value = *tile;
    if (value == grid.background()) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    // Cuts leave tiles of one leaf. A larger tile is several merged leaves, up to a limit.
    if (box.dim().x() > 128) return "it has a constant larger than any bone";
    for (auto x = box.min().x(); x <= box.max().x(); x += kLeafSize)
      for (auto y = box.min().y(); y <= box.max().y(); y += kLeafSize)
        for (auto z = box.min().z(); z <= box.max().z(); z += kLeafSize)
          if (auto wrong = add({x, y, z}, &value, true)) return wrong;
  }
  return std::nullopt;
}

}  // namespace

Result<void> save_fields(const fs::path& file, const SavedFields& fields) {
  SavedFields sorted = fields;
  std::erase_if(sorted.leaves, [&](const FieldLeaf& leaf) {
    OSTEON_CHECK(leaf.level >= 0 && leaf.level < kLevels && leaf.holds_values());
    const std::int32_t band = band_quanta(level_pitch_mm(fields.pitch_mm, leaf.level));
    return std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v == band; });
  });
  std::ranges::sort(sorted.leaves, {}, place_of);
  std::ranges::sort(sorted.bodies);
  std::error_code error;
  fs::path partial = file;
  partial += ".partial-" + std::to_string(::getpid());
  auto written = write_grids(partial, sorted);
  if (written) written = seal(partial);
  if (written) written = sync(partial);
  if (written) {
    fs::rename(partial, file, error);
    if (error)
      written = failure(ErrorCode::internal,
                        "cannot rename " + partial.string() + " to " + file.string() + ": " + error.message());
  }
  if (!written) {
    fs::remove(partial, error);
    return written;
  }
  return sync(file.has_parent_path() ? file.parent_path() : fs::path("."));
}

Result<SavedFields> load_fields(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return failure(ErrorCode::not_found, "there is no file " + file.string());
  if (const auto sealed = check_seal(file); !sealed) return tl::unexpected(sealed.error());
  if (const auto size = measure_vdb(file, kFieldLimits); !size)
    return failure(ErrorCode::invalid_input, size.error().message);
  try {
    start_openvdb();
    openvdb::io::File in(file.string());
    in.open(false);
    auto fields = read_head(file, *in.getMetadata());
    if (!fields) return fields;
    if (auto scene = read_scene(file, *in.getMetadata(), *fields); !scene) return tl::unexpected(scene.error());
    for (auto name = in.beginName(); name != in.endName(); ++name) {
      const std::string& text = name.gridName();
      const auto key = parse_name(text);
      if (!key || !std::ranges::binary_search(fields->bodies, key->first))
        return failure(ErrorCode::invalid_input,
                       file.string() + " has a grid \"" + text + "\", which is of no body and level of it");
      const auto grid = openvdb::gridPtrCast<Grid>(in.readGrid(text));
      if (!grid)
        return failure(ErrorCode::invalid_input, "grid \"" + text + "\" of " + file.string() + " is not a float grid");
      if (const auto wrong = read_grid(*grid, key->first, key->second, fields->pitch_mm, fields->leaves))
        return failure(ErrorCode::invalid_input, "grid \"" + text + "\" of " + file.string() + ": " + *wrong);
    }
    std::ranges::sort(fields->leaves, {}, place_of);
    if (std::ranges::adjacent_find(fields->leaves, {}, place_of) != fields->leaves.end())
      return failure(ErrorCode::invalid_input, file.string() + " has a leaf twice");
    return fields;
  } catch (const std::exception& e) {
    return failure(ErrorCode::invalid_input, file.string() + " is damaged or not a .vdb file (" + e.what() + ")");
  }
}

Result<SavedFields> load_fields(const fs::path& file, const Case& bone) {
  auto fields = load_fields(file);
  if (!fields) return fields;
  if (fields->case_hash != bone.hash() || fields->pitch_mm != bone.pitch_mm())
    return failure(ErrorCode::invalid_input, file.string() + " is of case " + to_hex(fields->case_hash).substr(0, 12) +
                                                 ", not of " + to_hex(bone.hash()).substr(0, 12));
  return fields;
}

}  // namespace osteon
