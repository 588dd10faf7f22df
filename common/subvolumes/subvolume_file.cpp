#include "common/subvolumes/subvolume_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>

#include "common/core/bounded_text.hpp"
#include "common/core/read_number.hpp"
#include "common/runtime/files.hpp"
#include "common/subvolumes/quadtree.hpp"

namespace osteon::subvolumes {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDirectoryBytes = 200;
constexpr std::size_t kShownBytes = 60;  // of a faulty line in an error

template <class T>
void append(std::string& text, T value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end.ptr);
}

template <class T>
void append_row(std::string& text, std::span<const T> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ' ';
    append(text, values[i]);
  }
  text += '\n';
}

template <class T>
void append_three(std::string& text, const char* keyword, const std::array<T, 3>& values) {
  text += keyword;
  text += ' ';
  append_row<T>(text, values);
}

// All that stands before the medical data.
std::string header_text(const SubVolumeData& data) {
  std::string text = "DATASET SUB-VOLUME DATA\n";
  append_three(text, "DIMENSIONS", data.dims);
  append_three(text, "SPACING", data.spacing_mm);
  append_three(text, "ORIGIN", data.origin_mm);
  text += "DATA NUMBER ";
  append(text, std::int64_t{data.dims[0]} * data.dims[1] * data.dims[2]);
  text += "\nBOUNDARY POSITION\n";
  for (int row = 0; row < static_cast<int>(data.boundary.size()); ++row) {
    const RowBoundary& ends = data.boundary[to_index(row)];
    append_row<int>(text, std::array{row, ends.first, row, ends.last, row});
  }
  return text + "MEDICAL DATA\n";
}

// A fault of a file. It is caught where the file's name is known.
struct Fault {
  int line = 0;
  std::string what;
};

// The lines of a text, one after the other.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  [[nodiscard]] std::string_view next(const char* must_be) {
    ++line_;
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos) fail(must_be);
    current_ = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return current_;
  }
  void expect(const char* line) {
    if (next(line) != line) fail(line);
  }
  // The words of a line after its keyword, as many as the array has.
  template <class T, std::size_t N>
  std::array<T, N> numbers(std::string_view keyword, const char* must_be) {
    std::string_view left = next(must_be);
    if (!left.starts_with(keyword)) fail(must_be);
    left.remove_prefix(keyword.size());
    std::array<T, N> values{};
    for (std::size_t i = 0; i < N; ++i) {
      const std::size_t end = i + 1 < N ? left.find(' ') : left.size();
      if (end == std::string_view::npos) fail(must_be);
      const auto value = read_number<T>(left.substr(0, end));
      if (!value) fail(must_be);
      values[i] = *value;
      left.remove_prefix(std::min(end + 1, left.size()));
    }
    return values;
  }
  void expect_end() const {
    if (!rest_.empty()) throw Fault{line_ + 1, "must be the end of the file"};
  }
  [[nodiscard]] std::size_t bytes_left() const { return rest_.size(); }
  [[noreturn]] void fail(const char* must_be) const { throw Fault{line_, "must be \"" + std::string(must_be) + "\""}; }

 private:
  std::string_view rest_, current_;
  int line_ = 0;
};

// A text that was parsed must be the one form of what it says.
void expect_form(std::string_view text, const std::string& form) {
  if (text == form) return;
  const auto [differs, other] = std::ranges::mismatch(text, form);
  const auto line = 1 + std::count(text.begin(), differs, '\n');
  // The line of the form: it begins after the end of the line before the difference.
  const auto at = static_cast<std::size_t>(other - form.begin());
  const std::size_t before = at == 0 ? std::string::npos : form.rfind('\n', at - 1);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  throw Fault{
      static_cast<int>(line),
      "must be written as \"" + bounded_text(form.substr(first, form.find('\n', first) - first), kShownBytes) + "\""};
}

Error about(const std::string& name, const char* kind, const Fault& fault) {
  return {ErrorCode::invalid_input, name + " is no valid " + kind + ": line " + std::to_string(fault.line) + " " +
                                        fault.what + "; write the file again with osteon-import report"};
}

