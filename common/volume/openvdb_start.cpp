#include "common/volume/openvdb_start.hpp"

#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/openvdb.h>

#include <mutex>

namespace osteon {

void start_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] {
    openvdb::initialize();
    openvdb::io::DelayedLoadMetadata::unregisterType();
  });
}

}  // namespace osteon
