// Bytes of which most are 0.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/core/check.hpp"

namespace osteon {

// A list of bytes. A block of 256 takes 4 bytes if all of them are 0; otherwise 40 more, and one for each that is not
// 0. Reading takes constant time. Bytes are added at the end and never change.
class SparseBytes {
 public:
  SparseBytes() = default;
  explicit SparseBytes(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) push_back(byte);
  }

  void push_back(std::uint8_t byte) {
    const std::size_t within = size_++ % kBlockSize;
    if (within == 0) block_of_.push_back(kZeros);
    if (byte == 0) return;
    if (block_of_.back() == kZeros) {
      OSTEON_CHECK(values_.size() < kZeros);
      block_of_.back() = static_cast<std::uint32_t>(blocks_.size());
      blocks_.push_back({.bits = {}, .before = {}, .first = static_cast<std::uint32_t>(values_.size())});
    }
    Block& block = blocks_.back();
    block.bits[within / 64] |= std::uint64_t{1} << within % 64;
    for (std::size_t word = within / 64 + 1; word < block.before.size(); ++word) ++block.before[word];
    values_.push_back(byte);
  }

  [[nodiscard]] std::uint8_t operator[](std::size_t i) const {
    const std::uint32_t number = block_of_[i / kBlockSize];
    if (number == kZeros) return 0;
    const Block& block = blocks_[number];
    const std::size_t word = i % kBlockSize / 64;
    const std::uint64_t bit = std::uint64_t{1} << i % 64;
    if ((block.bits[word] & bit) == 0) return 0;
    return values_[block.first + block.before[word] + ones(block.bits[word] & (bit - 1))];
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  // Those that are not 0, in order.
  [[nodiscard]] std::span<const std::uint8_t> values() const { return values_; }
  // All of them.
  [[nodiscard]] std::vector<std::uint8_t> dense() const {
    std::vector<std::uint8_t> bytes(size_);
    for (std::size_t i = 0; i < size_; ++i) bytes[i] = (*this)[i];
    return bytes;
  }

  bool operator==(const SparseBytes& other) const = default;

 private:
  // How many bits are 1. Without an option for newer processors, std::popcount() calls a library.
  static constexpr std::size_t ones(std::uint64_t bits) {
    bits -= bits >> 1 & 0x5555555555555555u;
    bits = (bits & 0x3333333333333333u) + (bits >> 2 & 0x3333333333333333u);
    return ((bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu) * 0x0101010101010101u >> 56;
  }

  static constexpr std::size_t kBlockSize = 256;
  static constexpr std::uint32_t kZeros = std::numeric_limits<std::uint32_t>::max();

  struct Block {
    std::array<std::uint64_t, kBlockSize / 64> bits;   // 1: the byte is not 0
    std::array<std::uint8_t, kBlockSize / 64> before;  // how many are not 0 in the words before
    std::uint32_t first;                               // of its values in values_

    bool operator==(const Block& other) const = default;
  };

  std::size_t size_ = 0;
  std::vector<std::uint32_t> block_of_;  // of each 256 bytes; kZeros: all are 0
  std::vector<Block> blocks_;
  std::vector<std::uint8_t> values_;
};

}  // namespace osteon
