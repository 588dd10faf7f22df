// Planning in the window: axes and planes that are drawn on the slices or on the bone, for all people of the room. The
// bar shows them above the slices. Its actions are in the menu Plan.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/mechanics/cutting_state.hpp"
#include "common/tools/plan_offset.hpp"
#include "viewer_client/scene/drawn_plan.hpp"
#include "viewer_client/scene/surface_scene.hpp"

class QAction;
class QComboBox;
class QKeySequence;
class QMenu;

namespace osteon {

class BoneView;
class RoomLink;
class SlicesPanel;

// [GUI thread]
class PlanBar : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(PlanBar)

 public:
  struct Window {
    BoneView& view;
    SlicesPanel& slices;
    std::function<RoomLink*()> room;   // null: there is none
    std::function<void()> free_hands;  // no tool is held, and nothing placed
    std::function<void(const QString& sentence)> say;
  };
  // As of ViewOptions::Add.
  using Add = std::function<QAction*(QMenu* menu, const QString& words, const char* name, const QKeySequence& keys,
                                     std::function<void()> call)>;

  explicit PlanBar(Window window, QWidget* parent = nullptr);

  // Once.
  void fill(QMenu& menu, const Add& add);
  // Called often, in a room.
  void refresh();
  // The room is left.
  void clear();

  // A click on the bone. False: nothing is being drawn.
  bool click(const Vec3& point_mm);
  // On an image of the slices. `into_image`: the direction through it.
  void add_point(const Vec3& point_mm, const Vec3& into_image);
  void drag(std::uint32_t id, std::size_t end, const Vec3& point_mm);
  void drop();
  // Ends drawing without a result.
  void give_up();

  // What is planned for the tool, and its name. None: nothing.
  [[nodiscard]] std::optional<std::pair<PlanOffset, QString>> offset_of(const CuttingState& tool) const;
  // The axes as a plan of a simulated surgeon, who has the drill of the own hand.
  void save(const QString& file) const;
  [[nodiscard]] const DrawnPlan& plan() const { return plan_; }

 private:
  void begin(AnnotationKind kind);
  void rename();
  void wipe();
  void undo();
  // Says so if the last change waits for the room.
  [[nodiscard]] bool must_wait() const;
  // Disables what the role of this window's user does not allow.
  void disable(const RoomLink& room);
  void choose_file();
  void show();
  void send(const std::optional<DrawnPlan::Change>& change, const QString& done);
  [[nodiscard]] QString new_name() const;
  // Built in, or of the room. None: unknown.
  [[nodiscard]] std::optional<ToolKind> kind_of(const std::string& tool) const;
  // That of the own hand, or a usual one.
  [[nodiscard]] std::string drill() const;

  Window window_;
  DrawnPlan plan_;
  QComboBox* choice_ = nullptr;
  std::vector<QAction*> changes_;  // what changes the plan; disabled for who only watches
  bool let_go_ = false;            // the mouse still drags an end that was put back
};

}  // namespace osteon
