#include "audio_client/output/wav_recorder.hpp"

#include <fcntl.h>
#include <sndfile.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>
#include <system_error>
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

std::string said(int reason) { return std::generic_category().message(reason); }

Error taken(const std::filesystem::path& file) {
  return {ErrorCode::exists, file.string() + " is already there; give --wav another name, or add --overwrite"};
}

// The file, empty, and locked until it is closed: two programs that record to one name would mix their sounds.
Result<int> empty_file(const std::filesystem::path& file, Existing existing) {
  const int flags = O_RDWR | O_CREAT | O_CLOEXEC | (existing == Existing::refused ? O_EXCL : 0);
  const int descriptor = ::open(file.c_str(), flags, 0666);
  if (descriptor < 0 && errno == EEXIST) return tl::unexpected(taken(file));
  int reason = descriptor < 0 ? errno : 0;
  if (reason == 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor);
    return failure(ErrorCode::exists, "another program records to " + file.string() + "; give --wav another name");
  }
  if (reason == 0 && ::ftruncate(descriptor, 0) != 0) reason = errno;
  if (reason == 0) return descriptor;
  if (descriptor >= 0) ::close(descriptor);
  return failure(ErrorCode::internal, "cannot write the recording " + file.string() + ": " + said(reason) +
                                          "; give --wav a file in a folder that exists and may be written");
}

}  // namespace

struct WavRecorder::Impl {
  std::filesystem::path path;
  SNDFILE* file = nullptr;
  int channels = 2;
  SpscQueue<Piece, 1024> queue;
  std::atomic<std::uint64_t> written{0}, lost{0};
  std::atomic<int> reason{0};  // why the disk took no more, an errno
  std::jthread writer;

  void drain() {
    Piece piece;
    while (queue.try_pop(piece)) {
      std::uint64_t taken = 0;
      // Behind the sample that the disk did not take whole, others would be misplaced.
      if (reason == 0) {
        errno = 0;
        taken = static_cast<std::uint64_t>(
            std::max<sf_count_t>(0, sf_writef_float(file, piece.samples.data(), piece.frames)));
        // libsndfile keeps the reason in errno.
        if (taken < piece.frames) reason = errno != 0 ? errno : ENOSPC;
      }
      written.fetch_add(taken, std::memory_order_relaxed);
      lost.fetch_add(piece.frames - taken, std::memory_order_relaxed);
    }
  }

  [[nodiscard]] std::string ended_early() const {
    if (reason == 0) return {};
    return "the recording " + path.string() + " could not be written whole (" + said(reason) +
           "), and has what came until then; make room on the disk, or give --wav a file on another one";
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

Result<WavRecorder> WavRecorder::open(const std::filesystem::path& file, unsigned rate_hz, int channels,
                                      Existing existing) {
  OSTEON_CHECK(channels == 1 || channels == 2);
  const Result<int> descriptor = empty_file(file, existing);
  if (!descriptor) return tl::unexpected(descriptor.error());
  auto impl = std::make_unique<Impl>();
  impl->path = file;
  SF_INFO info{};
  info.samplerate = static_cast<int>(rate_hz);
  info.channels = impl->channels = channels;
  info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  errno = 0;
  impl->file = sf_open_fd(*descriptor, SFM_WRITE, &info, SF_TRUE);
  if (!impl->file) {
    return failure(ErrorCode::internal,
                   "cannot write the recording " + file.string() + ": " + said(errno != 0 ? errno : EIO));
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
  errno = 0;
  const bool closed = sf_close(impl_->file) == 0;
  impl_->file = nullptr;
  if (!closed && impl_->reason == 0) impl_->reason = errno != 0 ? errno : EIO;
  if (const std::string why = trouble(); !why.empty()) return failure(ErrorCode::internal, why);
  return {};
}

std::string WavRecorder::trouble() const { return impl_->ended_early(); }

std::uint64_t WavRecorder::frames_written() const noexcept { return impl_->written.load(std::memory_order_relaxed); }
std::uint64_t WavRecorder::frames_lost() const noexcept { return impl_->lost.load(std::memory_order_relaxed); }

}  // namespace osteon::audio
