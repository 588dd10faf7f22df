#include "common/input/space_mouse.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "common/core/mutex.hpp"
#include "common/runtime/triple_buffer.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint16_t kLogitech = 0x046d, k3Dconnexion = 0x256f;
constexpr std::array<std::uint16_t, 12> kLogitechModels{0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625,
                                                        0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640};
constexpr std::array<std::uint16_t, 10> k3DconnexionModels{0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633,
                                                           0xc635, 0xc636, 0xc638, 0xc63a, 0xc652};
constexpr std::uint16_t kDesktopPage = 1, kMultiAxis = 8;
constexpr std::array<std::uint8_t, 2> kLightOn{4, 1}, kLightOff{4, 0};
constexpr auto kPause = 1ms;
// A deflected cap reports continuously. Silence means that its reports were lost.
constexpr auto kDeflectionHeld = 500ms;
constexpr std::chrono::milliseconds kLookAgain{1000}, kLookAfter{100};  // if none was found; after one was lost

bool is_space_mouse(const HidFound& device) {
  const auto known = [&](const auto& models) {
    return std::find(models.begin(), models.end(), device.model) != models.end();
  };
  const bool one = (device.vendor == kLogitech && known(kLogitechModels)) ||
                   (device.vendor == k3Dconnexion && known(k3DconnexionModels));
  // A receiver has other collections beside that of the cap. If the system reports no usage, it is the only one.
  return one && (device.usage_page == 0 || (device.usage_page == kDesktopPage && device.usage == kMultiAxis));
}

}  // namespace

std::vector<HidFound> list_space_mice() {
  std::vector<HidFound> found = list_hid_devices();
  std::erase_if(found, [](const HidFound& device) { return !is_space_mouse(device); });
  return found;
}

Result<HidFound> SpaceMousePort::open(bool light, Calls calls) {
  close();
  const std::vector<HidFound> found = list_space_mice();
  if (found.empty()) return failure(ErrorCode::not_found, "no SpaceMouse is there; plug it in");
  Result<HidPort> port = HidPort::open(found.front(), "the SpaceMouse");
  if (!port) return tl::unexpected(port.error());
  if (light)
    if (Result<void> lit = port->write(kLightOn); !lit) return tl::unexpected(lit.error());
  state_ = {};
  battery_ = -1;
  moved_ = Clock::now();
  reader_.start(std::move(*port), kPause,
                {.take =
                     [this, moved = std::move(calls.moved)](std::span<const std::uint8_t> report) {
                       const auto now = Clock::now();
                       if (!report.empty() && take_report(state_, report)) moved_ = now;
                       if (now - moved_ > kDeflectionHeld) state_.push = state_.twist = Vec3::Zero();
                       battery_ = state_.battery_percent;
                       moved(state_);
                     },
                 .at_end = std::move(calls.lost),
                 .before_close =
                     [light](HidPort& open_port) {
                       if (light) (void)open_port.write(kLightOff);
                     }});
  return found.front();
}

struct SpaceMouseWatch::State {
  std::function<void(const std::string&)> say;
  TripleBuffer<SpaceMouseState> states;
  SpaceMousePort port;
  Mutex mutex{LockRank::leaf};
  CondVar wake;
  bool stopping OSTEON_GUARDED_BY(mutex) = false;
  std::thread thread;

  bool stopped_within(std::chrono::milliseconds time) {
    MutexLock lock(mutex);
    return wake.wait_for(lock, time, [this]() OSTEON_REQUIRES(mutex) { return stopping; });
  }
  void run() {
    do {
      const Result<HidFound> found =
          port.open(true, {.moved = [this](const SpaceMouseState& state) { states.store(state); }, .lost = {}});
      if (!found) continue;
      say((found->product.empty() ? "SpaceMouse" : found->product) + " moves the camera");
      Result<void> health;
      while (health && !stopped_within(kLookAfter)) health = port.health();
      port.close();
      states.store({});  // the reading thread has ended
      if (!health) say(health.error().message);
    } while (!stopped_within(kLookAgain));
  }
};

SpaceMouseWatch::SpaceMouseWatch(std::function<void(const std::string&)> say) : state_(std::make_unique<State>()) {
  state_->say = std::move(say);
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

SpaceMouseWatch::~SpaceMouseWatch() {
  {
    const MutexLock lock(state_->mutex);
    state_->stopping = true;
  }
  state_->wake.notify_all();
  state_->thread.join();
}

SpaceMouseState SpaceMouseWatch::cap() noexcept {
  state_->states.refresh();
  return state_->states.value();
}

}  // namespace osteon
