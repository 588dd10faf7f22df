#include "audio_client/output/reconnecting_output.hpp"

#include <utility>

namespace osteon::audio {

Result<void> ReconnectingOutput::fail(Error error) {
  if (output_) {
    earlier_gaps_ += output_->gaps();
    earlier_late_ += output_->late_callbacks();
  }
  output_.reset();
  trouble_ = error.message;
  return tl::unexpected(std::move(error));
}

Result<void> ReconnectingOutput::open() {
  auto opened = open_();
  if (!opened) return fail(opened.error());
  output_ = std::move(*opened);
  return {};
}

Result<void> ReconnectingOutput::start() {
  if (Result<void> started = output_->start(); !started) return fail(started.error());
  trouble_.clear();
  return {};
}

void ReconnectingOutput::maintain(Clock::time_point now, bool again) {
  if (output_) {
    const std::string why = output_->failure_reason();
    if (why.empty()) return;
    static_cast<void>(fail({ErrorCode::unavailable, why}));
    tried_ = now;
    return;
  }
  if (!again || now - tried_ < kRetryInterval) return;
  tried_ = now;
  if (open()) static_cast<void>(start());
}

void ReconnectingOutput::stop() noexcept {
  if (output_) output_->stop();
}

std::chrono::nanoseconds ReconnectingOutput::latency() const {
  return output_ ? output_->latency() : std::chrono::nanoseconds(0);
}

std::uint64_t ReconnectingOutput::gaps() const { return earlier_gaps_ + (output_ ? output_->gaps() : 0); }

std::uint64_t ReconnectingOutput::late_callbacks() const {
  return earlier_late_ + (output_ ? output_->late_callbacks() : 0);
}

}  // namespace osteon::audio
