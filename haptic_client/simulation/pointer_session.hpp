// A simulated hand that a pointer leads: a mouse, pen or game pad over a picture of the bone. The pointer says where
// the tool rests and when the hand pushes. The hand (Hand, common/mechanics) has mass, damper and reaction time. So a
// drill that breaks through plunges as in the hand of a simulated surgeon. One call is one tick.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/input/pointer_link.hpp"
#include "common/runtime/triple_buffer.hpp"
#include "haptic_client/simulation/free_hand.hpp"
#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic {

// What the pointer wants; bone frame. As PointerInput of common/input/pointer_link.hpp, without text.
struct PointerCommand {
  std::uint64_t number = 0;  // of the message; a new number shows that the window runs
  Vec3 target_mm = Vec3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  bool on_bone = false, push = false, fine = false;
  double push_n = 10.0, spindle = 0.0, spindle_rpm = 0.0;
  int tool = 0;  // index in the plan's tools
  bool irrigation = false, suction = false;
  bool empty_hand = true;  // until a message says that it holds something
  PointerSource source = PointerSource::mouse;
  // Of that tool. A wear acts when it changes; 0: the tool stays as it is.
  double wear = 0.0;
  const ForceLaw* law = nullptr;  // it fits the tool; null: the one that the tool began with
};

// What the hand and the tool do; bone frame.
struct PointerState {
  Pose pose_bone_tool;
  Vec3 force_hand_n = Vec3::Zero(), force_bone_n = Vec3::Zero();
  double push_n = 0, depth_mm = 0;
  double device_holds_n = 0;  // the largest force that the device holds for long
  bool pushing = false, on_metal = false, saturated = false;
  int tool = 0;
  double wear = kSharp;           // of that tool
  const ForceLaw* law = nullptr;  // of that tool
};

// The tool that the pointer wants, for the thread that makes it ready. Not for the haptic thread.
class WantedTool {
 public:
  void want(int tool);                      // index in the plan's tools
  [[nodiscard]] std::optional<int> wait();  // for a tool that is wanted now; none: closed
  void open();
  void close();

 private:
  Mutex mutex_{LockRank::leaf};
  CondVar changed_;
  std::optional<int> wanted_ OSTEON_GUARDED_BY(mutex_);
  bool open_ OSTEON_GUARDED_BY(mutex_) = false;
};

// Between the thread that reads the pointer and those of the session.
struct PointerExchange {
  TripleBuffer<PointerCommand> commands;  // pointer → haptic
  TripleBuffer<PointerState> states;      // haptic → pointer
  WantedTool wanted;                      // pointer → the thread that makes tools ready
};

// A plan of one endless step with all of `tools` that a hand can hold. `first`: the tool that is held first, its law
// and wear. It is ready; the models of the others have no points yet. Error invalid_input or not_found.
[[nodiscard]] Result<ReadyPlan> make_pointed_hand(const FreeHandOptions& first, const Case& bone,
                                                  const std::vector<Tool>& tools);

// The loop of a pointer's hand on a device with these limits.
[[nodiscard]] LoopParams pointer_loop(const DeviceLimits& limits, const ForceScaling& scaling, double dt_s);
// Where the first tool of the plan waits until the pointer first meets the bone, bone frame.
[[nodiscard]] Pose pointer_start(const ReadyPlan& plan);

enum class PointerPhase : std::uint8_t {
  away,      // the pointer is not over bone, or silent: the tool waits off the bone
  over,      // the hand brings the tool to where the pointer is
  rests,     // the tool's tip is where the pointer meets the bone
  pushes,    // the button is held
  reacts,    // breakthrough: the hand reacts and stops pushing
  withdraws  // the button is up: the tool comes back along its axis
};

class PointerSession final : public Session {
 public:
  // `plan`: from make_pointed_hand(). `exchange` outlives the session.
  PointerSession(ReadyPlan plan, PointerExchange& exchange, const SimulatedDeviceParams& device,
                 const ForceScaling& scaling, double dt_s = 1e-3);
  ~PointerSession() override;

  // [haptic] Time is counted in these ticks.
  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  [[nodiscard]] bool done() const noexcept override { return false; }
  [[nodiscard]] bool endless() const noexcept override { return true; }
  // The pointer follows the window's clock. The hand follows the ticks: each one moves it by one period.
  [[nodiscard]] bool simulated_time() const noexcept override { return true; }
  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return plan_; }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return results_; }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return left_; }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return device_; }
  [[nodiscard]] PointerPhase phase() const noexcept { return phase_; }
  // Ticks in a row without a message, after which the pointer counts as silent.
  static constexpr int kSilentTicks = kPointerSilence / std::chrono::milliseconds(1);

 private:
  [[nodiscard]] bool silent() const noexcept { return ticks_since_message_ > kSilentTicks; }
  void read_pointer() noexcept;
  void take_wear_and_law() noexcept;  // wear and law of the tool that the pointer wants
  void act(const Patch& patch, double dt_s, SurgeonOrder& order) noexcept;
  void take_up(SurgeonOrder& order) noexcept;  // above the pointer's target
  // Brings the tip to its rest above the pointer's target, or as close to it as the tool stays clear of the bone. True:
  // it is there.
  bool come_to_rest(const Patch& patch, double speed_mm_per_s, double dt_s) noexcept;
  // Distance of the tool from the bone, if its tip were where the hand wants it. None: the patch does not reach there.
  [[nodiscard]] std::optional<double> clear_mm(const Patch& patch) noexcept;
  void begin_push() noexcept;
  void follow_across() noexcept;
  // Moves the tip along a line to a point, at most this fast. True: it is there.
  bool carry(const Vec3& to_mm, double speed_mm_per_s, double dt_s) noexcept;
  [[nodiscard]] bool gave_way() noexcept;
  void enter(PointerPhase phase) noexcept;
  [[nodiscard]] Vec3 axis() const noexcept { return rotation_ * Vec3::UnitZ(); }
  [[nodiscard]] Vec3 lifted(double height_mm) const noexcept;

  ReadyPlan plan_;
  PointerExchange& exchange_;
  SimulatedDevice device_;
  HapticLoop loop_;
  LoopReport last_;
  PointerCommand command_;
  std::vector<double> worn_;  // of each tool: the wear that was commanded last; 0: none yet
  HandCommand hand_;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();  // of the tool in the hand
  int held_ = 0;                                                  // tool in the hand
  double height_mm_ = 0;        // of the tip above the pointer's target, while the hand does not push
  double across_n_per_mm_ = 0;  // stiffness of the hand across the axis, on the device
  ContactValues near_;
  PointerPhase phase_ = PointerPhase::away;
  bool taken_up_ = false;
  int ticks_since_message_ = kSilentTicks + 1;
  Vec3 pushed_from_mm_ = Vec3::Zero();  // where the tip was when the push began
  Vec3 pointed_mm_ = Vec3::Zero();      // the pointer's target of the tick before
  double deepest_mm_ = 0;               // of the tip along the axis since the push began
  bool met_ = false;                    // the tool has been in bone since the push began
  bool released_ = true;                // the button was up since the last push
  double react_s_ = 0;
  std::vector<StepResult> results_{1};
  std::vector<PlacedItem> left_;
  std::thread maker_;  // makes wanted tools ready; last: it uses the other members
};

}  // namespace osteon::haptic
