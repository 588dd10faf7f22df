// The simulated surgeon: carries out a plan by moving the hand, tick by tick. It knows only the plan's sites and what
// the tool reports about the bone.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/mechanics/simulated_hand.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "haptic_client/simulation/entry_site.hpp"

namespace osteon::haptic {

enum class Action : std::uint8_t { drill, burr, wait, place, screw, free_hand };  // free_hand is not part of a plan
[[nodiscard]] const char* name(Action action);
enum class HandKind : std::uint8_t { expert, novice, rig };

struct PlanEntry {
  std::optional<Vec3> toward;
  std::optional<Vec3> point_mm, axis;  // both or none
  std::optional<Vec3> target_mm;       // on that axis; a drill without to_mm stops there
  std::optional<std::array<double, 2>> beside_last_mm;
};

struct PlanStep {
  Action action = Action::wait;
  std::string tool;
  double spindle_rpm = 0;  // 0: the tool's own
  HandKind hand = HandKind::expert;
  double push_n = 29;                                               // force of the hand, N
  double hand_stiffness_n_per_mm = 0, hand_damping_n_s_per_mm = 0;  // along the push; 0: the hand kind's own
  double hand_across_n_per_mm = 0;  // stiffness across it, likewise; a hand that lets itself be guided holds loosely
  double feed_mm_per_s = 1;         // rig
  double beyond_mm = 5;             // rig: past the far side
  double to_mm = 0;                 // drill: to this depth; 0: through the bone
  double window_u_mm = 12, window_v_mm = 8, depth_mm = 2, sweep_mm_per_s = 15;  // burr
  double wear = 1;
  std::string law = {};        // force law by which the tool resists; empty: the tool's own
  bool through_guide = false;  // drill: through the guide that was placed last, at its site unless an entry is given
  bool leave = false;          // drill: the pin stays in place at the end; a screw always does
  double tremor_mm = 0;        // of the hand: its largest deviation, across the axis
  PlanEntry entry;
  double seconds = 0;                        // wait, place
  bool irrigation = false, suction = false;  // drill, burr: by the other hand, until the next tool
};

// A step whose site on the bone was found and whose path was computed.
struct ReadyStep {
  PlanStep plan;
  EntrySite site;
  int tool = 0;  // index in the loop's tools
  double spindle_rpm = 0;
  double stand_off_mm = 0;  // where the tool is taken up, above the surface
  int guide = -1;           // place: index of the plan's guide
  Tool item;                // definition of the item that the step leaves on the bone
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // of the tool, bone frame
  std::vector<Vec3> sweep_mm;                                    // positions of the tip, burr
  double sweep_length_mm = 0;                                    // from the first to the last of them
  std::size_t line_places = 1;                                   // number of them in each of the lines to and fro
  // Waits at the end of each line, which is too short for the hand to follow; else only at the last.
  bool dwells = false;
  [[nodiscard]] bool takes_tool() const { return plan.action != Action::wait && plan.action != Action::place; }
  [[nodiscard]] bool feeds() const { return plan.action == Action::drill || plan.action == Action::screw; }
  // Wanted depth of the tip below the entry, mm: through the bone, to_mm, or the lowest position of a sweep. A device
  // and a hand of limited stiffness do not fully reach it.
  [[nodiscard]] double asked_mm() const;
};

struct ReadyPlan {
  std::vector<ReadyStep> steps;
  std::vector<ToolModel> tools;
  std::vector<PlacedGuide> guides;  // in the order in which the steps place them
};
using ToolFinder = std::function<Result<Tool>(std::string_view name)>;
// Error invalid_input or not_found: names the step, the field and the remedy.
[[nodiscard]] Result<ReadyPlan> make_ready(const std::vector<PlanStep>& plan, const Case& bone,
                                           const ToolFinder& find = find_tool);
// Digest of everything in a plan and everything found for it, tools included. Different plans have different digests.
[[nodiscard]] Digest plan_digest(const ReadyPlan& plan);

// free_hand: not part of a plan; a person's own hand.
enum class SurgeonPhase : std::uint8_t {
  take_up,
  approach,
  spin_up,
  seek,
  push,
  feed,
  react,
  sweep,
  retract,
  lift,
  wait,
  done,
  free_hand
};
[[nodiscard]] const char* name(SurgeonPhase phase);
// What a phase waited for in vain when its time ran out, and what may help: the end of a sentence.
[[nodiscard]] const char* given_up_words(SurgeonPhase phase);

// The hand's task in the next tick; bone frame.
struct SurgeonOrder {
  SurgeonPhase phase = SurgeonPhase::done;
  std::size_t step = 0;
  HandCommand hand;
  double spindle_rpm = 0;
  std::uint32_t other_hand = 0;                                  // bits as of other_hand()
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // of the handle, as the hand holds it
  bool take_up = false;                                          // the tool is taken up at hand.target_mm
};

// Means over the ticks in which the whole cutting part was in one kind of bone.
struct LayerMeans {
  double force_n = 0, feed_mm_per_s = 0, density_g_cm3 = 0;
  std::uint64_t ticks = 0;
  void add(double force, double feed, double density) noexcept;
};

// An item that a step has left on the bone.
struct PlacedItem {
  std::size_t step = 0;
  Pose pose_bone_item;
  double turns = 0;  // of a screw, since its tip was on the surface
};

struct StepResult {
  bool completed = false;               // it reached its end by itself; false while it is under way
  std::optional<SurgeonPhase> gave_up;  // the phase whose time ran out
  bool broke_through = false;
  double duration_s = 0;
  double peak_force_n = 0;
  double deepest_mm = 0;     // of the tip below the entry
  double plunge_mm = 0;      // of the tip beyond the far surface, as the reference table counts it
  double after_exit_mm = 0;  // of the tip beyond where the cone was last in bone
  double on_metal_s = 0;     // time for which metal was in the way of the turning tool
  LayerMeans near_cortex, medulla, far_cortex, all;
};

// The same for a step that gave up; distinguishes metal in its way.
[[nodiscard]] const char* given_up_words(const StepResult& result);

class Surgeon {
 public:
  explicit Surgeon(ReadyPlan plan);

