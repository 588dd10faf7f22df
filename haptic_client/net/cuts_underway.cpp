#include "haptic_client/net/cuts_underway.hpp"

#include <utility>

namespace osteon {

bool CutsUnderway::push(Cut cut) {
  if (cuts_.size() >= most_) return false;
  cuts_.push_back(std::move(cut));
  return true;
}

void CutsUnderway::go_on(std::uint64_t author_seq) {
  decided(author_seq);
  next_ = 0;
  may_go_ = true;
}

void CutsUnderway::decided(std::uint64_t author_seq) {
  while (!cuts_.empty() && cuts_.front().author_seq <= author_seq) {
    cuts_.pop_front();
    if (next_ > 0) --next_;
  }
}

std::optional<Cut> CutsUnderway::take_cut() {
  if (!may_go_ || next_ >= cuts_.size()) return {};
  return cuts_[next_++];
}

std::optional<CuttingState> CutsUnderway::take_state() {
  if (!may_go_) return {};
  return std::exchange(state_, std::nullopt);
}

}  // namespace osteon
