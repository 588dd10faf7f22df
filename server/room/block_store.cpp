#include "server/room/block_store.hpp"

#include <utility>

namespace osteon {

BlockPayload make_block(const BlockSamples& samples) { return encode_block(samples); }

const StoredBlock* BlockStore::put(const BlockKey& key, BlockPayload payload) {
  const auto known = blocks_.find(key);
  if (known == blocks_.end() ? payload.bytes.empty() : known->second.payload == payload) return nullptr;
  StoredBlock& block = blocks_[key];
  ++block.version;
  block.mesh_hash = mesh_hash(payload);
  block.payload = std::move(payload);
  return &block;
}

Digest BlockStore::hash() const {
  std::map<BlockKey, Digest> hashes;
  for (const auto& [key, block] : blocks_)
    if (!block.payload.bytes.empty()) hashes[key] = block.mesh_hash;
  return surface_hash(hashes);
}

}  // namespace osteon
