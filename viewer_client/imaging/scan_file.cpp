#include "viewer_client/imaging/scan_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <map>
#include <new>
#include <sstream>
#include <string>
#include <system_error>

#include "common/core/read_number.hpp"

namespace osteon {

namespace {

constexpr int kMostAxis = 1 << 14;
constexpr int kMostLines = 64;

using Header = std::map<std::string, std::string>;

// The fields up to the empty line before the voxels. Empty: this is no NRRD file.
Header read_header(std::istream& in) {
  Header fields;
  std::string line;
  if (!std::getline(in, line) || !line.starts_with("NRRD")) return {};
  for (int n = 0; n < kMostLines && std::getline(in, line) && !line.empty(); ++n)
    if (const std::size_t colon = line.find(": "); colon != std::string::npos)
      fields[line.substr(0, colon)] = line.substr(colon + 2);
  return fields;
}

// The numbers of a field without its brackets and commas, the same in every locale. Empty: a word is no number.
template <class Number>
std::vector<Number> numbers_of(const Header& header, const char* name) {
  const auto found = header.find(name);
  if (found == header.end()) return {};
  std::string text = found->second;
  std::ranges::replace_if(
      text, [](char c) { return c == '(' || c == ',' || c == ')'; }, ' ');
  std::vector<Number> numbers;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto number = read_number<Number>(word);
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

bool read_geometry(const Header& header, ScanGeometry& to) {
  const auto is = [&](const char* name, const char* value) {
    const auto found = header.find(name);
    return found != header.end() && found->second == value;
  };
  if (!is("encoding", "raw") || !is("endian", "little") || !is("space", "left-posterior-superior")) return false;
  const auto dims = numbers_of<int>(header, "sizes");
  const auto axes = numbers_of<double>(header, "space directions"), origin = numbers_of<double>(header, "space origin");
  if (dims.size() != 3 || axes.size() != 9 || origin.size() != 3) return false;
  to.origin_mm = Vec3(origin[0], origin[1], origin[2]);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    to.dims[a] = dims[a];
    to.axes_mm.col(axis) = Vec3(axes[3 * a], axes[3 * a + 1], axes[3 * a + 2]);
    if (dims[a] < 1 || dims[a] > kMostAxis || !(to.axes_mm.col(axis).norm() > 0.0)) return false;
  }
  return to.axes_mm.allFinite() && to.origin_mm.allFinite();
}

template <class Value>
Result<VoxelFile<Value>> read_voxels(const std::filesystem::path& file, const char* type) try {
  std::ifstream in(file, std::ios::binary);
  if (!in) return failure(ErrorCode::not_found, "there is no file " + file.string());
  const Header header = read_header(in);
  VoxelFile<Value> read;
  const auto written = header.find("type");
  if (written == header.end() || written->second != type || !read_geometry(header, read.geometry))
    return bad_input(file.string() + " is no scan of osteon-import; open the CT again");
  const Error short_file{ErrorCode::invalid_input, file.string() + " ends early; is the disk full?"};
  std::error_code error;
  // Before a header claims memory that nothing fills.
  if (read.geometry.count() > std::filesystem::file_size(file, error) / sizeof(Value))
    return tl::unexpected(short_file);
  read.values.resize(read.geometry.count());
  const auto bytes = static_cast<std::streamsize>(read.values.size() * sizeof(Value));
  in.read(reinterpret_cast<char*>(read.values.data()), bytes);
  if (in.gcount() != bytes) return tl::unexpected(short_file);
  return read;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory for the scan in " + file.string());
}

}  // namespace

Result<ShownScan> read_scan_file(const std::filesystem::path& file) { return read_voxels<std::int16_t>(file, "int16"); }

Result<VoxelFile<std::uint8_t>> read_number_file(const std::filesystem::path& file) {
  return read_voxels<std::uint8_t>(file, "uint8");
}

std::string number_file_header(const ScanGeometry& geometry) {
  // Every number comes back bit for bit, in every locale.
  const auto number = [](double value) {
    std::array<char, 32> digits{};
    return std::string(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
  };
  const auto vector_text = [&](const Vec3& v) {
    return "(" + number(v.x()) + "," + number(v.y()) + "," + number(v.z()) + ")";
  };
  std::string header = "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes:";
  for (const int dim : geometry.dims) header += " " + std::to_string(dim);
  header += "\nspace directions:";
  for (int axis = 0; axis < 3; ++axis) header += " " + vector_text(geometry.axes_mm.col(axis));
  return header + "\nkinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: " +
         vector_text(geometry.origin_mm) + "\n\n";
}

}  // namespace osteon
