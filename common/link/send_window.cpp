#include "common/link/send_window.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon {
namespace {

// Number of packets for an item that counts as lost. With one packet, many items would be lost again.
constexpr int kResends = 3;

}  // namespace

const SendWindow::Waiting* SendWindow::find(std::uint64_t number) const {
  return number >= oldest_ && number < next() ? &waiting_[number - oldest_] : nullptr;
}

std::optional<std::uint64_t> SendWindow::push(SendItem item) {
  const bool full = waiting_.size() >= limits_.items || bytes_ + item.bytes.size() > limits_.bytes;
  if (full && !waiting_.empty()) {
    ++counts_.refused;
    return {};
  }
  const std::uint64_t number = next();
  OSTEON_CHECK(item.follows < number);
  if (Waiting* before = find(item.follows)) {
    OSTEON_CHECK(before->follower == 0);
    before->follower = number;
  }
  bytes_ += item.bytes.size();
  waiting_.push_back({std::move(item)});
  ++unsent_;
  ++counts_.pushed;
  return number;
}

bool SendWindow::acknowledge(std::uint64_t upto, std::uint64_t beyond) {
  // An item that was never sent cannot have arrived. Such a report is wrong or belongs to another window.
  const std::uint64_t fresh = next() - unsent_;
  if (upto >= fresh) return false;
  bool news = upto >= oldest_;
  for (; oldest_ <= upto; ++oldest_) forget_oldest();
  for (std::uint64_t number = upto + 2; beyond != 0 && number < fresh; ++number, beyond >>= 1) {
    Waiting* waiting = (beyond & 1) != 0 ? find(number) : nullptr;
    if (waiting == nullptr || waiting->arrived) continue;
    waiting->arrived = news = true;
  }
  return news;
}

bool SendWindow::restart(std::uint64_t upto) {
  if (upto + 1 < oldest_ || upto >= next()) return false;
  for (; oldest_ <= upto; ++oldest_) forget_oldest();
  for (Waiting& waiting : waiting_) {
    waiting.sent = waiting.resend = 0;
    waiting.arrived = false;
  }
  unsent_ = waiting_.size();
  return true;
}

void SendWindow::forget_oldest() {
  bytes_ -= waiting_.front().item.bytes.size();
  waiting_.pop_front();
  ++counts_.acknowledged;
}

SendWindow::Time SendWindow::retransmission_time() const {
  // The acknowledgement waits for the other end's next packet, which may be lost too.
  return round_trip_ + round_trip_ / 8 + std::chrono::milliseconds(24);
}

std::size_t SendWindow::head_bytes(const SendItem& item) const {
  return item.head.empty() ? 0 : item.head.size() + limits_.bytes_per_head;
}

bool SendWindow::oldest_overdue(Time now) const {
  return unsent_ < waiting_.size() && waiting_.front().first_sent + retransmission_time() <= now;
}

std::size_t SendWindow::least_room(Time now) const {
  std::size_t room = 0;
  const auto add = [&](const Waiting& waiting) { room += waiting.item.bytes.size() + head_bytes(waiting.item); };
  if (oldest_overdue(now)) add(waiting_.front());
  if (unsent_ > 0) add(waiting_[waiting_.size() - unsent_]);
  return room;
}

// A packet that is being filled.
class SendWindow::Filling {
 public:
  Filling(SendWindow& window, std::size_t budget) : window_(window), budget_(budget), chosen_(window.waiting_.size()) {}

  // False if the packet has no room for the item.
  bool add(std::uint64_t number) {
    if (chosen(number)) return true;
    const Waiting& waiting = *window_.find(number);
    std::size_t bytes = bytes_ + waiting.item.bytes.size();
    if (!chosen(waiting.item.follows)) bytes += window_.head_bytes(waiting.item);
    if (chosen(waiting.follower)) bytes -= window_.head_bytes(window_.find(waiting.follower)->item);
    if (bytes > budget_) return false;
    bytes_ = bytes;
    chosen_[number - window_.oldest_] = true;
    return true;
  }

  Picked take(Time now) {
    Picked picked{{}, bytes_};
    for (std::uint64_t number = window_.oldest_; number < window_.next(); ++number) {
      if (!chosen(number)) continue;
      Waiting& waiting = *window_.find(number);
      ++window_.counts_.sent;
      if (waiting.sent > 0) {
        ++window_.counts_.repeated;
      } else {
        --window_.unsent_;
        waiting.first_sent = now;
      }
      ++waiting.sent;
      waiting.resend = std::max(0, waiting.resend - 1);
      waiting.last_sent = now;
      picked.numbers.push_back(number);
    }
    return picked;
  }

 private:
  [[nodiscard]] bool chosen(std::uint64_t number) const {
    return number >= window_.oldest_ && number < window_.next() && chosen_[number - window_.oldest_];
  }

  SendWindow& window_;
  std::size_t budget_;
  std::vector<bool> chosen_;
  std::size_t bytes_ = 0;
};

SendWindow::Picked SendWindow::pick(Time now, std::size_t budget_bytes, int repeats) {
  if (waiting_.empty()) return {};
  Filling packet(*this, budget_bytes);
  // Of the items in flight, the oldest has mostly arrived and is no neighbour of the others. Added alone, it would need
  // a head of its own in every packet. So it goes only when it is overdue.
  if (oldest_overdue(now)) packet.add(oldest_);
  const std::uint64_t fresh = next() - unsent_;
  for (std::uint64_t number = fresh; number < next(); ++number)
    if (!packet.add(number)) return packet.take(now);
  // Items that were in flight during a burst of losses go before repeats of others, because all later items wait for
  // them.
  for (std::uint64_t number = oldest_; number < fresh; ++number) {
    Waiting& waiting = *find(number);
    if (waiting.arrived) continue;
    if (waiting.last_sent + retransmission_time() <= now) waiting.resend = kResends;
    if (waiting.resend > 0 && !packet.add(number)) return packet.take(now);
  }
  // Items were sent in order, so the least often sent are the last. Starting there, the items of a packet are
  // neighbours and share one head.
  for (std::uint64_t number = fresh; number-- > oldest_;)
    if (find(number)->sent < repeats && !find(number)->arrived && !packet.add(number)) break;
  return packet.take(now);
}

std::optional<SendWindow::Time> SendWindow::next_due(Time now, int repeats) const {
  if (waiting_.empty()) return {};
  if (unsent_ > 0) return now;
  Time due = Time::max();
  for (const Waiting& waiting : waiting_) {
    if (waiting.arrived) continue;
    if (waiting.sent < repeats || waiting.resend > 0) return now;
    due = std::min(due, waiting.last_sent + retransmission_time());
  }
  return std::max(due, now);
}

const SendItem& SendWindow::item(std::uint64_t number) const {
  const Waiting* waiting = find(number);
  OSTEON_CHECK(waiting != nullptr);
  return waiting->item;
}

bool SendWindow::needs_head(std::uint64_t number, const Picked& picked) const {
  const std::uint64_t before = item(number).follows;
  return before == 0 || !std::ranges::binary_search(picked.numbers, before);
}

}  // namespace osteon
