#include "viewer_client/desktop/view_options.hpp"

#include <QAction>
#include <QActionGroup>
#include <QMenu>
#include <QSettings>
#include <utility>

#include "viewer_client/desktop/bone_view.hpp"

namespace osteon {

namespace {

constexpr int kMostViews = 9;
constexpr int kNumbers = 9;  // eye, target and up

QVariantList numbers_of(const CameraView& view) {
  QVariantList numbers;
  for (const Vec3& v : {view.eye_mm, view.target_mm, view.up})
    for (int axis = 0; axis < 3; ++axis) numbers << v[axis];
  return numbers;
}

}  // namespace

ViewOptions::ViewOptions(BoneView& view, QMenu& menu, const Add& add, Say say, QObject* parent)
    : QObject(parent), view_(view), say_(std::move(say)) {
  add_switch(menu, add, tr("Orientation cube"), "marker", QKeySequence("Ctrl+K"),
             [this](bool on) { view_.show_marker(on); });
  overlays_ = menu.addMenu(tr("Overlays"));
  add_switch(*overlays_, add, tr("Planned axes and regions"), "planned", QKeySequence("Ctrl+L"),
             [this](bool on) { view_.show_planned(on); });
  add_switch(*overlays_, add, tr("Structures at risk"), "risks", QKeySequence("Ctrl+R"),
             [this](bool on) { view_.show_risks(on); });
  add_stereo(*menu.addMenu(tr("Stereo picture")), add);
  QMenu& saved = *menu.addMenu(tr("Saved views"));
  add(&saved, tr("Save this view"), "save_view", QKeySequence("Ctrl+B"), [this] { save_view(); });
  add(&saved, tr("Delete the saved views"), "delete_views", {}, [this] { delete_views(); });
  saved.addSeparator();
  for (int number = 1; number <= kMostViews; ++number) {
    const QByteArray name = "view_" + QByteArray::number(number);
    view_actions_.push_back(add(&saved, tr("View %1").arg(number), name.constData(),
                                QKeySequence(QString("Alt+%1").arg(number)), [this, number] { look(number); }));
  }
  refresh();
}

QAction* ViewOptions::add_switch(QMenu& menu, const Add& add, const QString& words, const char* name,
                                 const QKeySequence& keys, std::function<void(bool)> change) {
  const QString key = QString("view/") + name;
  auto* made = add(&menu, words, name, keys, [] {});
  made->setCheckable(true);
  made->setChecked(QSettings().value(key, true).toBool());
  change(made->isChecked());
  connect(made, &QAction::toggled, this, [key, change = std::move(change)](bool on) {
    QSettings().setValue(key, on);
    change(on);
  });
  return made;
}

void ViewOptions::add_stereo(QMenu& menu, const Add& add) {
  auto* group = new QActionGroup(this);
  const auto choice = [&](const QString& words, const char* name, const QKeySequence& keys, StereoMode mode) {
    QAction* made = add(&menu, words, name, keys, [this, mode] { set_stereo(mode); });
    made->setCheckable(true);
    group->addAction(made);
    stereo_.push_back(made);
  };
  choice(tr("Off"), "stereo_off", QKeySequence("Ctrl+Alt+0"), StereoMode::off);
  choice(tr("Anaglyph, for red and cyan glasses"), "stereo_anaglyph", QKeySequence("Ctrl+Alt+1"), StereoMode::anaglyph);
  choice(tr("Side by side"), "stereo_side_by_side", QKeySequence("Ctrl+Alt+2"), StereoMode::side_by_side);
  choice(tr("Quad buffer"), "stereo_quad_buffer", QKeySequence("Ctrl+Alt+3"), StereoMode::quad_buffer);
  stereo_.front()->setChecked(true);
}

void ViewOptions::set_stereo(StereoMode mode) {
  if (view_.set_stereo(mode)) return;
  stereo_.front()->setChecked(true);
  say_(tr("This display has no quad buffer, so stereo is off. Choose anaglyph or side by side."));
}

void ViewOptions::show_bone(const QString& title) {
  title_ = title;
  refresh();
}

QString ViewOptions::key() const {
  // A slash would make a group of the settings.
  return "views/" + QString(title_).replace('/', '-').replace('\\', '-');
}

void ViewOptions::save_view() {
  QSettings settings;
  QVariantList views = settings.value(key()).toList();
  if (views.size() >= kMostViews) return say_(tr("Nine views are saved already. Delete them first."));
  views << QVariant(numbers_of(view_.camera()));
  settings.setValue(key(), views);
  refresh();
  say_(tr("Saved as view %1.").arg(views.size()));
}

void ViewOptions::delete_views() {
  QSettings().remove(key());
  refresh();
}

void ViewOptions::look(int number) {
  const QVariantList numbers = QSettings().value(key()).toList().value(number - 1).toList();
  if (numbers.size() != kNumbers) return;
  CameraView view = view_.camera();
  int i = 0;
  for (Vec3* v : {&view.eye_mm, &view.target_mm, &view.up})
    for (int axis = 0; axis < 3; ++axis) (*v)[axis] = numbers[i++].toDouble();
  const bool usable = (view.eye_mm - view.target_mm).cross(view.up).norm() > 0.0;
  if (usable) view_.look(view);
}

void ViewOptions::refresh() {
  const int count = QSettings().value(key()).toList().size();
  for (int i = 0; i < kMostViews; ++i) view_actions_[static_cast<std::size_t>(i)]->setVisible(i < count);
}

}  // namespace osteon