SubVolumeData read_header(Lines& lines) {
  SubVolumeData data;
  lines.expect("DATASET SUB-VOLUME DATA");
  constexpr const char* kDims = "DIMENSIONS n_x n_y n_z, each from 1 to 16384";
  data.dims = lines.numbers<int, 3>("DIMENSIONS ", kDims);
  for (const int dim : data.dims)
    if (dim < 1 || dim > kLargestFileAxis) lines.fail(kDims);
  constexpr const char* kSpacing = "SPACING s_x s_y s_z, each above 0";
  data.spacing_mm = lines.numbers<double, 3>("SPACING ", kSpacing);
  for (const double spacing : data.spacing_mm)
    if (!(spacing > 0.0)) lines.fail(kSpacing);
  data.origin_mm = lines.numbers<double, 3>("ORIGIN ", "ORIGIN x_o y_o z_o");
  constexpr const char* kNumber = "DATA NUMBER d_n, the product of the dimensions";
  const std::int64_t count = std::int64_t{data.dims[0]} * data.dims[1] * data.dims[2];
  if (lines.numbers<std::int64_t, 1>("DATA NUMBER ", kNumber)[0] != count) lines.fail(kNumber);
  // A digit and what follows it: nothing is allocated for numbers that cannot be there.
  if (static_cast<std::int64_t>(lines.bytes_left()) < 2 * count)
    throw Fault{5, "must be the number of HU that follow, but there are fewer"};
  lines.expect("BOUNDARY POSITION");
  constexpr const char* kBoundary = "ROW x_1 ROW x_2 ROW: columns from 0, or twice -1 for a row without bone";
  for (int row = 0; row < data.dims[1]; ++row) {
    const auto ends = lines.numbers<int, 5>("", kBoundary);
    const bool none = ends[1] == -1 && ends[3] == -1;
    if (!none && (ends[1] < 0 || ends[1] > ends[3] || ends[3] >= data.dims[0])) lines.fail(kBoundary);
    data.boundary.push_back({ends[1], ends[3]});
  }
  lines.expect("MEDICAL DATA");
  return data;
}

void read_hu(Lines& lines, SubVolumeData& data) {
  constexpr const char* kRow = "the HU of a row: n_x whole numbers from -32768 to 32767";
  data.hu.reserve(to_index(data.dims[0]) * to_index(data.dims[1]) * to_index(data.dims[2]));
  for (std::int64_t rows = std::int64_t{data.dims[1]} * data.dims[2]; rows > 0; --rows) {
    std::string_view left = lines.next(kRow);
    for (int column = 0; column < data.dims[0]; ++column) {
      const std::size_t end = column + 1 < data.dims[0] ? left.find(' ') : left.size();
      if (end == std::string_view::npos) lines.fail(kRow);
      const auto hu = read_number<std::int16_t>(left.substr(0, end));
      if (!hu) lines.fail(kRow);
      data.hu.push_back(*hu);
      left.remove_prefix(std::min(end + 1, left.size()));
    }
  }
}

// Letters, digits, signs and inner spaces: a name that a line and a terminal can show.
bool is_directory_name(std::string_view name) {
  return !name.empty() && name.size() <= kMostDirectoryBytes && name.front() != ' ' && name.back() != ' ' &&
         std::ranges::all_of(name, [](char c) { return c >= 0x20 && c < 0x7f; });
}

std::string file_name(std::size_t number) { return "SBB" + std::to_string(number) + ".dat"; }

int digits_of(int value) {
  int digits = value < 0 ? 2 : 1;
  for (value = std::abs(value); value >= 10; value /= 10) ++digits;
  return digits;
}

std::vector<RowBoundary> boundary_of(const BoneVoxels& voxels, const CoordBox& box) {
  std::vector<RowBoundary> boundary(to_index(box.dims().y));
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      RowBoundary& row = boundary[to_index(y - box.min.y)];
      for (int x = box.min.x; x <= box.max.x; ++x) {
        if (voxels.bone[voxels.index({x, y, z})] == 0) continue;
        const int column = x - box.min.x;
        row.first = row.first < 0 ? column : std::min(row.first, column);
        row.last = std::max(row.last, column);
      }
    }
  return boundary;
}

// Everything but the HU.
SubVolumeData header_of(const BoneVoxels& voxels, const CoordBox& box) {
  SubVolumeData data;
  const Coord dims = box.dims();
  data.dims = {dims.x, dims.y, dims.z};
  const Vec3 first = voxels.geometry.position_mm(Vec3(box.min.x, box.min.y, box.min.z));
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = voxels.geometry.axes_mm.col(axis);
    data.spacing_mm[to_index(axis)] = step.norm();
    data.origin_mm[to_index(axis)] = first.dot(step.normalized());
  }
  data.boundary = boundary_of(voxels, box);
  return data;
}

}  // namespace

SubVolumeData data_of(const BoneVoxels& voxels, const CoordBox& section) {
  SubVolumeData data = header_of(voxels, section);
  for (int z = section.min.z; z <= section.max.z; ++z)
    for (int y = section.min.y; y <= section.max.y; ++y) {
      const auto row = voxels.hu.begin() + static_cast<std::ptrdiff_t>(voxels.index({section.min.x, y, z}));
      data.hu.insert(data.hu.end(), row, row + section.dims().x);
    }
  return data;
}

MetaFile meta_of(const std::vector<CoordBox>& sections, int subdivisions) {
  MetaFile meta;
  for (const CoordBox& section : sections)
    meta.entries.push_back({file_name(meta.entries.size() + 1), section.min.z, section.dims().z, subdivisions});
  return meta;
}

