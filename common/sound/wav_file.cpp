#include "common/sound/wav_file.hpp"

#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "common/core/read_number.hpp"
#include "common/sound/wav_writer.hpp"

namespace osteon::sound {
namespace {

namespace fs = std::filesystem;

struct Close {
  void operator()(SNDFILE* file) const { sf_close(file); }
};
using SoundFile = std::unique_ptr<SNDFILE, Close>;

std::uint64_t little_endian(const unsigned char* bytes) {
  return static_cast<std::uint64_t>(bytes[0]) | static_cast<std::uint64_t>(bytes[1]) << 8U |
         static_cast<std::uint64_t>(bytes[2]) << 16U | static_cast<std::uint64_t>(bytes[3]) << 24U;
}

std::string shown(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

// What the chunks say of the sound.
struct Chunks {
  std::uint64_t frame_bytes = 0;  // BlockAlign
  std::uint64_t announced = 0;    // bytes of data; kUnknown if the header does not say
  std::uint64_t there = 0;        // bytes of data in the file
  std::uint64_t no_size_at = 0;   // place of a size of data that is 0 although there are some; else 0
};
constexpr std::uint64_t kUnknown = 0xFFFFFFFF;  // a streaming recorder leaves it; RF64 says more in its chunk ds64
constexpr int kMostChunks = 1000;               // a file of zeros has no end of empty ones

// libsndfile takes a file that was cut off for a shorter one, and names no reason for other files. So the chunks are
// walked through here first.
Result<Chunks> chunks_behind(const fs::path& file, std::ifstream& in, std::uint64_t size, bool rf64) {
  Chunks chunks;
  std::uint64_t long_size = kUnknown;
  bool format = false;
  std::array<unsigned char, 24> bytes{};
  const std::string_view letters(reinterpret_cast<const char*>(bytes.data()), 4);
  std::uint64_t at = 12;
  for (int count = 0; count < kMostChunks && at + 8 <= size; ++count) {
    bytes.fill(0);
    in.clear();
    in.seekg(static_cast<std::streamoff>(at));
    in.read(reinterpret_cast<char*>(bytes.data()), bytes.size());  // the last chunk may be shorter
    const std::uint64_t length = little_endian(bytes.data() + 4);
    at += 8;
    if (letters == "ds64") long_size = little_endian(bytes.data() + 16) | little_endian(bytes.data() + 20) << 32U;
    if (letters == "fmt ") format = true, chunks.frame_bytes = little_endian(bytes.data() + 20) & 0xFFFFU;
    if (letters == "data" && format) {
      chunks.announced = rf64 && length == kUnknown ? long_size : length;
      chunks.there = std::min(chunks.announced, size - at);
      // A recorder that writes the size last, and lost power.
      if (chunks.announced == 0 && size > at) chunks = {chunks.frame_bytes, kUnknown, size - at, at - 4};
      return chunks;
    }
    at += length + (length & 1U);
  }
  return bad_input(file.string() + " is truncated: it has no chunk \"" + (format ? "data" : "fmt ") +
                   "\"; copy or record it again");
}

Result<Chunks> chunks_of(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) return bad_input(file.string() + " is a folder; give a WAV file in it");
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file.string() + "; give the path of a WAV recording");
  // A pipe would wait for its writer.
  if (!fs::is_regular_file(file, error))
    return bad_input(file.string() + " is a device or a pipe; give a WAV file on a disk");
  std::ifstream in(file, std::ios::binary);
  const std::uintmax_t size = fs::file_size(file, error);
  if (!in || error)
    return failure(ErrorCode::not_found, "cannot read " + file.string() + "; give a file that you may read");
  if (size == 0) return bad_input(file.string() + " is empty, with no byte in it; give a WAV recording");

