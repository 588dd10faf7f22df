// Follows the bone that the viewer holds, as HU, on a thread of its own, and has pictures of the inside drawn there.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/radiology/bone_hu.hpp"
#include "viewer_client/net/held_bone.hpp"

namespace osteon {

// The samples of level 0 that changed since the painter's last call.
struct InsideChange {
  static constexpr std::size_t kMostBoxes = 1024;
  bool all = false;               // any sample may have changed: `boxes` is not all
  std::vector<CoordBox> boxes{};  // may overlap
  [[nodiscard]] bool empty() const { return !all && boxes.empty(); }
};

// Draws one kind of picture: a slice, or a radiograph.
class InsidePainter {
 public:
  virtual ~InsidePainter() = default;
  // The bone changed, or somebody called wake(). Everything has changed at the first call. `keep_going` says false when
  // the picture is not wanted any more; the painter is then removed. The bone does not change during the call, and the
  // cuts of the room go on meanwhile. [inside thread, under no lock]
  virtual void paint(const radiology::BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) = 0;
};

struct InsideOptions {
  // The folder of the case, which may have the scan of the case. A server sends no scan, so only who has the case on
  // this computer knows one. Empty: none.
  std::filesystem::path case_folder{};
  // [A] Between the beginnings of two rounds of pictures. After a round the thread rests for half of its time.
  std::chrono::milliseconds period{33};
};

enum class InsideState : std::uint8_t {
  begins,       // there is no bone yet
  makes,        // the HU are computed, `progress` says how far
  follows,      // each cut is in the pictures soon
  interrupted,  // the pictures show the bone as it was
  failed,       // for good
};

struct InsideStatus {
  InsideState state = InsideState::begins;
  double progress = 0.0;              // of `makes`, 0 to 1
  RoomSeq room_seq{};                 // the newest event that all painters were given
  bool from_scan = false;             // HU of the case's scan, and not from its density
  std::optional<Error> why{};         // of `interrupted` and `failed`, and why it still begins
  std::optional<Error> scan_fault{};  // why a scan that is there is not used
};

// One thread. It uses the held bone for a few milliseconds at a time, so that cuts come in between. Memory: that of
// BoneHu. All functions: any thread.
class InsideBone {
 public:
  // `held` is shared with the subscription that made it. Only one InsideBone at a time may follow it.
  [[nodiscard]] static std::unique_ptr<InsideBone> start(std::shared_ptr<HeldBone> held,
                                                         const InsideOptions& options = {});
  // Waits for the thread: as long as HeldBone::read() may wait. So not in the GUI thread.
  ~InsideBone();
  // Ends what the thread does, soon. Returns at once.
  void end();

  // The painter is called soon, and then after each change. Shared with its owner.
  void add(std::shared_ptr<InsidePainter> painter);
  // The painter is not called any more. Waits while it paints, until it has heeded `keep_going`. Not for paint()
  // itself.
  void remove(const InsidePainter& painter);
  // A painter has a new request: all are called soon. Returns at once.
  void wake();
  // Returns at once.
  [[nodiscard]] InsideStatus status() const;

 private:
  struct Impl;
  explicit InsideBone(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
