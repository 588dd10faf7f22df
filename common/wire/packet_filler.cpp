#include "common/wire/packet_filler.hpp"

#include <map>
#include <vector>

#include "common/core/check.hpp"

namespace osteon::wire {
namespace {

void put_field(std::string& out, int field, const std::string& bytes) {
  constexpr unsigned kLengthDelimited = 2;
  const auto varint = [&](std::size_t value) {
    for (; value >= 128; value >>= 7) out += static_cast<char>(value | 128);
    out += static_cast<char>(value);
  };
  varint(static_cast<unsigned>(field) << 3 | kLengthDelimited);
  varint(bytes.size());
  out += bytes;
}

// The fields of a packet that contain runs, and the field of a run that contains its items.
template <class Packet>
struct Fields;
template <>
struct Fields<v1::UpPacket> {
  static constexpr int kRuns = v1::UpPacket::kCutsFieldNumber, kItems = v1::CutRun::kCutsFieldNumber;
};
template <>
struct Fields<v1::DownPacket> {
  static constexpr int kRuns = v1::DownPacket::kEntriesFieldNumber, kItems = v1::EntryRun::kEntriesFieldNumber;
};

}  // namespace

template <class Packet>
bool PacketFiller<Packet>::add(const Packet& part) {
  if (part.ByteSizeLong() > room()) return false;
  return part.AppendToString(&bytes_);
}

template <class Packet>
SendWindow::Picked PacketFiller<Packet>::add_items(SendWindow& window, SendWindow::Time now, int repeats) {
  const SendWindow::Picked picked = window.pick(now, room(), repeats);
  struct Run {
    std::string head, items;
  };
  std::vector<Run> runs;
  std::map<std::uint64_t, std::size_t> run_of;  // item -> its run
  const std::size_t before = bytes_.size();
  for (const std::uint64_t number : picked.numbers) {
    const SendItem& item = window.item(number);
    if (item.head.empty()) {
      bytes_ += item.bytes;  // a part of a packet by itself
      continue;
    }
    std::size_t run = runs.size();
    if (window.needs_head(number, picked))
      runs.push_back({item.head, {}});
    else
      run = run_of.at(item.follows);
    runs[run].items += item.bytes;
    run_of[number] = run;
  }
  for (Run& run : runs) {
    put_field(run.head, Fields<Packet>::kItems, run.items);
    put_field(bytes_, Fields<Packet>::kRuns, run.head);
  }
  OSTEON_CHECK(bytes_.size() - before <= picked.bytes && bytes_.size() <= most_bytes_);
  return picked;
}

template class PacketFiller<v1::UpPacket>;
template class PacketFiller<v1::DownPacket>;

}  // namespace osteon::wire
