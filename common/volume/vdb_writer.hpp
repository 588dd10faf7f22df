// Writes .vdb files without the table for delayed loading.
#pragma once
#include <filesystem>

namespace osteon {

// Writes the grids as openvdb::io::File::write() does, but without statistics and without the table for delayed
// loading. For that table OpenVDB 10 compresses every leaf twice, and gives a leaf without values a buffer. Programs
// that load values only when they need them then read the lengths from the leaves. Any thread. There is one version,
// for openvdb::GridCPtrVec and openvdb::MetaMap; headers do not include OpenVDB.
// Throws openvdb::IoError if the file cannot be written, and what a grid's functions throw.
template <class Grids, class Metadata>
void write_vdb(const std::filesystem::path& file, const Grids& grids, const Metadata& metadata);

}  // namespace osteon
