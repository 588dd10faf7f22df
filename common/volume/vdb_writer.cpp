#include "common/volume/vdb_writer.hpp"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>

#include <cstdint>
#include <fstream>
#include <memory>
#include <string>

namespace osteon {
namespace {

// OpenVDB's own functions write every part. Only their order is here.
class Writer : public openvdb::io::Archive {
 public:
  void write_file(std::ostream& os, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) const {
    namespace io = openvdb::io;
    // Grids find here how they shall be compressed.
    auto stream_metadata = std::make_shared<io::StreamMetadata>();
    io::setStreamMetadataPtr(os, stream_metadata, false);
    io::setDataCompression(os, compression());
    writeHeader(os, true);
    metadata.writeMeta(os);
    const auto count = static_cast<std::int32_t>(grids.size());
    os.write(reinterpret_cast<const char*>(&count), sizeof count);
    for (const openvdb::GridBase::ConstPtr& grid : grids) {
      if (!os) return;  // the caller says so; nothing more is compressed for a full disk
      write_grid(os, *grid);
      io::setDataCompression(os, compression());  // writing a grid changes it
    }
  }

 private:
  void write_grid(std::ostream& os, const openvdb::GridBase& grid) const {
    openvdb::io::GridDescriptor place(grid.getName(), grid.type(), grid.saveFloatAsHalf());
    place.writeHeader(os);
    const std::streampos place_at = os.tellp();
    place.writeStreamPos(os);  // written again when the positions are known
    place.setGridPos(os.tellp());
    setGridCompression(os, grid);
    grid.writeMeta(os);
    grid.writeTransform(os);
    grid.writeTopology(os);
    place.setBlockPos(os.tellp());
    grid.writeBuffers(os);
    place.setEndPos(os.tellp());
    os.seekp(place_at);
    place.writeStreamPos(os);
    place.seekToEnd(os);
  }
};

}  // namespace

template <class Grids, class Metadata>
void write_vdb(const std::filesystem::path& file, const Grids& grids, const Metadata& metadata) {
  std::ofstream os(file, std::ios::binary | std::ios::trunc);
  Writer().write_file(os, grids, metadata);
  os.close();
  if (!os) OPENVDB_THROW(openvdb::IoError, "the disk may be full or the folder closed to writing");
}

template void write_vdb(const std::filesystem::path&, const openvdb::GridCPtrVec&, const openvdb::MetaMap&);

}  // namespace osteon
