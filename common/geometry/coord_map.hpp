// A map from coordinates to values in one array. Finding takes a fraction of the time of std::unordered_map, which
// divides by a prime and follows pointers.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

// A pointer to a value is valid until the next insertion or removal. `Value` can be default-constructed and moved.
template <class Value>
class CoordMap {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  void clear() {
    slots_.clear();
    size_ = 0;
  }
  // Room for this many without moving any.
  void reserve(std::size_t count) {
    if (2 * count > slots_.size()) grow(std::bit_ceil(2 * count));
  }
  // Null if there is none.
  [[nodiscard]] const Value* find(Coord at) const {
    if (empty()) return nullptr;
    const Slot& slot = slots_[place_of(at)];
    return slot.used ? &slot.value : nullptr;
  }
  // The value at `at`, and whether it is new.
  std::pair<Value*, bool> insert(Coord at) {
    reserve(size_ + 1);
    Slot& slot = slots_[place_of(at)];
    const bool fresh = !slot.used;
    if (fresh) {
      slot = {at, true, Value{}};
      ++size_;
    }
    return {&slot.value, fresh};
  }
  Value& operator[](Coord at) { return *insert(at).first; }
  void erase(Coord at) {
    if (empty()) return;
    std::size_t hole = place_of(at);
    if (!slots_[hole].used) return;
    // A later one moves into the hole if a search for it would end there.
    for (std::size_t i = next(hole); slots_[i].used; i = next(i))
      if (((i - home_of(slots_[i].at)) & mask()) >= ((i - hole) & mask())) {
        slots_[hole] = std::move(slots_[i]);
        hole = i;
      }
    slots_[hole] = Slot{};
    --size_;
  }

 private:
  struct Slot {
    Coord at;
    bool used = false;
    Value value{};
  };
  // At most half of the slots are used, so a search ends soon.
  static constexpr std::size_t kFewestSlots = 16;

  [[nodiscard]] std::size_t mask() const { return slots_.size() - 1; }
  [[nodiscard]] std::size_t next(std::size_t place) const { return (place + 1) & mask(); }
  // Where a search begins. The upper bits of a product depend on all bits of its factors.
  [[nodiscard]] std::size_t home_of(Coord at) const {
    const std::uint64_t mixed = static_cast<std::uint32_t>(at.x) * 0x9e3779b97f4a7c15u +
                                static_cast<std::uint32_t>(at.y) * 0xc2b2ae3d27d4eb4fu +
                                static_cast<std::uint32_t>(at.z) * 0x165667b19e3779f9u;
    return mixed >> shift_;
  }
  // The slot of `at`, or the free one where it would be.
  [[nodiscard]] std::size_t place_of(Coord at) const {
    std::size_t place = home_of(at);
    while (slots_[place].used && slots_[place].at != at) place = next(place);
    return place;
  }
  void grow(std::size_t slots) {
    std::vector<Slot> old(std::max(slots, kFewestSlots));
    std::swap(old, slots_);
    shift_ = 64 - std::countr_zero(slots_.size());
    for (Slot& slot : old)
      if (slot.used) slots_[place_of(slot.at)] = std::move(slot);
  }

  std::vector<Slot> slots_;
  std::size_t size_ = 0;
  int shift_ = 0;
};

}  // namespace osteon
