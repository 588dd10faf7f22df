#include "audio_client/output/wav_recorder.hpp"

#include <sndfile.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "common/core/check.hpp"
#include "common/runtime/spsc_queue.hpp"

namespace osteon::audio {
namespace {

constexpr std::size_t kPieceFrames = 256;

struct Piece {
  std::array<float, 2 * kPieceFrames> samples;  // of all channels, frame after frame
  std::uint32_t frames;
};

}  // namespace

struct WavRecorder::Impl {
  std::filesystem::path path;
  SNDFILE* file = nullptr;
  int channels = 2;
  SpscQueue<Piece, 1024> queue;
  std::atomic<std::uint64_t> written{0}, lost{0};
  std::atomic<bool> write_failed{false};
  std::jthread writer;

  void drain() {
    Piece piece;
    while (queue.try_pop(piece)) {
      const sf_count_t frames = piece.frames;
      if (sf_writef_float(file, piece.samples.data(), frames) != frames) write_failed = true;
      written.fetch_add(piece.frames, std::memory_order_relaxed);
    }
  }

  void run(const std::stop_token& stop) {
    int turns = 0;
    while (!stop.stop_requested()) {
      drain();
      // The header is updated once a second, so that the recording of a killed program is readable.
      if (++turns % 50 == 0) sf_command(file, SFC_UPDATE_HEADER_NOW, nullptr, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
};

WavRecorder::WavRecorder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WavRecorder::WavRecorder(WavRecorder&&) noexcept = default;

WavRecorder& WavRecorder::operator=(WavRecorder&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

WavRecorder::~WavRecorder() {
  if (impl_) [[maybe_unused]]
    const Result<void> closed = close();
}

Result<WavRecorder> WavRecorder::open(const std::filesystem::path& file, unsigned rate_hz, int channels) {
  OSTEON_CHECK(channels == 1 || channels == 2);
  auto impl = std::make_unique<Impl>();
  impl->path = file;
  SF_INFO info{};
  info.samplerate = static_cast<int>(rate_hz);
  info.channels = impl->channels = channels;
  info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  impl->file = sf_open(file.c_str(), SFM_WRITE, &info);
  if (!impl->file) {
    return failure(ErrorCode::internal, "cannot write the recording " + file.string() + ": " + sf_strerror(nullptr));
  }
  sf_command(impl->file, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  impl->writer = std::jthread([raw = impl.get()](const std::stop_token& stop) { raw->run(stop); });
  return WavRecorder(std::move(impl));
}

void WavRecorder::push(std::span<const float> left, std::span<const float> right) noexcept {
  for (std::size_t done = 0; done < left.size();) {
    Piece piece;
    const std::size_t frames = std::min(left.size() - done, kPieceFrames);
    piece.frames = static_cast<std::uint32_t>(frames);
    for (std::size_t i = 0; i < frames; ++i) {
      const float l = left[done + i], r = right[done + i];
      if (impl_->channels == 1) {
        piece.samples[i] = 0.5F * (l + r);
      } else {
        piece.samples[2 * i] = l;
        piece.samples[2 * i + 1] = r;
      }
    }
    if (!impl_->queue.try_push(piece)) impl_->lost.fetch_add(frames, std::memory_order_relaxed);
    done += frames;
  }
}

Result<void> WavRecorder::close() {
  if (!impl_->file) return {};
  impl_->writer.request_stop();
  impl_->writer.join();
  impl_->drain();
  sf_write_sync(impl_->file);
  const bool failed = sf_close(impl_->file) != 0 || impl_->write_failed;
  impl_->file = nullptr;
  if (failed)
    return failure(ErrorCode::internal, "the recording " + impl_->path.string() + " could not be written whole");
  return {};
}

std::uint64_t WavRecorder::frames_written() const noexcept { return impl_->written.load(std::memory_order_relaxed); }
std::uint64_t WavRecorder::frames_lost() const noexcept { return impl_->lost.load(std::memory_order_relaxed); }

}  // namespace osteon::audio