std::string to_text(const SubVolumeData& data) {
  std::string text = header_text(data);
  const std::size_t columns = to_index(data.dims[0]);
  for (std::size_t first = 0; first < data.hu.size(); first += columns)
    append_row<std::int16_t>(text, std::span(data.hu).subspan(first, columns));
  return text;
}

std::string to_text(const MetaFile& meta) {
  std::string text = "DATASET SUB-VOLUME META\nDIRECTORY " + meta.directory + "\nNUMBER ";
  append(text, meta.entries.size());
  text += "\nFILE START SLICES SUBDIVISIONS\n";
  for (const MetaEntry& entry : meta.entries) {
    text += entry.file + " ";
    append_row<int>(text, std::array{entry.start_slice, entry.slices, entry.subdivisions});
  }
  return text;
}

std::int64_t text_bytes(const BoneVoxels& voxels, const CoordBox& box) {
  auto bytes = static_cast<std::int64_t>(header_text(header_of(voxels, box)).size());
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      std::size_t i = voxels.index({box.min.x, y, z});
      for (int x = box.min.x; x <= box.max.x; ++x) bytes += digits_of(voxels.hu[i++]) + 1;
    }
  return bytes;
}

Result<SubVolumeData> parse_sub_volume(std::string_view text, const std::string& name) try {
  Lines lines(text);
  SubVolumeData data = read_header(lines);
  read_hu(lines, data);
  lines.expect_end();
  expect_form(text, to_text(data));
  return data;
} catch (const Fault& fault) {
  return tl::unexpected(about(name, "sub-volume file", fault));
}

Result<MetaFile> parse_meta(std::string_view text, const std::string& name) try {
  Lines lines(text);
  MetaFile meta;
  lines.expect("DATASET SUB-VOLUME META");
  constexpr const char* kDirectory = "DIRECTORY NAME, plain characters, 200 at most";
  std::string_view directory = lines.next(kDirectory);
  if (!directory.starts_with("DIRECTORY ")) lines.fail(kDirectory);
  directory.remove_prefix(std::string_view("DIRECTORY ").size());
  if (!is_directory_name(directory)) lines.fail(kDirectory);
  meta.directory = directory;
  constexpr const char* kNumber = "NUMBER n, from 1 to 16384";
  const int number = lines.numbers<int, 1>("NUMBER ", kNumber)[0];
  if (number < 1 || number > kMostFiles) lines.fail(kNumber);
  lines.expect("FILE START SLICES SUBDIVISIONS");
  constexpr const char* kEntry = "SBBn.dat START SLICES SUBDIVISIONS, in the order of n from 1 and of the slices";
  int free_slice = 0;
  for (int i = 1; i <= number; ++i) {
    const std::string file = file_name(to_index(i));
    const auto [start, slices, subdivisions] = lines.numbers<int, 3>(file + " ", kEntry);
    if (start < free_slice || start > kLargestFileAxis || slices < 1 || slices > kLargestFileAxis - start ||
        subdivisions < 0 || subdivisions > kMostSubdivisions)
      lines.fail(kEntry);
    free_slice = start + slices;
    meta.entries.push_back({file, start, slices, subdivisions});
  }
  lines.expect_end();
  expect_form(text, to_text(meta));
  return meta;
} catch (const Fault& fault) {
  return tl::unexpected(about(name, "Meta file", fault));
}

Result<std::vector<SubVolumeData>> read_sub_volumes(const fs::path& meta_file, const KeepGoing& keep_going) {
  const auto text = read_file(meta_file);
  if (!text) return tl::unexpected(text.error());
  const auto meta = parse_meta(*text, meta_file.string());
  if (!meta) return tl::unexpected(meta.error());
  std::vector<SubVolumeData> all;
  for (const MetaEntry& entry : meta->entries) {
    if (!keep_going(static_cast<double>(all.size()) / static_cast<double>(meta->entries.size())))
      return stopped_while("reading the sub-volumes");
    const fs::path file = (meta_file.parent_path() / meta->directory / entry.file).lexically_normal();
    const auto content = read_file(file);
    if (!content)
      return failure(content.error().code,
                     content.error().message + "; put the file there, because " + meta_file.string() + " lists it");
    auto data = parse_sub_volume(*content, file.string());
    if (!data) return tl::unexpected(data.error());
    if (data->dims[2] != entry.slices)
      return bad_input(file.string() + " has " + std::to_string(data->dims[2]) + " slices, but " + meta_file.string() +
                       " says " + std::to_string(entry.slices) + "; write both again with osteon-import report");
    if (!all.empty() && data->spacing_mm != all.front().spacing_mm)
      return bad_input(file.string() +
                       " has another SPACING than the sub-volumes before it; write all of them again "
                       "with osteon-import report");
    all.push_back(std::move(*data));
  }
  return all;
}

}  // namespace osteon::subvolumes
