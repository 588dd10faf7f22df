#include "viewer_client/scene/drawn_plan.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/tools/plan_offset.hpp"

namespace osteon {

namespace {

constexpr std::uint32_t kPlannedColour = 0x56b4e9;  // sky blue, as what the case plans
constexpr double kDeep_mm = 20.0;                   // of a plane's third point, from its line
constexpr std::size_t kMostUndone = 100;

// The axis or plane through points that somebody has clicked, not checked.
Annotation drawn_through(AnnotationKind kind, const Vec3& first_mm, const Vec3& second_mm, const Vec3& into_image) {
  Annotation drawn{.kind = kind, .points = {in_steps(first_mm), in_steps(second_mm)}, .colour = kPlannedColour};
  if (kind == AnnotationKind::plane) drawn.points.push_back(in_steps(first_mm + kDeep_mm * into_image));
  return drawn;
}

std::uint32_t id_of(const std::optional<Annotation>& drawn) { return drawn ? drawn->id : 0; }

}  // namespace

bool DrawnPlan::take(const std::vector<Annotation>& of_room) {
  if (of_room == of_room_) return false;
  of_room_ = of_room;
  if (answered_) edited_.reset(), answered_ = false;
  show();
  return true;
}

void DrawnPlan::show() {
  shown_ = of_room_;
  if (!edited_) return;
  const auto place = std::ranges::find(shown_, id_of(edited_->before), &Annotation::id);
  if (place != shown_.end() && edited_->after)
    *place = *edited_->after;
  else if (place != shown_.end())
    shown_.erase(place);
  else if (edited_->after && !edited_->before)
    shown_.push_back(*edited_->after);
}

std::vector<Annotation> DrawnPlan::planned() const {
  std::vector<Annotation> found;
  std::ranges::copy_if(shown_, std::back_inserter(found), [](const Annotation& one) { return is_planned(one.kind); });
  return found;
}

const Annotation* DrawnPlan::selected() const {
  const auto found = std::ranges::find_if(
      shown_, [this](const Annotation& one) { return one.id == selected_ && is_planned(one.kind); });
  return found == shown_.end() ? nullptr : &*found;
}

const Annotation* DrawnPlan::for_tool(ToolKind tool) const {
  if (const Annotation* chosen = selected(); chosen != nullptr && suits(chosen->kind, tool)) return chosen;
  const auto newest =
      std::find_if(shown_.rbegin(), shown_.rend(), [&](const Annotation& one) { return suits(one.kind, tool); });
  return newest == shown_.rend() ? nullptr : &*newest;
}

void DrawnPlan::begin(AnnotationKind kind) {
  give_up();
  kind_ = kind;
}

void DrawnPlan::give_up() {
  kind_.reset();
  first_mm_.reset();
  if (!drags()) return;
  edited_.reset();
  show();
}

Result<std::optional<DrawnPlan::Change>> DrawnPlan::add_point(const Vec3& point_mm, const Vec3& into_image,
                                                              const std::string& name) {
  if (!kind_) return std::optional<Change>();
  if (!first_mm_) {
    first_mm_ = point_mm;
    return std::optional<Change>();
  }
  Annotation drawn = drawn_through(*kind_, *first_mm_, point_mm, into_image);
  drawn.words = name;
  if (const Result<void> sound = check(drawn); !sound) return tl::unexpected(sound.error());
  if (asked_) return failure(ErrorCode::unavailable, "the last change waits for the room");
  give_up();
  return ask({std::nullopt, std::move(drawn)}, false);
}

void DrawnPlan::drag(std::uint32_t id, std::size_t end, const Vec3& point_mm) {
  if (asked_ || end > 1) return;
  if (answered_ || !edited_ || id_of(edited_->before) != id) {
    const auto found = std::ranges::find(of_room_, id, &Annotation::id);
    if (found == of_room_.end() || !is_planned(found->kind)) return;
    edited_ = Change{*found, *found};
    answered_ = false;
    selected_ = id;
  }
  Annotation moved = *edited_->after;
  const Vec3 by_mm = point_mm - from_steps(moved.points[end]);
  moved.points[end] = in_steps(point_mm);
  if (end == 0 && moved.kind == AnnotationKind::plane) moved.points[2] = in_steps(from_steps(moved.points[2]) + by_mm);
  if (!check(moved)) return;  // both ends at one place have no direction
  edited_->after = std::move(moved);
  show();
}

bool DrawnPlan::is_in_room() const {
  const auto same = [this](const Annotation& one) {
    if (!edited_->after) return one.id == edited_->before->id;
    return one.id == edited_->after->id && one.points == edited_->after->points && one.words == edited_->after->words;
  };
  return std::ranges::any_of(of_room_, same) == edited_->after.has_value();
}

std::optional<DrawnPlan::Change> DrawnPlan::ask(Change change, bool is_undo) {
  if (asked_) return std::nullopt;
  edited_ = change;
  asked_ = true;
  is_undo_ = is_undo;
  answered_ = false;
  show();
  return change;
}

std::optional<DrawnPlan::Change> DrawnPlan::drop() {
  if (!drags()) return std::nullopt;
  if (edited_->before == edited_->after) {
    edited_.reset();
    return std::nullopt;
  }
  return ask(*edited_, false);
}

std::optional<DrawnPlan::Change> DrawnPlan::rename(const std::string& name) {
  const Annotation* chosen = selected();
  if (chosen == nullptr || chosen->words == name) return std::nullopt;
  Change change{*chosen, *chosen};
  change.after->words = name;
  if (!check(*change.after)) return std::nullopt;
  return ask(std::move(change), false);
}

std::optional<DrawnPlan::Change> DrawnPlan::wipe() {
  const Annotation* chosen = selected();
  if (chosen == nullptr) return std::nullopt;
  return ask({*chosen, std::nullopt}, false);
}

std::optional<DrawnPlan::Change> DrawnPlan::undo() {
  if (done_.empty() || asked_) return std::nullopt;
  give_up();
  return ask({done_.back().after, done_.back().before}, true);
}

void DrawnPlan::answered(const Result<std::uint32_t>& id) {
  if (!asked_) return;
  asked_ = false;
  if (!id) {
    // What somebody else has changed meanwhile cannot be undone.
    if (is_undo_ && id.error().code != ErrorCode::unavailable) done_.pop_back();
    edited_.reset();
    return show();
  }
  Change change = *edited_;
  // A drawing that is drawn again has another number.
  const std::uint32_t old = change.before ? change.before->id : id_of(change.after);
  if (change.after) change.after->id = selected_ = *id;
  if (is_undo_)
    done_.pop_back();
  else
    done_.push_back(change);
  if (change.after && old != 0)
    for (Change& one : done_)
      for (std::optional<Annotation>* state : {&one.before, &one.after})
        if (*state && (*state)->id == old) (*state)->id = *id;
  if (done_.size() > kMostUndone) done_.erase(done_.begin());
  edited_ = std::move(change);
  answered_ = !is_in_room();
  if (!answered_) edited_.reset();
  show();
}

Result<std::uint32_t> carry_out(const DrawnPlan::Change& change, std::span<const Annotation> now, AuthorId self,
                                const PlanRequests& room) {
  const std::uint32_t old = id_of(change.before);
  const bool own = std::ranges::any_of(now, [&](const Annotation& one) { return one.id == old && one.author == self; });
  const bool full = now.size() >= kMostAnnotations;
  const bool replaces = change.before && change.after && !own;
  if (change.before && (!change.after || (replaces && full)))
    if (const Result<void> gone = room.wipe_off(old); !gone) return tl::unexpected(gone.error());
  if (!change.after) return 0;
  Annotation drawn = *change.after;
  drawn.id = own ? old : 0;
  const Result<std::uint32_t> id = room.draw(drawn);
  if (!id || !replaces || full) return id;
  const Result<void> gone = room.wipe_off(old);
  if (gone) return id;
  (void)room.wipe_off(*id);  // it is not there twice
  return tl::unexpected(gone.error());
}

std::string plan_text(std::span<const Annotation> planned, const std::string& tool) {
  nlohmann::json steps = nlohmann::json::array(), planes = steps;
  const auto numbers = [](const Vec3& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  for (const Annotation& one : planned) {
    const std::vector<Vec3> points = points_mm(one);
    if (one.kind == AnnotationKind::plane)
      planes.push_back({{"name", one.words},
                        {"point_mm", numbers(points[0])},
                        {"end_mm", numbers(points[1])},
                        {"normal", numbers(planned_direction(one))}});
    if (one.kind != AnnotationKind::axis) continue;
    steps.push_back({{"action", "drill"},
                     {"tool", tool},
                     {"entry", {{"point_mm", numbers(points[0])}, {"target_mm", numbers(points[1])}}}});
  }
  return nlohmann::json{{"steps", steps}, {"planes", planes}}.dump(2) + "\n";
}

}  // namespace osteon
