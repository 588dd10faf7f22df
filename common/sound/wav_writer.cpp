#include "common/sound/wav_writer.hpp"

#include <fcntl.h>
#include <sndfile.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAsItWas = "; an older file of that name is as it was";

// libsndfile keeps the reason in errno: a full disk, or a limit of the shell.
std::error_code reason() {
  return errno != 0 ? std::error_code(errno, std::generic_category())
                    : std::make_error_code(std::errc::no_space_on_device);
}

// Renames, but replaces nothing.
std::error_code rename_to_new(const fs::path& from, const fs::path& to) {
  bool named = ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0;
  // Some file systems have only the older way to avoid replacing a file.
  if (!named && errno == EINVAL) named = ::link(from.c_str(), to.c_str()) == 0 && ::unlink(from.c_str()) == 0;
  return named ? std::error_code() : std::error_code(errno, std::generic_category());
}

}  // namespace

struct WavWriter::Impl {
  fs::path file, target, partial;
  WavFormat format;
  Unfinished unfinished = Unfinished::removed;
  Older older = Older::replaced;
  SNDFILE* out = nullptr;
  std::uint64_t frames = 0;
  std::error_code first_error;
  bool failed = false, left = false;

  ~Impl() {
    if (out) sf_close(out);
    std::error_code ignored;
    if (!left) fs::remove(partial, ignored);
  }

  Result<void> end();  // writes the header, and closes the file

  [[nodiscard]] std::string not_whole(const std::error_code& why) const {
    const bool full = why == std::errc::no_space_on_device;
    return "the sound " + file.string() + " could not be written whole (" + why.message() +
           (full ? "; make room on the disk)" : ")");
  }
  [[nodiscard]] tl::unexpected<Error> not_written(const std::error_code& why) {
    failed = true;
    first_error = why;
    // close() still decides what becomes of a sound that is kept.
    const bool kept = unfinished == Unfinished::kept;
    return failure(ErrorCode::internal, not_whole(why) + (kept ? "" : kAsItWas));
  }
  [[nodiscard]] tl::unexpected<Error> not_closed(const std::error_code& why) {
    left = unfinished == Unfinished::kept;
    return failure(ErrorCode::internal,
                   not_whole(why) + (left ? "; " + partial.string() + " has what came until then" : kAsItWas));
  }
};

Result<void> WavWriter::Impl::end() {
  errno = 0;
  // sf_close() does not say whether the disk took the header.
  sf_command(out, SFC_UPDATE_HEADER_NOW, nullptr, 0);
  const bool header = sf_error(out) == SF_ERR_NO_ERROR;
  const std::error_code now = reason();
  const bool closed = sf_close(std::exchange(out, nullptr)) == 0;
  const bool whole = !failed || unfinished == Unfinished::kept;
  if (!header || !closed || !whole) return not_closed(failed ? first_error : now);
  return {};
}

WavWriter::WavWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WavWriter::~WavWriter() = default;
WavWriter::WavWriter(WavWriter&&) noexcept = default;
WavWriter& WavWriter::operator=(WavWriter&&) noexcept = default;

Result<WavWriter> WavWriter::open(const fs::path& file, const WavFormat& format, Unfinished unfinished, Older older) {
  OSTEON_CHECK(format.channels > 0 && (format.bits == 16 || format.bits == 24));
  std::error_code error;
  // A rename would replace a link, a device or a pipe by a file.
  const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
  if (fs::is_other(target, error))
    return failure(ErrorCode::internal,
                   "cannot write the sound " + file.string() + ": it is a device or a pipe; give a file");
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  impl->target = impl->partial = target;
  impl->partial += ".partial-" + std::to_string(::getpid());
  impl->format = format;
  impl->unfinished = unfinished;
  impl->older = older;
  SF_INFO info{};
  info.samplerate = format.rate_hz;
  info.channels = format.channels;
  info.format = SF_FORMAT_WAV | (format.bits == 16 ? SF_FORMAT_PCM_16 : SF_FORMAT_PCM_24);
  errno = 0;
  impl->out = sf_open(impl->partial.c_str(), SFM_WRITE, &info);
  if (!impl->out)
    return failure(ErrorCode::internal, "cannot write the sound " + file.string() + ": " + reason().message() +
                                            "; choose a place where you may write");
  sf_command(impl->out, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  return WavWriter(std::move(impl));
}

Result<void> WavWriter::write(std::span<const float> samples) {
  const auto channels = static_cast<std::size_t>(impl_->format.channels);
  OSTEON_CHECK(samples.size() % channels == 0);
  const std::uint64_t count = samples.size() / channels;
  const auto frame_bytes = static_cast<std::uint64_t>(impl_->format.channels * impl_->format.bits / 8);
  // Behind the sample that the disk did not take whole, others would be misplaced.
  if (impl_->failed) return impl_->not_written(impl_->first_error);
  if ((impl_->frames + count) * frame_bytes > kMostBytes)
    return failure(ErrorCode::exhausted,
                   "the sound " + impl_->file.string() + " is full, because a WAV file holds 4 GB; begin another file");
  errno = 0;
  const sf_count_t taken = sf_writef_float(impl_->out, samples.data(), static_cast<sf_count_t>(count));
  impl_->frames += static_cast<std::uint64_t>(std::max<sf_count_t>(0, taken));
  if (taken != static_cast<sf_count_t>(count)) return impl_->not_written(reason());
  return {};
}

void WavWriter::update_header() { sf_command(impl_->out, SFC_UPDATE_HEADER_NOW, nullptr, 0); }

Result<void> WavWriter::close() {
  if (auto ended = impl_->end(); !ended) return ended;
  std::error_code error;
  if (impl_->older == Older::kept)
    error = rename_to_new(impl_->partial, impl_->target);
  else
    fs::rename(impl_->partial, impl_->target, error);
  if (error == std::errc::file_exists) {
    impl_->left = true;
    return failure(ErrorCode::exists, "another program made " + impl_->file.string() +
                                          " meanwhile, and it is as that program left it; " + impl_->partial.string() +
                                          " has the sound, so give it another name");
  }
  if (error) return impl_->not_closed(error);
  return {};
}

Result<fs::path> WavWriter::close_apart() {
  if (auto ended = impl_->end(); !ended) return tl::unexpected(ended.error());
  impl_->left = true;
  return impl_->partial;
}

std::uint64_t WavWriter::frames() const { return impl_->frames; }

}  // namespace osteon::sound
