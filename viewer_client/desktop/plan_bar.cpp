#include "viewer_client/desktop/plan_bar.hpp"

#include <QAction>
#include <QComboBox>
#include <QFileDialog>
#include <QHBoxLayout>
#include <QInputDialog>
#include <QKeySequence>
#include <QMenu>
#include <QToolButton>
#include <algorithm>

#include "common/access/role_table.hpp"
#include "common/runtime/files.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/room_link.hpp"
#include "viewer_client/desktop/slices_panel.hpp"

namespace osteon {

namespace {

constexpr const char* kUsualDrill = "drill-3.2";

}  // namespace

PlanBar::PlanBar(Window window, QWidget* parent) : QWidget(parent), window_(std::move(window)) {
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  choice_ = new QComboBox;
  choice_->setObjectName("plan_choice");
  choice_->setAccessibleName(tr("Planned axes and planes"));
  choice_->setToolTip(tr("The tool is compared with this one. Its first point is where the slices go."));
  choice_->setSizeAdjustPolicy(QComboBox::AdjustToContents);
  connect(choice_, QOverload<int>::of(&QComboBox::activated), this, [this](int index) {
    plan_.select(choice_->itemData(index).toUInt());
    if (const Annotation* chosen = plan_.selected()) window_.slices.look_at(from_steps(chosen->points.front()));
    show();
  });
  row->addWidget(choice_);
}

void PlanBar::fill(QMenu& menu, const Add& add) {
  const auto action = [&](const QString& words, const char* name, const char* keys, const QString& tip,
                          std::function<void()> call) {
    QAction* made = add(&menu, words, name, QKeySequence(keys), std::move(call));
    made->setStatusTip(tip);
    return made;
  };
  const auto button = [&](QAction* shown, const QString& words) {
    auto* made = new QToolButton;
    made->setDefaultAction(shown);
    made->setText(words);
    // The action would write its own text back.
    connect(shown, &QAction::changed, made, [made, words] { made->setText(words); });
    layout()->addWidget(made);
  };
  QAction* draw_axis = action(tr("Draw an &axis"), "draw_axis", "Ctrl+Shift+A",
                              tr("The entry, then the target, by two clicks on the slices or on the bone"),
                              [this] { begin(AnnotationKind::axis); });
  button(draw_axis, tr("Axis"));
  QAction* draw_plane = action(tr("Draw a &plane"), "draw_plane", "Ctrl+Shift+P",
                               tr("Both ends of its line. The plane goes straight into the picture"),
                               [this] { begin(AnnotationKind::plane); });
  button(draw_plane, tr("Plane"));
  QAction* point = action(tr("Point at the &cross of the slices"), "plan_point", "Ctrl+Return",
                          tr("The next point of what is being drawn, without the mouse"),
                          [this] { add_point(window_.slices.point_mm(), window_.slices.into_image()); });
  menu.addSeparator();
  QAction* name =
      action(tr("Re&name…"), "plan_name", "F2", tr("The name of the chosen axis or plane"), [this] { rename(); });
  button(name, tr("Rename…"));
  QAction* wipes =
      action(tr("&Delete"), "plan_wipe", "Ctrl+Del", tr("Removes the chosen axis or plane"), [this] { wipe(); });
  button(wipes, tr("Delete"));
  QAction* undoes = action(tr("&Undo in the plan"), "plan_undo", "Ctrl+Alt+Z",
                           tr("Takes back your last change of the plan"), [this] { undo(); });
  button(undoes, tr("Undo"));
  changes_ = {draw_axis, draw_plane, point, name, wipes, undoes};
  menu.addSeparator();
  action(tr("&Save the plan…"), "save_plan", "Ctrl+Shift+E",
         tr("The axes and planes as a file; a simulated surgeon drills its axes"), [this] { choose_file(); });
  static_cast<QHBoxLayout*>(layout())->addStretch();
}

void PlanBar::refresh() {
  const RoomLink* room = window_.room();
  if (room == nullptr) return;
  if (plan_.take(room->annotations())) show();
  disable(*room);
}

// The room enables them again when it is joined.
void PlanBar::disable(const RoomLink& room) {
  if (!changes_.front()->isEnabled()) return;
  const std::vector<PersonSeen> people = room.people();
  const auto self = std::ranges::find(people, room.self(), &PersonSeen::author);
  // Without certificates nobody has a role, and everybody may.
  if (self == people.end() || self->role == Role::none || may_call(self->role, "/osteon.v1.PeopleService/Annotate"))
    return;
  give_up();
  for (QAction* action : changes_) set_enabled(*action, false, tr("Only an instructor plans in this room."));
}

void PlanBar::clear() {
  plan_ = {};
  show();
}

void PlanBar::show() {
  const std::vector<Annotation> planned = plan_.planned();
  const Annotation* chosen = plan_.selected();
  choice_->clear();
  choice_->setPlaceholderText(planned.empty() ? tr("Nothing is planned") : tr("Nothing is chosen"));
  for (const Annotation& one : planned) choice_->addItem(QString::fromStdString(one.words), one.id);
  choice_->setCurrentIndex(chosen == nullptr ? -1 : choice_->findData(chosen->id));
  window_.view.show_annotations(plan_.shown());
  window_.slices.show_drawn(planned, chosen == nullptr ? 0 : chosen->id, plan_.draws(), plan_.first_point());
}

void PlanBar::begin(AnnotationKind kind) {
  window_.free_hands();
  plan_.begin(kind);
  window_.view.set_placing(true);
  show();
  window_.say(kind == AnnotationKind::axis ? tr("Click the entry, on the bone or on a slice.")
                                           : tr("Click one end of the plane's line, on the bone or on a slice."));
}

void PlanBar::give_up() {
  if (plan_.draws()) window_.view.set_placing(false);
  if (plan_.drags()) let_go_ = true;
  plan_.give_up();
  show();
}

bool PlanBar::click(const Vec3& point_mm) {
  if (!plan_.draws()) return false;
  const CameraView eye = window_.view.camera();
  add_point(point_mm, (eye.target_mm - eye.eye_mm).normalized());
  return true;
}

void PlanBar::add_point(const Vec3& point_mm, const Vec3& into_image) {
  if (!plan_.draws()) return window_.say(tr("Choose first whether to draw an axis or a plane."));
  const bool axis = plan_.kind() == AnnotationKind::axis;
  if (plan_.first_point() && must_wait()) return;
  const auto change = plan_.add_point(point_mm, into_image, new_name().toStdString());
  if (!change)
    return window_.say(axis ? tr("The second point is too near to the first one. Click farther away.")
                            : tr("The line is too short, or goes straight into the picture. Click elsewhere."));
  if (!plan_.draws()) window_.view.set_placing(false);
  show();
  if (!*change)
    return window_.say(axis ? tr("Click the target, where the tip is to stop.")
                            : tr("Click the other end of the plane's line."));
  send(*change, tr("Drawn. Drag its ends on the slices to move them."));
}

void PlanBar::drag(std::uint32_t id, std::size_t end, const Vec3& point_mm) {
  if (let_go_ || !changes_.front()->isEnabled() || must_wait()) return;
  plan_.drag(id, end, point_mm);
  show();
}

void PlanBar::drop() {
  let_go_ = false;
  send(plan_.drop(), tr("Moved."));
}

bool PlanBar::must_wait() const {
  if (plan_.waits()) window_.say(tr("The last change of the plan is still on its way. Try again."));
  return plan_.waits();
}

void PlanBar::wipe() {
  if (must_wait()) return;
  if (plan_.selected() == nullptr) return window_.say(tr("Draw an axis or a plane first, or choose one."));
  send(plan_.wipe(), tr("Deleted."));
}

void PlanBar::undo() {
  if (must_wait()) return;
  give_up();
  const auto change = plan_.undo();
  if (!change) return window_.say(tr("You have changed nothing in the plan that could be undone."));
  send(change, tr("Undone in the plan."));
}

void PlanBar::rename() {
  if (must_wait()) return;
  const Annotation* chosen = plan_.selected();
  if (chosen == nullptr) return window_.say(tr("Draw an axis or a plane first, or choose one."));
  bool ok = false;
  const QString name = QInputDialog::getText(this, tr("Name in the plan"), tr("Its name"), QLineEdit::Normal,
                                             QString::fromStdString(chosen->words), &ok);
  if (!ok) return;
  if (name.toUtf8().size() > static_cast<int>(kMostAnnotationWords))
    return window_.say(tr("This name is too long. Give a shorter one."));
  send(plan_.rename(name.toStdString()), tr("Renamed."));
}

void PlanBar::send(const std::optional<DrawnPlan::Change>& change, const QString& done) {
  RoomLink* room = window_.room();
  if (!change || room == nullptr) return;
  show();
  room->draw(*change, [this, change, done](const Result<std::uint32_t>& answer) {
    plan_.answered(answer);
    show();
    window_.say(answer ? done : QString::fromStdString(answer.error().message));
  });
}

QString PlanBar::new_name() const {
  const std::vector<Annotation> planned = plan_.planned();
  const QString form = plan_.kind() == AnnotationKind::axis ? tr("Axis %1") : tr("Plane %1");
  for (int number = 1;; ++number) {
    QString name = form.arg(number);
    if (std::ranges::find(planned, name.toStdString(), &Annotation::words) == planned.end()) return name;
  }
}

std::optional<std::pair<PlanOffset, QString>> PlanBar::offset_of(const CuttingState& tool) const {
  const std::optional<ToolKind> kind = kind_of(tool.tool_name);
  const Annotation* planned = kind ? plan_.for_tool(*kind) : nullptr;
  if (planned == nullptr) return std::nullopt;
  return std::pair(plan_offset(*planned, tool.pose_bone_tool), QString::fromStdString(planned->words));
}

void PlanBar::choose_file() {
  if (plan_.planned().empty()) return window_.say(tr("Draw an axis or a plane first."));
  QFileDialog dialog(this, tr("Save the plan"), {}, tr("Plans (*.json)"));
  dialog.setAcceptMode(QFileDialog::AcceptSave);
  dialog.setDefaultSuffix("json");
  dialog.selectFile("plan.json");
  if (dialog.exec() == QDialog::Accepted) save(dialog.selectedFiles().constFirst());
}

std::optional<ToolKind> PlanBar::kind_of(const std::string& tool) const {
  if (const Result<Tool> built_in = find_tool(tool)) return built_in->kind;
  if (const SceneUpdater* scene = window_.view.updater())
    if (const auto own = std::ranges::find(scene->tools(), tool, &Tool::name); own != scene->tools().end())
      return own->kind;
  return {};
}

std::string PlanBar::drill() const {
  const std::string held = window_.view.pointer().tool();
  return kind_of(held) == ToolKind::drill ? held : kUsualDrill;
}

void PlanBar::save(const QString& file) const {
  const Result<void> saved = write_file(file.toStdString(), plan_text(plan_.planned(), drill()));
  const bool drills =
      std::ranges::any_of(plan_.planned(), [](const Annotation& one) { return one.kind == AnnotationKind::axis; });
  window_.say(saved && drills ? tr("Saved %1.").arg(file)
              : saved         ? tr("Saved %1. It has no axis that a simulated surgeon could drill.").arg(file)
                              : QString::fromStdString(saved.error().message));
}

}  // namespace osteon