  std::array<char, 12> header{};
  in.read(header.data(), header.size());
  const std::string_view letters(header.data(), header.size());
  const bool rf64 = letters.substr(0, 4) == "RF64";
  if (!in || (letters.substr(0, 4) != "RIFF" && !rf64) || letters.substr(8) != "WAVE")
    return bad_input(file.string() + " is no WAV file, because its ChunkID and Format are not RIFF (or RF64) and " +
                     "WAVE; convert the recording to WAV");
  return chunks_behind(file, in, size, rf64);
}

// A file in which the size of the data reads as unknown. libsndfile takes what is there then, but nothing for a size of
// 0.
struct MendedFile {
  std::ifstream in;
  std::uint64_t size = 0, size_at = 0;

  static MendedFile& of(void* self) { return *static_cast<MendedFile*>(self); }
  static sf_count_t length(void* self) { return static_cast<sf_count_t>(of(self).size); }
  static sf_count_t tell(void* self) { return of(self).in.tellg(); }
  static sf_count_t seek(sf_count_t offset, int whence, void* self) {
    std::ifstream& in = of(self).in;
    in.clear();
    in.seekg(offset, whence == SEEK_SET ? std::ios::beg : whence == SEEK_CUR ? std::ios::cur : std::ios::end);
    return in.tellg();
  }
  static sf_count_t read(void* to, sf_count_t count, void* self) {
    MendedFile& file = of(self);
    const auto begin = static_cast<std::uint64_t>(static_cast<sf_count_t>(file.in.tellg()));
    file.in.read(static_cast<char*>(to), count);
    const auto got = static_cast<std::uint64_t>(file.in.gcount());
    file.in.clear();
    for (std::uint64_t at = std::max(begin, file.size_at); at < std::min(begin + got, file.size_at + 4); ++at)
      static_cast<unsigned char*>(to)[at - begin] = 0xFF;
    return static_cast<sf_count_t>(got);
  }
  static sf_count_t write(const void* /*from*/, sf_count_t /*count*/, void* /*self*/) { return 0; }
};

SNDFILE* open_sound(const fs::path& file, const Chunks& chunks, MendedFile& mended, SF_INFO& info) {
  if (chunks.no_size_at == 0) return sf_open(file.c_str(), SFM_READ, &info);
  std::error_code ignored;
  mended.in.open(file, std::ios::binary);
  mended.size = fs::file_size(file, ignored), mended.size_at = chunks.no_size_at;
  SF_VIRTUAL_IO calls{&MendedFile::length, &MendedFile::seek, &MendedFile::read, &MendedFile::write, &MendedFile::tell};
  return sf_open_virtual(&calls, SFM_READ, &info, &mended);
}

struct SampleFormat {
  int bits = 16;
  bool floating = false;
};

Result<SampleFormat> format_of(const fs::path& file, int format) {
  const int kind = format & SF_FORMAT_TYPEMASK;
  if (kind == SF_FORMAT_WAV || kind == SF_FORMAT_WAVEX || kind == SF_FORMAT_RF64) {
    switch (format & SF_FORMAT_SUBMASK) {
      case SF_FORMAT_PCM_U8:
        return SampleFormat{8, false};
      case SF_FORMAT_PCM_16:
        return SampleFormat{16, false};
      case SF_FORMAT_PCM_24:
        return SampleFormat{24, false};
      case SF_FORMAT_PCM_32:
        return SampleFormat{32, false};
      case SF_FORMAT_FLOAT:
        return SampleFormat{32, true};
      case SF_FORMAT_DOUBLE:
        return SampleFormat{64, true};
      default:
        break;
    }
  }
  return failure(ErrorCode::unsupported,
                 file.string() + ": AudioFormat is neither PCM nor float; convert it to PCM WAV of 16 bits");
}

// The frames that are asked for.
struct FrameRange {
  sf_count_t first = 0, count = 0;
};

Result<FrameRange> checked_range(const fs::path& file, const SF_INFO& info, const WavPart& part) {
  const std::string name = file.string();
  if (info.channels > kMostChannels)
    return failure(ErrorCode::unsupported, name + ": NumChannels is " + std::to_string(info.channels) +
                                               "; give a recording with at most " + std::to_string(kMostChannels));
  if (part.channel && static_cast<int>(*part.channel) > info.channels)
    return bad_input(name + ": NumChannels is " + std::to_string(info.channels) + ", without a channel " +
                     std::to_string(static_cast<int>(*part.channel)) + "; give --channel another number");
  if (info.samplerate < kLowestRate_hz || info.samplerate > kHighestRate_hz)
    return failure(ErrorCode::unsupported,
                   name + ": SampleRate is " + std::to_string(info.samplerate) + " Hz, outside " +
                       std::to_string(kLowestRate_hz) + " to " + std::to_string(kHighestRate_hz) +
                       " Hz; the analysis needs all up to 11025 Hz, so record it with 44100 Hz");
  if (info.frames == 0)
    return bad_input(name + " is empty: Subchunk2Size of its data is 0; give a recording with samples");
  const double file_s = static_cast<double>(info.frames) / info.samplerate;
  const double to_s = part.to_s.value_or(file_s), seconds = to_s - part.from_s;
  if (part.from_s < 0 || to_s > file_s + 0.5 / info.samplerate || seconds <= 0)
    return bad_input(name + ": --from and --to must be two times within its " + shown(file_s) + " s, in this order");
  const char* whose = part.to_s || part.from_s > 0 ? ": the part lasts " : ": its data last ";
  if (seconds < kShortest_s)
    return bad_input(name + whose + shown(seconds) + " s; give at least " + shown(kShortest_s) + " s");
  if (seconds > kLongest_s)
    return bad_input(name + whose + shown(seconds) + " s; choose a part of at most " + shown(kLongest_s) +
                     " s by --from and --to");
  const auto first = static_cast<sf_count_t>(std::llround(part.from_s * info.samplerate));
  const auto last = std::min(info.frames, static_cast<sf_count_t>(std::llround(to_s * info.samplerate)));
  return FrameRange{first, last - first};
}

// One sample of a frame, or nothing if the channels differ and none was chosen.
std::optional<float> sample_of(std::span<const float> frame, std::optional<Channel> channel) {
  if (!channel) {
    if (std::ranges::any_of(frame.subspan(1), [&](float x) { return x != frame[0]; })) return std::nullopt;
    return frame[0];
  }
  if (*channel != Channel::mean) return frame[static_cast<std::size_t>(*channel) - 1];
  float sum = 0;
  for (const float x : frame) sum += x;
  return sum / static_cast<float>(frame.size());
}

// Counts the frames in which a channel is clipped.
class ClippedFrames {
 public:
  // A converter holds what it cannot measure at its last value: 127/128 for 8 bits. Others stop just below 1.
  explicit ClippedFrames(int bits) : full_(bits == 8 ? 0.992F : 0.9999F) {}

