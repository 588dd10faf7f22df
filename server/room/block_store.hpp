// Making mesh blocks from a room's field, and the newest version of every block.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "common/surface/mesh_block.hpp"

namespace osteon {

[[nodiscard]] BlockPayload make_block(const BlockSamples& samples);

struct StoredBlock {
  std::uint64_t version = 0;  // rises with every change of this block, from 1
  BlockPayload payload;       // empty where no surface is left
  Digest mesh_hash;
};

class BlockStore {
 public:
  // The stored block when this changed it; null when it has these bytes already, or never had a surface and still
  // has none.
  const StoredBlock* put(const BlockKey& key, BlockPayload payload);
  [[nodiscard]] const std::map<BlockKey, StoredBlock>& blocks() const { return blocks_; }
  [[nodiscard]] Digest hash() const;  // surface_hash of the newest versions

 private:
  std::map<BlockKey, StoredBlock> blocks_;
};

}  // namespace osteon
