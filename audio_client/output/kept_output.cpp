#include "audio_client/output/kept_output.hpp"

#include <utility>

namespace osteon::audio {

Result<void> KeptOutput::fail(Error error) {
  if (output_) earlier_gaps_ += output_->gaps();
  output_.reset();
  trouble_ = error.message;
  return tl::unexpected(std::move(error));
}

Result<void> KeptOutput::open() {
  auto opened = open_();
  if (!opened) return fail(opened.error());
  output_ = std::move(*opened);
  return {};
}

Result<void> KeptOutput::start() {
  if (Result<void> started = output_->start(); !started) return fail(started.error());
  trouble_.clear();
  return {};
}

void KeptOutput::keep(Clock::time_point now, bool again) {
  if (output_) {
    const std::string why = output_->failure_reason();
    if (why.empty()) return;
    static_cast<void>(fail({ErrorCode::unavailable, why}));
    tried_ = now;
    return;
  }
  if (!again || now - tried_ < kAgain) return;
  tried_ = now;
  if (open()) static_cast<void>(start());
}

void KeptOutput::stop() noexcept {
  if (output_) output_->stop();
}

std::chrono::nanoseconds KeptOutput::latency() const {
  return output_ ? output_->latency() : std::chrono::nanoseconds(0);
}

std::uint64_t KeptOutput::gaps() const { return earlier_gaps_ + (output_ ? output_->gaps() : 0); }

}  // namespace osteon::audio
