#include "common/runtime/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace osteon {

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) == 1) { update(0.0); }

Progress::~Progress() {
  if (terminal_) std::fputc('\n', stderr);
}

void Progress::update(double fraction) {
  const int percent = static_cast<int>(100.0 * std::clamp(fraction, 0.0, 1.0));
  const int step = terminal_ ? percent : percent / 10;
  if (step == shown_) return;
  shown_ = step;
  if (!terminal_) {
    std::fprintf(stderr, "%s: %d %%\n", what_.c_str(), percent);
    return;
  }
  static constexpr int kWidth = 40;
  const std::string bar(static_cast<std::size_t>(percent * kWidth / 100), '#');
  std::fprintf(stderr, "\r%-24s [%-*s] %3d %%", what_.c_str(), kWidth, bar.c_str(), percent);
  std::fflush(stderr);
}

}  // namespace osteon
