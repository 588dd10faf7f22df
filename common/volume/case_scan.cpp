#include "common/volume/case_scan.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <new>
#include <span>
#include <string>

#include "common/core/check.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/case.hpp"
#include "common/volume/openvdb_start.hpp"
#include "common/volume/vdb_size.hpp"

namespace osteon {
namespace {

using ScanGrid = openvdb::Int32Grid;
template <class T>
using ScanBlock = openvdb::tools::Dense<T, openvdb::tools::LayoutXYZ>;

constexpr const char *kHuGrid = "hu", *kLabelGrid = "labels", *kTissueGrid = "tissue";
constexpr std::int32_t kUsualPadding_hu = -1024;  // background: voxels that have it take no space in the file
constexpr std::uint32_t kMostScanGrids = 3;
constexpr double kReadEnd = 0.6;  // of the time to load a scan; then its hash
constexpr const char* kScanRemedy = "; import the case again";

openvdb::CoordBBox voxels_of(const ScanGeometry& geometry) {
  return {openvdb::Coord(0), openvdb::Coord(geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1)};
}

// Adds the voxels of one grid to the hash, slice by slice. False: stopped.
template <class T>
bool hash_voxels(Hasher& hasher, const char* name, const std::vector<T>& voxels, const ScanGeometry& geometry,
                 const KeepGoing& keep_going) {
  hasher.text(name);
  hasher.integer(voxels.size());
  if (voxels.empty()) return true;
  const auto slices = static_cast<std::size_t>(geometry.dims[2]), slice = voxels.size() / slices;
  for (std::size_t k = 0; k < slices; ++k) {
    if (keep_going && !keep_going(static_cast<double>(k) / static_cast<double>(slices))) return false;
    hasher.bytes(std::as_bytes(std::span(voxels).subspan(k * slice, slice)));
  }
  return true;
}

template <class T>
ScanGrid::Ptr grid_of(const char* name, const std::vector<T>& voxels, const ScanGeometry& geometry,
                      std::int32_t background) {
  // Dense takes voxels that can be changed, and copyFromDense does not change them.
  const ScanBlock<T> block(voxels_of(geometry), const_cast<T*>(voxels.data()));
  ScanGrid::Ptr grid = ScanGrid::create(background);
  openvdb::tools::copyFromDense(block, *grid, 0, true);
  grid->setName(name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  return grid;
}

template <class T>
void read_grid(openvdb::io::File& file, const char* name, const ScanGeometry& geometry, std::vector<T>& voxels) {
  if (!file.hasGrid(name)) return;
  const auto grid = openvdb::gridPtrCast<ScanGrid>(file.readGrid(name));
  if (!grid) OPENVDB_THROW(openvdb::TypeError, "grid \"" << name << "\" has no whole numbers");
  voxels.resize(geometry.count());
  ScanBlock<T> block(voxels_of(geometry), voxels.data());
  openvdb::tools::copyToDense(*grid, block, true);
}

// No grid has samples beyond the scan.
VdbLimits scan_limits(const std::filesystem::path& file, const ScanGeometry& geometry) {
  std::uint64_t leaves = 1;
  for (const int dim : geometry.dims) leaves *= static_cast<std::uint64_t>((dim + kLeafSize - 1) / kLeafSize);
  return {.memory_bytes = most_case_memory(file), .leaves = leaves, .grids = kMostScanGrids};
}

Result<void> check_values(const std::vector<std::uint8_t>& voxels, const std::vector<CaseLabel>& listed,
                          const std::string& list) {
  std::array<bool, 256> known{}, used{};
  known[0] = true;
  for (const CaseLabel& label : listed) known[static_cast<std::size_t>(label.value)] = true;
  for (const std::uint8_t value : voxels) used[value] = true;
  for (std::size_t value = 0; value < used.size(); ++value)
    if (used[value] && !known[value])
      return bad_field(list, "does not list the value " + std::to_string(value) + ", which voxels of the scan have");
  return {};
}

Result<CaseScan> read_scan_file(const std::filesystem::path& file, const ScanGeometry& geometry,
                                const KeepGoing& keep_going) try {
  start_openvdb();
  const auto stopped = [&](double done) { return keep_going && !keep_going(done); };
  CaseScan scan{.geometry = geometry};
  openvdb::io::File in(file.string());
  in.open(false);  // no delayed loading, because the file may be replaced while the program runs
  read_grid(in, kHuGrid, geometry, scan.hu);
  if (stopped(0.4)) return stopped_while("reading " + file.string());
  read_grid(in, kLabelGrid, geometry, scan.labels);
  if (stopped(0.6)) return stopped_while("reading " + file.string());
  read_grid(in, kTissueGrid, geometry, scan.tissue);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, file.string() + " takes more memory than there is");
} catch (const std::exception& e) {
  return bad_input(file.string() + " is damaged (" + e.what() + ")" + kScanRemedy);
}

}  // namespace

Result<ScanInfo> describe_scan(const CaseScan& scan, const KeepGoing& keep_going) {
  const ScanGeometry& geometry = scan.geometry;
  const auto fits = [&](std::size_t count) { return count == 0 || count == geometry.count(); };
  OSTEON_CHECK(fits(scan.hu.size()) && fits(scan.labels.size()) && fits(scan.tissue.size()));
  const KeepGoing all = keep_going ? keep_going : [](double) { return true; };
  Hasher hasher;
  for (const int dim : geometry.dims) hasher.integer(static_cast<std::uint64_t>(dim));
  if (!hash_voxels(hasher, kHuGrid, scan.hu, geometry, part(all, 0.0, 0.5)) ||
      !hash_voxels(hasher, kLabelGrid, scan.labels, geometry, part(all, 0.5, 0.75)) ||
      !hash_voxels(hasher, kTissueGrid, scan.tissue, geometry, part(all, 0.75, 1.0)))
    return stopped_while("hashing the scan");
  return ScanInfo{hasher.finish(), geometry};
}

Result<void> check_labels_of(const CaseScan& scan, const CaseInfo& info) {
  if (Result<void> known = check_values(scan.labels, info.labels, "labels"); !known) return known;
  return check_values(scan.tissue, info.tissues, "tissues");
}

Result<void> save_scan(const std::filesystem::path& file, const CaseScan& scan, const KeepGoing& keep_going) try {
  start_openvdb();
  const auto stopped = [&](double done) { return keep_going && !keep_going(done); };
  openvdb::GridPtrVec grids;
  if (!scan.hu.empty()) grids.push_back(grid_of(kHuGrid, scan.hu, scan.geometry, kUsualPadding_hu));
  if (stopped(0.2)) return stopped_while("writing the scan");
  if (!scan.labels.empty()) grids.push_back(grid_of(kLabelGrid, scan.labels, scan.geometry, 0));
  if (stopped(0.3)) return stopped_while("writing the scan");
  if (!scan.tissue.empty()) grids.push_back(grid_of(kTissueGrid, scan.tissue, scan.geometry, 0));
  if (stopped(0.4)) return stopped_while("writing the scan");
  openvdb::io::File out(file.string());
  out.write(grids);
  out.close();
  if (stopped(1.0)) return stopped_while("writing the scan");
  return {};
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory to write " + file.string());
} catch (const std::exception& e) {
  return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + e.what());
}

