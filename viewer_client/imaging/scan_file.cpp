#include "viewer_client/imaging/scan_file.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <new>
#include <string>

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

bool read_geometry(const Header& header, ScanGeometry& to) {
  const auto field = [&](const char* name) {
    const auto found = header.find(name);
    return found == header.end() ? std::string() : found->second;
  };
  std::array<double, 9> a{};
  Vec3& o = to.origin_mm;
  if (field("encoding") != "raw" || field("endian") != "little" || field("space") != "left-posterior-superior")
    return false;
  if (std::sscanf(field("sizes").c_str(), "%d %d %d", &to.dims[0], &to.dims[1], &to.dims[2]) != 3) return false;
  if (std::sscanf(field("space directions").c_str(), "(%lf,%lf,%lf) (%lf,%lf,%lf) (%lf,%lf,%lf)", &a[0], &a[1], &a[2],
                  &a[3], &a[4], &a[5], &a[6], &a[7], &a[8]) != 9)
    return false;
  if (std::sscanf(field("space origin").c_str(), "(%lf,%lf,%lf)", &o.x(), &o.y(), &o.z()) != 3) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = static_cast<std::size_t>(3 * axis);
    to.axes_mm.col(axis) = Vec3(a[first], a[first + 1], a[first + 2]);
    const int dim = to.dims[static_cast<std::size_t>(axis)];
    if (dim < 1 || dim > kMostAxis || !(to.axes_mm.col(axis).norm() > 0.0)) return false;
  }
  return to.axes_mm.allFinite() && o.allFinite();
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
  read.values.resize(read.geometry.count());
  const auto bytes = static_cast<std::streamsize>(read.values.size() * sizeof(Value));
  in.read(reinterpret_cast<char*>(read.values.data()), bytes);
  if (in.gcount() != bytes) return bad_input(file.string() + " ends early; is the disk full?");
  return read;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory for the scan in " + file.string());
}

}  // namespace

Result<ShownScan> read_scan_file(const std::filesystem::path& file) { return read_voxels<std::int16_t>(file, "int16"); }

Result<VoxelFile<std::uint8_t>> read_number_file(const std::filesystem::path& file) {
  return read_voxels<std::uint8_t>(file, "uint8");
}

}  // namespace osteon
