// Writes .vdb files without the part for delayed loading.
#pragma once
#include <openvdb/version.h>

#include <filesystem>
#include <memory>
#include <span>

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
class GridBase;
class MetaMap;
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace osteon {

// Writes the grids as openvdb::io::File::write() does, but without statistics and without the table for delayed
// loading. For that table OpenVDB 10 compresses every leaf twice, and gives a leaf without values a buffer. Programs
// that load values only when they need them then read the lengths from the leaves. Any thread.
// Throws openvdb::IoError if the file cannot be written, and what a grid's functions throw.
void write_vdb(const std::filesystem::path& file, std::span<const std::shared_ptr<const openvdb::GridBase>> grids,
               const openvdb::MetaMap& metadata);

}  // namespace osteon
