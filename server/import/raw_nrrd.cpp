#include "server/import/raw_nrrd.hpp"

#include <unistd.h>

#include <array>
#include <bit>
#include <cstdio>
#include <fstream>
#include <string>
#include <system_error>

#include "common/core/check.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "the header says so");

// "(x,y,z)" with all digits that a double has.
std::string vector_text(const Vec3& v) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.17g,%.17g,%.17g)", v.x(), v.y(), v.z());
  return text.data();
}

std::string nrrd_header(const imaging::HuVolume& grid, const char* type) {
  std::string header =
      std::string("NRRD0004\ntype: ") + type + "\ndimension: 3\nspace: left-posterior-superior\nsizes:";
  for (const int dim : grid.dims) header += " " + std::to_string(dim);
  header += "\nspace directions:";
  for (int axis = 0; axis < 3; ++axis) header += " " + vector_text(grid.directions.col(axis) * grid.spacing_mm[axis]);
  return header +
         "\nkinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: " + vector_text(grid.origin_mm) +
         "\n\n";
}

Error not_written(const fs::path& file) {
  return {ErrorCode::internal, "cannot write " + file.string() + "; is the disk full, or the folder not there?"};
}

// `voxel`: bytes of one.
Result<void> write_voxels_of(const imaging::HuVolume& grid, const char* type, const char* bytes, std::size_t voxel,
                             const fs::path& file, const KeepGoing& keep_going) {
  if (file.extension() != ".nrrd") return bad_input(file.string() + " does not end in .nrrd");
  const fs::path partial =
      file.parent_path() / (".partial-" + std::to_string(::getpid()) + "-" + file.filename().string());
  const std::size_t slice = static_cast<std::size_t>(grid.dims[0]) * static_cast<std::size_t>(grid.dims[1]) * voxel;
  Result<void> written;
  {
    std::ofstream out(partial, std::ios::binary);
    out << nrrd_header(grid, type);
    for (int k = 0; k < grid.dims[2] && out && written; ++k) {
      if (!keep_going(static_cast<double>(k) / grid.dims[2])) written = stopped_while("writing " + file.string());
      out.write(bytes + static_cast<std::size_t>(k) * slice, static_cast<std::streamsize>(slice));
    }
    out.close();
    if (!out && written) written = tl::unexpected(not_written(file));
  }
  std::error_code error;
  if (written) fs::rename(partial, file, error);
  if (error) written = tl::unexpected(not_written(file));
  if (!written) fs::remove(partial, error);
  return written;
}

}  // namespace

Result<void> write_raw_nrrd(const imaging::HuVolume& grid, std::span<const std::int16_t> hu, const fs::path& file,
                            const KeepGoing& keep_going) {
  OSTEON_CHECK(hu.size() == grid.count());
  return write_voxels_of(grid, "int16", reinterpret_cast<const char*>(hu.data()), sizeof(std::int16_t), file,
                         keep_going);
}

Result<void> write_raw_nrrd(const imaging::HuVolume& grid, std::span<const std::uint8_t> labels, const fs::path& file,
                            const KeepGoing& keep_going) {
  OSTEON_CHECK(labels.size() == grid.count());
  return write_voxels_of(grid, "uint8", reinterpret_cast<const char*>(labels.data()), 1, file, keep_going);
}

}  // namespace osteon::import
