// Numbered items that were sent but are not yet acknowledged. They go into packet after packet until the other end
// acknowledges them. Pure: time is a parameter, bytes are opaque. One thread.
//
// The choice of items for a packet determines how long the receiver waits. The receiver passes items on in order, so a
// missing item delays all that follow. Let T be the packet interval, p the share of lost packets and R the round trip.
// An item in k packets is missing with probability p^k. A missing item is noticed a round trip later. So about p^k R/T
// of all items wait that long. For p = 0.3, R = 200 ms and T = 8 ms that is 6 % at k = 5, 0.2 % at k = 8 and 0.01 % at
// k = 10. SendRate chooses k. SendWindow.Table in unit.link prints delays and bytes for each k.
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

// `bytes` are the same in every packet. Items of one kind are shortest one after the other. A packet that also contains
// item `follows` needs no `head` before this item. Any other packet does.
struct SendItem {
  std::string bytes;
  std::string head;
  std::uint64_t follows = 0;  // an earlier item, which at most one item follows; 0: none, the head is always sent
};

struct SendWindowLimits {
  std::size_t bytes = 16 * 1024;  // of unacknowledged items, without heads
  std::size_t items = 4096;
  std::size_t bytes_per_head = 0;  // bytes that a head takes in a packet beside its own bytes, if it is not empty
};

struct SendCounts {
  std::uint64_t pushed = 0;
  std::uint64_t refused = 0;
  std::uint64_t acknowledged = 0;
  std::uint64_t sent = 0;      // items put into packets
  std::uint64_t repeated = 0;  // sent items that had been in a packet before
};

class SendWindow {
 public:
  using Time = std::chrono::nanoseconds;  // since any start, the same for every call

  // `first`: number of the first item.
  explicit SendWindow(SendWindowLimits limits = {}, std::uint64_t first = 1) : limits_(limits), oldest_(first) {}

  // Returns the item's number, one above the last. Nothing if the item would exceed the limits. An empty window accepts
  // any item.
  std::optional<std::uint64_t> push(SendItem item);
  // All items up to `upto` have arrived. `beyond` has a bit for each item after the missing upto + 1, the lowest for
  // upto + 2; a set bit means that the item has arrived. See ReceiveWindow::acknowledged() and beyond(). True if this
  // is new. Numbers that were never sent change nothing.
  bool acknowledge(std::uint64_t upto, std::uint64_t beyond = 0);
  // The other end has restarted and has exactly the items up to this number. The rest is sent as if for the first time.
  // False, with nothing changed, if this cannot be the same window: the other end lacks acknowledged items, or has
  // items that were never pushed.
  bool restart(std::uint64_t upto);

  struct Picked {
    std::vector<std::uint64_t>
        numbers;            // rising; every item's predecessor in its run is included, or its head is counted
    std::size_t bytes = 0;  // with heads; at most the budget
  };
  // Chooses the items of the packet that goes now, as far as there is room, in this order. First the oldest item once
  // its acknowledgement is overdue; it is then in every packet until it has arrived. Then items that were never sent,
  // in order and without a gap. Then items whose last transmission is older than the retransmission time. Then items in
  // fewer than `repeats` packets, the least often sent first.
  Picked pick(Time now, std::size_t budget_bytes, int repeats);
  // Smallest budget for pick() that allows the first item to go. With a smaller budget in every packet, a long item
  // would never be sent.
  [[nodiscard]] std::size_t least_room(Time now) const;
  // When pick() will next have something to send. Nothing if all items are acknowledged.
  [[nodiscard]] std::optional<Time> next_due(Time now, int repeats) const;

  // The shortest round trip measured lately; 200 ms until then.
  void set_round_trip(Time round_trip) { round_trip_ = round_trip; }
  [[nodiscard]] Time retransmission_time() const;  // an item not acknowledged for this long counts as lost

  [[nodiscard]] const SendItem& item(std::uint64_t number) const;  // an unacknowledged item
  // Whether this item needs its head, in a packet that contains exactly the picked items.
  [[nodiscard]] bool needs_head(std::uint64_t number, const Picked& picked) const;

  [[nodiscard]] std::uint64_t oldest() const { return oldest_; }  // oldest unacknowledged item; next() if there is none
  [[nodiscard]] std::uint64_t next() const { return oldest_ + waiting_.size(); }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] bool holds_fresh() const { return unsent_ > 0; }  // items that were in no packet yet
  [[nodiscard]] std::size_t items_unacknowledged() const { return waiting_.size(); }
  [[nodiscard]] std::size_t bytes_unacknowledged() const { return bytes_; }
  [[nodiscard]] const SendCounts& counts() const { return counts_; }

 private:
  struct Waiting {
    SendItem item;
    std::uint64_t follower = 0;  // the item that follows this one; 0 for none
    int sent = 0;                // packets that contained it
    int resend = 0;              // packets that must still contain it, because it counts as lost
    bool arrived = false;        // out of order: the other end already has it
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
  std::deque<Waiting> waiting_;  // items from oldest_ on
  std::size_t bytes_ = 0;
  std::uint64_t unsent_ = 0;  // items at the end that were never sent
  Time round_trip_ = std::chrono::milliseconds(200);
  SendCounts counts_;
};

}  // namespace osteon
