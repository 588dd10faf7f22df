#include "common/link/path_watch.hpp"

#include <utility>

namespace osteon {

PathWatch::PathWatch(FillRandom random, const PathRules& rules) : random_(std::move(random)), rules_(rules) {}

void PathWatch::received(const Endpoint& from, bool newest, std::size_t bytes, std::chrono::nanoseconds now) {
  forget_unproven(now);
  if (newest && from == address_) {
    candidate_.reset();  // the peer is at its address: it has returned, or never left
  } else if (newest && !(candidate_ && candidate_->address == from)) {
    candidate_ = Candidate{.address = from, .token = {}, .next_try = now, .forgotten_at = now + rules_.forgotten_after};
    random_(candidate_->token);
  }
  if (candidate_ && candidate_->address == from) candidate_->received += bytes;
}

bool PathWatch::echoed(const Endpoint& from, const PathToken& token, std::chrono::nanoseconds now) {
  forget_unproven(now);
  // Nobody knows a token that was not sent yet. It is checked anyway, because the source of random bytes is a
  // parameter.
  if (!candidate_ || candidate_->tries == 0 || candidate_->address != from || candidate_->token != token) return false;
  address_ = from;
  candidate_.reset();
  ++moves_;
  return true;
}

std::optional<PathWatch::Challenge> PathWatch::challenge_due(std::size_t bytes, std::chrono::nanoseconds now) {
  forget_unproven(now);
  if (!candidate_ || candidate_->tries == rules_.tries || now < candidate_->next_try) return {};
  // waits until more bytes have arrived
  if (candidate_->sent + bytes > rules_.most_sent * candidate_->received) return {};
  candidate_->sent += bytes;
  ++candidate_->tries;
  candidate_->next_try = now + rules_.retry_after;
  return Challenge{candidate_->address, candidate_->token};
}

void PathWatch::forget_unproven(std::chrono::nanoseconds now) {
  if (candidate_ && now >= candidate_->forgotten_at) candidate_.reset();
}

}  // namespace osteon
