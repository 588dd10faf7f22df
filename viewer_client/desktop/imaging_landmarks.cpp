#include "viewer_client/desktop/imaging_landmarks.hpp"

#include <QAction>
#include <QComboBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLineEdit>
#include <QListWidget>
#include <QLocale>
#include <QPushButton>
#include <QTimer>
#include <algorithm>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/landmark_names.hpp"

namespace osteon {

namespace {
constexpr int kLandmarkList_px = 64;  // height
constexpr int kLandmarkName = Qt::UserRole;
}  // namespace

ImagingLandmarks::ImagingLandmarks(Events events, QWidget* parent) : QWidget(parent), events_(std::move(events)) {
  auto* form = new QFormLayout(this);
  form->setContentsMargins(0, 0, 0, 0);
  name_ = new QComboBox;
  name_->setObjectName("landmark_name");
  name_->setAccessibleName(tr("Name of the next landmark"));
  name_->setToolTip(tr("Name of the landmark that the next click with Landmark sets. One that is there moves."));
  name_->setEditable(true);
  name_->setInsertPolicy(QComboBox::NoInsert);
  name_->addItems(suggested_landmarks());
  // The page is narrow. A long name scrolls.
  name_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  name_->clearEditText();
  form->addRow(tr("Landmark"), name_);
  list_ = new QListWidget;
  list_->setObjectName("landmarks");
  list_->setAccessibleName(tr("Landmarks"));
  list_->setToolTip(tr("A click or Enter shows one, and the next click with Landmark moves it. F2 renames it."));
  list_->setFixedHeight(kLandmarkList_px);
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  list_->setTextElideMode(Qt::ElideMiddle);
  connect(list_, &QListWidget::itemClicked, this, [this](QListWidgetItem* item) { show_item(item); });
  connect(list_, &QListWidget::itemActivated, this, [this](QListWidgetItem* item) { show_item(item); });
  // The keyboard's focus alone makes the first one the current one: that chooses no name.
  connect(list_, &QListWidget::currentItemChanged, this, [this](QListWidgetItem* item) {
    if (!filling_) set_enabled(*remove_, item != nullptr, tr("Choose a landmark in the list first."));
  });
  connect(list_, &QListWidget::itemChanged, this, [this](QListWidgetItem* item) {
    if (filling_) return;
    const std::string before = item->data(kLandmarkName).toString().toStdString();
    // Later, since the list is filled anew, and its editor is still at work.
    QTimer::singleShot(0, this, [this, before, other = landmark_name(item->text())] { events_.rename(before, other); });
  });
  remove_ = new QPushButton(tr("Remove"));
  remove_->setObjectName("landmark_remove");
  remove_->setToolTip(tr("Removes the landmark that is chosen in the list, also with Del"));
  const auto remove = [this] {
    if (const QListWidgetItem* item = list_->currentItem())
      events_.remove(item->data(kLandmarkName).toString().toStdString());
  };
  connect(remove_, &QPushButton::clicked, this, remove);
  auto* deletes = new QAction(list_);
  deletes->setShortcut(QKeySequence::Delete);
  deletes->setShortcutContext(Qt::WidgetShortcut);
  connect(deletes, &QAction::triggered, this, remove);
  list_->addAction(deletes);
  auto* row = new QHBoxLayout;
  row->addWidget(list_, 1);
  row->addWidget(remove_);
  form->addRow(row);
  follow({});
}

std::string ImagingLandmarks::name() const { return landmark_name(name_->currentText()); }

void ImagingLandmarks::show_item(const QListWidgetItem* item) {
  name_->setEditText(item->text());
  events_.show(item->data(kLandmarkName).toString().toStdString());
}

void ImagingLandmarks::follow(const ImagingEdits& edits) {
  filling_ = true;
  const QListWidgetItem* chosen = list_->currentItem();
  const QString before = chosen != nullptr ? chosen->data(kLandmarkName).toString() : QString();
  list_->clear();
  for (const MarkedLandmark& landmark : edits.landmarks) {
    const QString name = QString::fromStdString(landmark.name);
    auto* item = new QListWidgetItem(landmark_title(landmark.name), list_);
    item->setData(kLandmarkName, name);
    item->setFlags(item->flags() | Qt::ItemIsEditable);
    const auto mm = [](double value) { return QLocale().toString(value, 'f', 1); };
    item->setToolTip(tr("%1, %2, %3 mm").arg(mm(landmark.at_mm.x()), mm(landmark.at_mm.y()), mm(landmark.at_mm.z())));
    if (name == before) list_->setCurrentItem(item);
  }
  filling_ = false;
  set_enabled(*remove_, list_->currentItem() != nullptr, tr("Choose a landmark in the list first."));
  const bool used = std::ranges::find(edits.landmarks, name(), &MarkedLandmark::name) != edits.landmarks.end();
  if (used || name().empty()) name_->setEditText(QString::fromStdString(next_landmark(edits)));
}

}  // namespace osteon
