// The scan of a case: HU and labels of the bone's region on the scanner's own voxels, in the file scan.vdb. A program
// that only cuts does not need it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/core/sparse_bytes.hpp"
#include "common/volume/case_description.hpp"

namespace osteon {

class Case;

// A block of voxels: columns fastest, then rows, then slices. Each list has one value for each voxel, or is empty if
// the import does not know it. The case's description lists the values: CaseInfo::labels those of `labels`,
// CaseInfo::tissues those of `tissue`. A voxel may have both, such as "bone 2" and "cortical".
struct CaseScan {
  ScanGeometry geometry;
  std::vector<std::int16_t> hu = {};
  SparseBytes labels = {};  // which structure the voxel belongs to; 0: none
  SparseBytes tissue = {};  // what it is made of; 0: not known
};

inline constexpr const char* kScanFile = "scan.vdb";  // in the folder of the case

// What the description of a case says of a scan. Computes the hash of the voxels, which does not depend on how the file
// is compressed. Error: cancelled.
[[nodiscard]] Result<ScanInfo> describe_scan(const CaseScan& scan, const KeepGoing& keep_going = {});

// The first value of a voxel that the description does not list. Error: invalid_input, naming the list.
[[nodiscard]] Result<void> check_labels_of(const CaseScan& scan, const CaseInfo& info);

// Writes the grids "hu", "labels" and "tissue", those that are not empty, as int32 with one sample for each voxel:
// index (i, j, k) is column, row and slice. Memory beside the scan: some 0.3 byte for each voxel of a grid, but for
// uniform leaves. `keep_going` is called often. Errors: internal (disk), exhausted (memory), cancelled.
[[nodiscard]] Result<void> save_scan(const std::filesystem::path& file, const CaseScan& scan,
                                     const KeepGoing& keep_going = {});

// Reads the scan of a case from the case's folder. The file may be of untrusted origin. Any thread. Errors: not_found
// (the case has no scan, or the folder has no scan.vdb), invalid_input (damaged, or another scan than the case
// describes), exhausted (more memory than a file of its size may need), cancelled. Each names the file and the remedy.
[[nodiscard]] Result<CaseScan> load_scan(const std::filesystem::path& folder, const Case& bone,
                                         const KeepGoing& keep_going = {});

}  // namespace osteon