  // [haptic] `report`: of the tick before, for the tool of the present step.
  SurgeonOrder act(const LoopReport& report, double dt_s) noexcept;
  [[nodiscard]] bool done() const noexcept { return step_ >= plan_.steps.size(); }
  [[nodiscard]] const ReadyPlan& plan() const { return plan_; }
  // Items that the steps have left so far, in order. Entries never change: another thread may read those it was given.
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept { return left_; }
  // Number of the plan's guides that stand on the bone now.
  [[nodiscard]] std::size_t guides_placed() const noexcept { return guides_placed_; }
  [[nodiscard]] const std::vector<StepResult>& results() const { return results_; }
  // The mapping that puts a step's site into the middle of the workspace, seen along the tool. A small workspace needs
  // a scale above 1. A soft device gets a scale below 1, down to `stiff_enough`, as far as its workspace reaches.
  [[nodiscard]] static WorkspaceMapping mapping_for(const ReadyStep& step, double workspace_radius_mm,
                                                    double stiff_enough);
  // The hand of a step, physical values.
  [[nodiscard]] static HandParams hand_for(const PlanStep& plan);

 private:
  void enter(SurgeonPhase phase) noexcept;
  void observe(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept;
  // Moves the target along the axis towards a depth; true when it is there.
  bool carry_to_depth(const ReadyStep& step, double depth_mm, double speed_mm_per_s, double dt_s) noexcept;
  // One tick of a phase in which the hand takes part. True: the step is at its end.
  bool work(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept;
  // The phase's time is over. Draws the tool out; ends the step (true) when drawing out takes too long too.
  bool give_up(const ReadyStep& step, const LoopReport& report) noexcept;
  // The tool has reached its depth: it is drawn out, or stays.
  void finish_feed(const ReadyStep& step, const LoopReport& report) noexcept;
  // The hand deviates from its target and tilts the tool.
  void tremble(const ReadyStep& step, SurgeonOrder& order) const noexcept;
  void drill(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept;
  void burr(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept;
  // The target waits for the tip. True: the tip is there, or gets no deeper.
  bool dwelt(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept;

  ReadyPlan plan_;
  std::vector<StepResult> results_;
  std::vector<PlacedItem> left_;  // room for one per step
  std::size_t step_ = 0, guides_placed_ = 0;
  SurgeonPhase phase_ = SurgeonPhase::take_up;
  double in_phase_s_ = 0, time_s_ = 0;
  HandCommand hand_;
  double spindle_rpm_ = 0;
  double target_depth_mm_ = 0;
  double last_engaged_mm_ = -1;  // depth of the tip when the cone was last in bone, beyond the far side
  std::size_t knot_ = 0;         // index of the next position of a sweep
  bool dwelling_ = false;
  double dwell_mm_ = 0;  // while dwelling: depth of the tip when it last got deeper
  double still_s_ = 0;   // and the time since then
};

}  // namespace osteon::haptic
