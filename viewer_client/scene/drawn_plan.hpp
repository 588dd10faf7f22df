// The axes and planes that people draw on the bone as a plan, and how this window's user changes them. The room keeps
// them as annotations. A change is shown at once, before the room has taken it.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// Not synchronised.
class DrawnPlan {
 public:
  // What the room is asked for. None before: a new one. None after: it is wiped off.
  struct Change {
    std::optional<Annotation> before, after;
  };

  // All annotations of the room. True: shown() changed.
  bool take(const std::vector<Annotation>& of_room);
  // All annotations as the user sees them. One that the room has not numbered yet has the number 0.
  [[nodiscard]] const std::vector<Annotation>& shown() const { return shown_; }
  // The axes and planes among them.
  [[nodiscard]] std::vector<Annotation> planned() const;

  void select(std::uint32_t id) { selected_ = id; }
  // Null: none is.
  [[nodiscard]] const Annotation* selected() const;
  // What the tool is compared with: the selected one if it suits, else the newest that suits. Null: none does.
  [[nodiscard]] const Annotation* for_tool(ToolKind tool) const;

  // An axis or a plane is drawn with two points.
  void begin(AnnotationKind kind);
  // Ends drawing, and puts back what is dragged.
  void give_up();
  [[nodiscard]] bool draws() const { return kind_.has_value(); }
  [[nodiscard]] AnnotationKind kind() const { return kind_.value_or(AnnotationKind::axis); }
  [[nodiscard]] const std::optional<Vec3>& first_point() const { return first_mm_; }
  // Entry, then target; or the ends of a plane's line. `into_image`: a plane goes that way from its line. The second
  // point ends drawing. None: a point is still to come. Errors: invalid_input, the points give no direction;
  // unavailable, it waits(). Then the second point may be given again.
  [[nodiscard]] Result<std::optional<Change>> add_point(const Vec3& point_mm, const Vec3& into_image,
                                                        const std::string& name);

  // `end`: 0 or 1. A plane's third point goes along with the first one.
  void drag(std::uint32_t id, std::size_t end, const Vec3& point_mm);

  // An end is being dragged.
  [[nodiscard]] bool drags() const { return edited_ && !asked_ && !answered_; }
  // The room is asked for a change, and answered() is still to come.
  [[nodiscard]] bool waits() const { return asked_; }
  // Changes for the room. Each is followed by answered(); until then, and if there is nothing to change, they are none.
  [[nodiscard]] std::optional<Change> drop();
  [[nodiscard]] std::optional<Change> rename(const std::string& name);
  [[nodiscard]] std::optional<Change> wipe();
  [[nodiscard]] std::optional<Change> undo();  // the newest change of this window's user
  // The number that the room gave to `after`; anything if that is none. After an error of the connection undo() asks
  // for the same again.
  void answered(const Result<std::uint32_t>& id);

 private:
  [[nodiscard]] std::optional<Change> ask(Change change, bool is_undo);
  void show();
  [[nodiscard]] bool is_in_room() const;  // edited_

  std::vector<Annotation> of_room_, shown_;
  std::uint32_t selected_ = 0;
  std::optional<AnnotationKind> kind_;  // of what is being drawn
  std::optional<Vec3> first_mm_;
  std::optional<Change> edited_;  // shown, and the room does not have it yet
  bool asked_ = false;            // the room is asked for it
  bool is_undo_ = false;
  bool answered_ = false;     // the room has taken it, and its new state is still to come
  std::vector<Change> done_;  // by this window's user, oldest first
};

// The room's services, which wait for its answer.
struct PlanRequests {
  std::function<Result<std::uint32_t>(const Annotation& drawn)> draw;  // the answer is its number
  std::function<Result<void>(std::uint32_t id)> wipe_off;
};
// Asks the room for the change. The answer is for answered(). Only its author `self` may change a drawing. In place of
// another's, such as that of an earlier session, there is a new one; if that is refused, the old one stays, unless the
// room `now` has as many as it takes.
[[nodiscard]] Result<std::uint32_t> carry_out(const DrawnPlan::Change& change, std::span<const Annotation> now,
                                              AuthorId self, const PlanRequests& room);

// A plan of a simulated surgeon, JSON: it drills the axes one after the other with this tool, each to its target. The
// planes are in it for people and other programs. LPS, mm.
[[nodiscard]] std::string plan_text(std::span<const Annotation> planned, const std::string& tool);

}  // namespace osteon
