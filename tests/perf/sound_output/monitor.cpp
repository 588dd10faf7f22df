#include "tests/perf/sound_output/monitor.hpp"

#include <pthread.h>
#include <pulse/pulseaudio.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

namespace osteon::test {
namespace {

constexpr std::size_t kFragment_frames = 1024;  // the most at once; less is sent as soon as it is there
constexpr std::size_t kLeastFragment_frames = 32;
constexpr int kPriority = 10;  // below the callback of the sound

tl::unexpected<Error> no_monitor(const std::string& why) {
  return failure(ErrorCode::unavailable, "the sink cannot be recorded (" + why + "); run it by deploy/with-null-sink");
}

}  // namespace

struct Monitor::Impl {
  struct Fragment {
    std::size_t begin = 0, end = 0;  // frames
    std::int64_t at_ns = 0;
  };

  explicit Impl(std::size_t most_frames) : frames(most_frames), fragments(most_frames / kLeastFragment_frames) {}
  ~Impl() {
    if (!loop) return;
    pa_threaded_mainloop_stop(loop);
    if (stream) pa_stream_unref(stream);
    if (context) {
      pa_context_disconnect(context);
      pa_context_unref(context);
    }
    pa_threaded_mainloop_free(loop);
  }

  Result<void> open(const std::string& sink_name);
  void take();
  static void wake(void* loop) { pa_threaded_mainloop_signal(static_cast<pa_threaded_mainloop*>(loop), 0); }

  pa_threaded_mainloop* loop = nullptr;
  pa_context* context = nullptr;
  pa_stream* stream = nullptr;
  SinkFacts facts;
  std::vector<Frame> frames;        // the thread of the loop writes up to `count`
  std::vector<Fragment> fragments;  // up to `fragment_count`
  std::atomic<std::size_t> count{0}, fragment_count{0};
  std::atomic<std::uint64_t> holes{0};
  bool asked_realtime = false;
};

void Monitor::Impl::take() {
  const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  // The thread of libpulse is known here only. It goes on as it is if the machine refuses.
  if (!std::exchange(asked_realtime, true)) {
    const sched_param wanted{.sched_priority = kPriority};
    ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted);
  }
  const void* data = nullptr;
  std::size_t bytes = 0, end = count.load(std::memory_order_relaxed);
  Fragment fragment{end, end, now_ns};
  while (pa_stream_readable_size(stream) > 0 && pa_stream_peek(stream, &data, &bytes) == 0 && bytes > 0) {
    const std::size_t taken = std::min(bytes / sizeof(Frame), frames.size() - fragment.end);
    if (data)
      std::memcpy(frames.data() + fragment.end, data, taken * sizeof(Frame));
    else
      holes.fetch_add(1, std::memory_order_relaxed);
    fragment.end += taken;
    pa_stream_drop(stream);
  }
  const std::size_t at = fragment_count.load(std::memory_order_relaxed);
  if (fragment.end == fragment.begin || at == fragments.size()) return;
  fragments[at] = fragment;
  fragment_count.store(at + 1, std::memory_order_release);
  count.store(fragment.end, std::memory_order_release);
}

