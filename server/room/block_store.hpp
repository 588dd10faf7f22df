// Makes mesh blocks from a room's field, and stores the newest version of every block.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "common/surface/mesh_block.hpp"

namespace osteon {

[[nodiscard]] BlockPayload make_block(const BlockSamples& samples);

struct StoredBlock {
  std::uint64_t version = 0;  // rises with every change of this block; the first is 1
  BlockPayload payload;       // empty if no surface is left
  Digest mesh_hash;
};

// The newest version of every block. Not synchronised.
class BlockStore {
 public:
  // Returns the stored block if this call changed it. Returns null if the block already has these bytes, or if it never
  // had a surface and still has none.
  const StoredBlock* put(const BlockKey& key, BlockPayload payload);
  [[nodiscard]] const std::map<BlockKey, StoredBlock>& blocks() const { return blocks_; }
  [[nodiscard]] Digest hash() const;  // surface_hash() of the newest versions

 private:
  std::map<BlockKey, StoredBlock> blocks_;
};

}  // namespace osteon