Result<CaseScan> load_scan(const std::filesystem::path& folder, const Case& bone, const KeepGoing& keep_going) {
  const std::filesystem::path file = folder / kScanFile;
  if (!bone.info().scan)
    return failure(ErrorCode::not_found,
                   folder.string() + " has no scan; import it again from a CT or from labelled slices");
  const ScanInfo& named = *bone.info().scan;
  if (const auto size = measure_vdb(file, scan_limits(file, named.geometry), VdbValues::integers); !size) {
    Error error = size.error();
    if (error.code != ErrorCode::exhausted) error.message += kScanRemedy;
    return tl::unexpected(error);
  }
  const KeepGoing all = keep_going ? keep_going : [](double) { return true; };
  Result<CaseScan> scan = read_scan_file(file, named.geometry, part(all, 0.0, kReadEnd));
  if (!scan) return scan;
  const Result<ScanInfo> found = describe_scan(*scan, part(all, kReadEnd, 1.0));
  if (!found) return tl::unexpected(found.error());
  if (*found != named)
    return bad_input(file.string() + " is another scan than the case describes: scan.hash differs" + kScanRemedy);
  if (const Result<void> known = check_labels_of(*scan, bone.info()); !known)
    return bad_input(file.string() + ": " + known.error().message + kScanRemedy);
  return scan;
}

}  // namespace osteon