Result<void> Monitor::Impl::open(const std::string& sink_name) {
  loop = pa_threaded_mainloop_new();
  context = pa_context_new(pa_threaded_mainloop_get_api(loop), "osteon-sound-output");
  pa_context_set_state_callback(
      context, [](pa_context*, void* waiting) { wake(waiting); }, loop);
  if (pa_context_connect(context, nullptr, PA_CONTEXT_NOAUTOSPAWN, nullptr) < 0)
    return no_monitor(pa_strerror(pa_context_errno(context)));
  if (pa_threaded_mainloop_start(loop) < 0) return no_monitor("no thread can be started");
  struct Held {
    explicit Held(pa_threaded_mainloop* l) : loop(l) { pa_threaded_mainloop_lock(loop); }
    ~Held() { pa_threaded_mainloop_unlock(loop); }
    pa_threaded_mainloop* loop;
  } const held(loop);
  while (pa_context_get_state(context) != PA_CONTEXT_READY) {
    if (!PA_CONTEXT_IS_GOOD(pa_context_get_state(context))) return no_monitor(pa_strerror(pa_context_errno(context)));
    pa_threaded_mainloop_wait(loop);
  }

  const auto see = [](pa_context*, const pa_sink_info* info, int, void* self) {
    Impl& me = *static_cast<Impl*>(self);
    if (info) {
      const pa_sample_spec& spec = info->sample_spec;
      me.facts.float_48k_stereo = spec.format == PA_SAMPLE_FLOAT32LE && spec.rate == 48000 && spec.channels == 2;
      me.facts.full_volume = pa_cvolume_is_norm(&info->volume) != 0 && info->mute == 0;
    }
    wake(me.loop);
  };
  pa_operation* asked = pa_context_get_sink_info_by_name(context, sink_name.c_str(), see, this);
  while (pa_operation_get_state(asked) == PA_OPERATION_RUNNING) pa_threaded_mainloop_wait(loop);
  pa_operation_unref(asked);

  const pa_sample_spec spec{PA_SAMPLE_FLOAT32LE, 48000, 2};
  stream = pa_stream_new(context, "monitor", &spec, nullptr);
  pa_stream_set_state_callback(
      stream, [](pa_stream*, void* waiting) { wake(waiting); }, loop);
  pa_stream_set_read_callback(
      stream, [](pa_stream*, std::size_t, void* self) { static_cast<Impl*>(self)->take(); }, this);
  pa_buffer_attr fragments_of{};
  std::memset(&fragments_of, 0xFF, sizeof fragments_of);  // the server's own choice
  fragments_of.fragsize = kFragment_frames * sizeof(Frame);
  if (pa_stream_connect_record(stream, (sink_name + ".monitor").c_str(), &fragments_of, PA_STREAM_NOFLAGS) < 0)
    return no_monitor(pa_strerror(pa_context_errno(context)));
  while (pa_stream_get_state(stream) != PA_STREAM_READY) {
    if (!PA_STREAM_IS_GOOD(pa_stream_get_state(stream))) return no_monitor(pa_strerror(pa_context_errno(context)));
    pa_threaded_mainloop_wait(loop);
  }
  return {};
}

Monitor::Monitor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Monitor::~Monitor() = default;

Result<std::unique_ptr<Monitor>> Monitor::open(const std::string& sink, std::size_t most_frames) {
  auto impl = std::make_unique<Impl>(most_frames);
  if (Result<void> opened = impl->open(sink); !opened) return tl::unexpected(opened.error());
  return std::unique_ptr<Monitor>(new Monitor(std::move(impl)));
}

SinkFacts Monitor::sink() const { return impl_->facts; }
std::uint64_t Monitor::holes() const noexcept { return impl_->holes.load(std::memory_order_relaxed); }

std::span<const Frame> Monitor::frames() const noexcept {
  return std::span(impl_->frames).first(impl_->count.load(std::memory_order_acquire));
}

std::int64_t Monitor::arrival_ns(std::size_t frame) const {
  const auto known = std::span(impl_->fragments).first(impl_->fragment_count.load(std::memory_order_acquire));
  const auto found = std::ranges::upper_bound(known, frame, {}, &Impl::Fragment::end);
  return found == known.end() ? std::numeric_limits<std::int64_t>::max() : found->at_ns;
}

Monitor::Clock Monitor::clock(std::size_t from_frame, std::size_t to_frame) const {
  const auto known = std::span(impl_->fragments).first(impl_->fragment_count.load(std::memory_order_acquire));
  Clock clock;
  std::vector<std::int64_t> starts_ns;
  for (const Impl::Fragment& fragment : known)
    if (fragment.begin >= from_frame && fragment.end <= to_frame)
      starts_ns.push_back(fragment.at_ns - Clock{}.played_ns(fragment.begin));
  if (starts_ns.empty()) return clock;
  clock.start_ns = *std::ranges::min_element(starts_ns);
  for (const std::int64_t start_ns : starts_ns)
    clock.late_ms.push_back(1e-6 * static_cast<double>(start_ns - clock.start_ns));
  return clock;
}

}  // namespace osteon::test