  void add(std::span<const float> frame, std::optional<Channel> channel) {
    std::size_t first = 0, count = 1;  // without a choice all channels are equal
    if (channel == Channel::mean)
      count = frame.size();
    else if (channel)
      first = static_cast<std::size_t>(*channel) - 1;
    bool held = false;
    for (std::size_t i = 0; i < count; ++i) {
      const float x = frame[first + i];
      held |= std::abs(x) >= full_ && x == before_[i];
      before_[i] = x;
    }
    // The frame at which it begins counts too.
    count_ += held ? (held_ ? 1 : 2) : 0;
    held_ = held;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  float full_;
  std::array<float, kMostChannels> before_{};
  bool held_ = false;
  std::size_t count_ = 0;
};

// In blocks, so that an hour with many channels takes no more memory than the part of one that is kept.
Result<std::vector<float>> read_samples(const fs::path& file, SNDFILE* in, const SF_INFO& info, const FrameRange& range,
                                        std::optional<Channel> channel, ClippedFrames& clipped) {
  constexpr std::size_t kBlock = 65536;  // samples of all channels
  // More is no sound, but numbers for something else, and their squares would overflow.
  constexpr float kMost = 1e6F;
  const auto channels = static_cast<std::size_t>(info.channels);
  const std::size_t frames = kBlock / channels;
  std::vector<float> samples, block(frames * channels);
  samples.reserve(static_cast<std::size_t>(range.count));
  if (sf_seek(in, range.first, SEEK_SET) != range.first)
    return bad_input(file.string() + " is truncated: --from is behind its end; copy it again");
  while (std::ssize(samples) < range.count) {
    const auto wanted = std::min(static_cast<sf_count_t>(frames), range.count - std::ssize(samples));
    const sf_count_t got = sf_readf_float(in, block.data(), wanted);
    for (std::size_t i = 0; std::cmp_less(i, got); ++i) {
      const std::span<const float> frame = std::span(block).subspan(i * channels, channels);
      const auto x = sample_of(frame, channel);
      if (!x)
        return failure(ErrorCode::unsupported,
                       file.string() + ": NumChannels is " + std::to_string(channels) +
                           "; choose one with --channel left, right or its number, or take --channel mean");
      if (!(std::abs(*x) <= kMost))
        return bad_input(file.string() + ": sample " + std::to_string(range.first + std::ssize(samples)) + " is " +
                         (std::isnan(*x) ? "not a number" : "far beyond full scale") + "; export it again");
      samples.push_back(*x);
      clipped.add(frame, channel);
    }
    if (got < wanted) break;
  }
  return samples;
}

}  // namespace

std::optional<Channel> channel_of(std::string_view name) {
  if (name == "left") return Channel::left;
  if (name == "right") return Channel::right;
  if (name == "mean") return Channel::mean;
  const auto number = read_number<int>(name);
  if (!number || *number < 1 || *number > kMostChannels) return std::nullopt;
  return static_cast<Channel>(*number);
}

Result<WavSound> read_wav(const fs::path& file, const WavPart& part) {
  const Result<Chunks> chunks = chunks_of(file);
  if (!chunks) return tl::unexpected(chunks.error());
  SF_INFO info{};
  MendedFile mended;
  const SoundFile in(open_sound(file, *chunks, mended, info));
  if (!in)
    return bad_input(
        "cannot read " + file.string() +
        ": its chunk \"fmt \" is damaged, or of a kind that Osteon does not know; convert it to PCM WAV of "
        "16 bits");
  const Result<SampleFormat> format = format_of(file, info.format);
  if (!format) return tl::unexpected(format.error());
  // Whatever the header says, no more is there.
  if (chunks->frame_bytes > 0)
    info.frames = std::min(info.frames, static_cast<sf_count_t>(chunks->there / chunks->frame_bytes));
  const Result<FrameRange> range = checked_range(file, info, part);
  if (!range) return tl::unexpected(range.error());
  ClippedFrames clipped(format->bits);
  auto samples = read_samples(file, in.get(), info, *range, part.channel, clipped);
  if (!samples) return tl::unexpected(samples.error());
  if (std::cmp_less(samples->size(), range->count))
    return bad_input(file.string() + " is truncated: its data end too early; copy or record it again");
  WavSound sound{.rate_hz = info.samplerate,
                 .channels = info.channels,
                 .bits = format->bits,
                 .floating = format->floating,
                 .from_s = static_cast<double>(range->first) / info.samplerate,
                 .file_s = static_cast<double>(info.frames) / info.samplerate,
                 .announced_s = {},
                 .clipped = clipped.count(),
                 .samples = std::move(*samples)};
  if (chunks->announced > chunks->there && chunks->frame_bytes > 0) {
    const double frames = static_cast<double>(chunks->announced) / static_cast<double>(chunks->frame_bytes);
    sound.announced_s = chunks->announced == kUnknown ? 0.0 : frames / info.samplerate;
  }
  return sound;
}

Result<void> write_wav(const fs::path& file, std::span<const float> samples, int rate_hz) {
  auto writer = WavWriter::open(file, {.rate_hz = rate_hz});
  if (!writer) return tl::unexpected(writer.error());
  if (auto written = writer->write(samples); !written) return written;
  return writer->close();
}

}  // namespace osteon::sound
