// What was said and is not yet known to have arrived: numbered items that go into packet after packet until the other
// end acknowledges them. Pure: time is a parameter, bytes are opaque. One thread.
//
// Which items a packet takes decides how long the receiver waits, since it passes items on in order and one that is
// missing holds up all that follow. With packets every T, a share p of them lost and a round trip R, an item in k
// packets is missing with p^k, and what is missing then is noticed a round trip later: so of all items about p^k R/T
// wait that long. For p = 0.3, R = 200 ms and T = 8 ms that is 6 % at k = 5, 0.2 % at k = 8 and 0.01 % at k = 10.
// SendRate chooses k; SendWindow.Table in unit.link prints delays and bytes for each.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace osteon {

// `bytes` are the same in every packet. Items of one kind are shortest one after the other: a packet that also holds
// item `follows` needs no `head` before this one, any other packet does.
struct SendItem {
  std::string bytes;
  std::string head;
  std::uint64_t follows = 0;  // an earlier item, at most once followed; 0: none, the head always goes with it
};

struct SendWindowLimits {
  std::size_t bytes = 16 * 1024;  // of items without heads, unacknowledged
  std::size_t items = 4096;
  std::size_t bytes_per_head = 0;  // that a packet takes for a head beside its own bytes, where that is not empty
};

struct SendCounts {
  std::uint64_t pushed = 0;
  std::uint64_t refused = 0;
  std::uint64_t acknowledged = 0;
  std::uint64_t sent = 0;      // items put into packets
  std::uint64_t repeated = 0;  // of those, ones that had been in a packet before
};

class SendWindow {
 public:
  using Time = std::chrono::nanoseconds;  // since any start, the same for every call

  // `first`: number of the first item to come.
  explicit SendWindow(SendWindowLimits limits = {}, std::uint64_t first = 1) : limits_(limits), oldest_(first) {}

  // The item's number, one above the last; none while it would go beyond the limits. An empty window takes any item.
  std::optional<std::uint64_t> push(SendItem item);
  // All up to this number have arrived, and of those after the missing upto + 1 those whose bit in `beyond` is set, the
  // lowest for upto + 2: ReceiveWindow::acknowledged() and beyond(). True when that is news; numbers that were never
  // sent change nothing.
  bool acknowledge(std::uint64_t upto, std::uint64_t beyond = 0);
  // The other end has begun anew and has all up to this number, and nothing else: the rest goes as if never sent.
  // False, and nothing changes, where it cannot be the same window: it lacks what was acknowledged, or has what was
  // never pushed.
  bool restart(std::uint64_t upto);

  struct Picked {
    std::vector<std::uint64_t>
        numbers;            // rising; every item's predecessor in its run is there, or its head is paid for
    std::size_t bytes = 0;  // with heads; at most the budget
  };
  // What the packet that goes now takes, as far as there is room: the oldest item from when its acknowledgement is
  // overdue, so that it is in every packet until it has arrived; those never sent, in order and without a gap; those
  // that were last sent longer ago than the retransmission time; and those in fewer than `repeats` packets, the least
  // often sent first.
  Picked pick(Time now, std::size_t budget_bytes, int repeats);
  // Room that pick() must be given for what goes first to go: with less, packet after packet, a long item would never
  // be sent.
  [[nodiscard]] std::size_t least_room(Time now) const;
  // When pick() will next have something to send; none when all is acknowledged.
  [[nodiscard]] std::optional<Time> next_due(Time now, int repeats) const;

  // The shortest measured lately; until then 200 ms are assumed.
  void set_round_trip(Time round_trip) { round_trip_ = round_trip; }
  [[nodiscard]] Time retransmission_time() const;  // what is not acknowledged so long after it was sent counts as lost

  [[nodiscard]] const SendItem& item(std::uint64_t number) const;  // unacknowledged
  // In a packet that holds exactly the picked items: whether this one needs its head.
  [[nodiscard]] bool needs_head(std::uint64_t number, const Picked& picked) const;

  [[nodiscard]] std::uint64_t oldest() const { return oldest_; }  // unacknowledged; next() when there is none
  [[nodiscard]] std::uint64_t next() const { return oldest_ + waiting_.size(); }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] bool holds_fresh() const { return unsent_ > 0; }  // items that were in no packet yet
  [[nodiscard]] std::size_t items_unacknowledged() const { return waiting_.size(); }
  [[nodiscard]] std::size_t bytes_unacknowledged() const { return bytes_; }
  [[nodiscard]] const SendCounts& counts() const { return counts_; }

 private:
  struct Waiting {
    SendItem item;
    std::uint64_t follower = 0;  // the item that follows this one, 0 for none
    int sent = 0;                // packets that held it
    int resend = 0;              // packets that it yet goes into, since it counts as lost
    bool arrived = false;        // ahead of its turn: the other end holds it
    Time first_sent{}, last_sent{};
  };
  class Filling;
  [[nodiscard]] std::size_t head_bytes(const SendItem& item) const;
  [[nodiscard]] bool oldest_overdue(Time now) const;
  void forget_oldest();
  [[nodiscard]] const Waiting* find(std::uint64_t number) const;
  Waiting* find(std::uint64_t number) { return const_cast<Waiting*>(std::as_const(*this).find(number)); }

  SendWindowLimits limits_;
  std::uint64_t oldest_;
  std::deque<Waiting> waiting_;  // of oldest_ and on
  std::size_t bytes_ = 0;
  std::uint64_t unsent_ = 0;  // items at the end that were never sent
  Time round_trip_ = std::chrono::milliseconds(200);
  SendCounts counts_;
};

}  // namespace osteon
