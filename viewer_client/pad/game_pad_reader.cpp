#include "viewer_client/pad/game_pad_reader.hpp"

#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"

namespace osteon {

namespace {

using Clock = std::chrono::steady_clock;

// Half a frame of the window.
constexpr std::chrono::milliseconds kPeriod{8};
// While no pad is open. Looking for one takes longer than reading one.
constexpr std::chrono::milliseconds kLookAgain{1000};

}  // namespace

struct GamePadReader::State {
  Mutex mutex{LockRank::leaf};
  CondVar wake;
  bool stopping OSTEON_GUARDED_BY(mutex) = false;
  GamePadReading reading OSTEON_GUARDED_BY(mutex);
  std::optional<Clock::time_point> polled OSTEON_GUARDED_BY(mutex);  // end of the last poll()
  std::optional<GamePadRumble> rumble OSTEON_GUARDED_BY(mutex);      // set since the last period
  std::thread thread;

  void run() {
    GamePad pad;
    for (bool stops = false; !stops;) {
      const GamePad::Change change = pad.poll();
      std::optional<GamePadRumble> wanted;
      {
        MutexLock lock(mutex);
        note(change, pad);
        wanted = std::exchange(rumble, std::nullopt);
      }
      if (wanted) pad.rumble(*wanted);
      MutexLock lock(mutex);
      stops = wake.wait_for(lock, pad.is_open() ? kPeriod : kLookAgain,
                            [this]() OSTEON_REQUIRES(mutex) { return stopping; });
    }
  }
  void note(GamePad::Change change, const GamePad& pad) OSTEON_REQUIRES(mutex) {
    // A pad that came and went between two readings was never there.
    if (change == GamePad::Change::lost && !std::exchange(reading.opened, false)) reading.lost = true;
    if (change == GamePad::Change::opened) {
      reading.opened = true;
      rumble = std::nullopt;  // it was for the pad before
    }
    reading.is_open = pad.is_open();
    reading.name = pad.name();
    reading.state = pad.state();
    polled = Clock::now();
  }
};

GamePadReader::GamePadReader() : state_(std::make_unique<State>()) {
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

GamePadReader::~GamePadReader() {
  {
    const MutexLock lock(state_->mutex);
    state_->stopping = true;
  }
  state_->wake.notify_all();
  state_->thread.join();
}

GamePadReading GamePadReader::take() {
  const MutexLock lock(state_->mutex);
  GamePadReading taken = state_->reading;
  if (state_->polled) taken.age = Clock::now() - *state_->polled;
  state_->reading.lost = state_->reading.opened = false;
  return taken;
}

void GamePadReader::rumble(const GamePadRumble& strength) {
  const MutexLock lock(state_->mutex);
  state_->rumble = strength;
}

}  // namespace osteon
