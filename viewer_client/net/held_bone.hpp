// Holds the bone as the room has it, for pictures of its inside. A viewer that shows none does not make one.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "viewer_client/net/field_follower.hpp"

namespace osteon {

// Where a HeldBone reads from: a server (field_source.hpp), or a test.
class FieldSource {
 public:
  // Why a stream ended.
  struct End {
    Error why;
    bool for_good = false;  // asking again does not help
  };
  virtual ~FieldSource() = default;
  // The bone before any cut. Errors: unavailable (asking again may help); all others are final.
  [[nodiscard]] virtual Result<Case> imported() = 0;
  // Opens a stream of the imported bone, and reads it until it ends or `take` returns false.
  [[nodiscard]] virtual End read(const std::function<bool(const v1::WatchFieldResponse&)>& take) = 0;
  // For good; imported() and read() return soon. Any thread.
  virtual void cancel() = 0;
};

struct HeldBoneOptions {
  // [A] Of cut fields and what waits to get into them. The case itself comes on top.
  std::size_t most_bytes = std::size_t{2} << 30;
  std::chrono::milliseconds pause{200}, longest_pause{2000};  // before it asks again, random between
};

enum class HeldBoneState : std::uint8_t {
  begins,       // the case or the first leaves are on their way: there is no bone yet
  follows,      // each event is applied as it comes
  interrupted,  // the bone is as it was; it is being asked for again
  failed,       // for good, and there is no bone
};

struct HeldBoneStatus {
  HeldBoneState state = HeldBoneState::begins;
  RoomSeq room_seq;        // of the newest event in the bone
  std::size_t bodies = 0;  // sawn pieces included
  std::size_t bytes = 0;   // of HeldBoneOptions::most_bytes
  std::uint64_t asked_again = 0;
  std::optional<Error> why{};  // of `interrupted` and `failed`
};

// One thread reads the stream and computes the cuts. All functions: any thread.
class HeldBone {
 public:
  [[nodiscard]] static std::unique_ptr<HeldBone> start(std::unique_ptr<FieldSource> source,
                                                       const HeldBoneOptions& options = {});
  ~HeldBone();
  // Ends the stream; the bone stays as it is. Returns at once.
  void end();
  // Also waits for the thread, which then uses the source no more. Whoever shares the bone may go on to read it.
  void end_and_join();

  // Returns at once. The bone may already be one event newer.
  [[nodiscard]] HeldBoneStatus status() const;
  // Calls `use` with the bone at one event. Waits while an event changes the bone, which takes long for the first
  // leaves and for an undo; cuts wait for `use`. `use` may take no lock but leaves. False: there is no bone.
  bool read(const std::function<void(const Replica& bone)>& use) const;
  // Where it has changed since the last call; everywhere at first. Waits as read() does.
  [[nodiscard]] FieldChanges take_changes();
  // Waits until `done`, which may take no lock. False: it was not within `patience`.
  bool wait(const std::function<bool(const HeldBoneStatus&)>& done, std::chrono::milliseconds patience) const;
  // Whoever waits asks `done` again: what it looks at has changed.
  void wake_waiting() const;

 private:
  struct Impl;
  explicit HeldBone(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
