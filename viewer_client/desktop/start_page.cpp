#include "viewer_client/desktop/start_page.hpp"

#include <QCoreApplication>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QListWidget>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"

namespace osteon {

namespace {

QLabel* heading(const QString& words) {
  auto* label = new QLabel(words);
  QFont font = label->font();
  font.setPointSizeF(1.25 * font.pointSizeF());
  font.setBold(true);
  label->setFont(font);
  return label;
}

}  // namespace

StartPage::StartPage(Events events, QWidget* parent) : QWidget(parent), events_(std::move(events)) {
  auto* title = new QLabel("Osteon");
  QFont large = title->font();
  large.setPointSizeF(2.4 * large.pointSizeF());
  title->setFont(large);
  auto* what = new QLabel(tr("Practise bone surgery. For research and teaching; not a medical device."));
  what->setWordWrap(true);
  make_lists();
  auto* grid = new QGridLayout;
  grid->addWidget(heading(tr("Bones to practise on")), 0, 0);
  grid->addWidget(heading(tr("Go on with")), 0, 1);
  grid->addWidget(heading(tr("Your own")), 0, 2);
  grid->addWidget(examples_, 1, 0);
  grid->addWidget(recent_, 1, 1);
  grid->addLayout(make_buttons(), 1, 2);
  for (int column = 0; column < 3; ++column) grid->setColumnStretch(column, column < 2 ? 3 : 2);

  words_ = new QLabel;
  words_->setObjectName("words");
  words_->setWordWrap(true);
  progress_ = new QProgressBar;
  progress_->setAccessibleName(tr("Progress"));
  cancel_ = new QPushButton(tr("Cancel"));
  cancel_->setObjectName("cancel");
  connect(cancel_, &QPushButton::clicked, this, [this] { events_.cancel(); });
  auto* work = new QHBoxLayout;
  work->addWidget(progress_, 1);
  work->addWidget(cancel_);

  auto* all = new QVBoxLayout(this);
  all->setContentsMargins(40, 30, 40, 30);
  all->setSpacing(14);
  all->addWidget(title);
  all->addWidget(what);
  all->addLayout(grid, 1);
  all->addWidget(words_);
  all->addLayout(work);
  end_work({});
  refresh();
}

void StartPage::make_lists() {
  examples_ = new QListWidget;
  examples_->setObjectName("examples");
  examples_->setAccessibleName(tr("Bones to practise on"));
  recent_ = new QListWidget;
  recent_->setObjectName("recent");
  recent_->setAccessibleName(tr("Sessions to go on with"));
  for (QListWidget* list : {examples_, recent_}) {
    // One click opens, as on any start page. Enter does the same for the keyboard. A double click does both; the list
    // is disabled after the first.
    const auto open = [this, list](QListWidgetItem* item) {
      if (list->isEnabled() && list->isVisible()) open_row(*list, list->row(item));
    };
    connect(list, &QListWidget::itemClicked, this, open);
    connect(list, &QListWidget::itemActivated, this, open);
    choices_.push_back(list);
  }
}

void StartPage::open_row(const QListWidget& list, int row) {
  const auto index = static_cast<std::size_t>(std::max(0, row));
  if (&list == examples_) {
    const std::vector<ExampleBone> bones = example_bones();
    if (index < bones.size()) events_.open_example(bones[index]);
  } else {
    const std::vector<RecentEntry> entries = recent_entries();
    if (index < entries.size()) events_.open_recent(entries[index]);
  }
}

QVBoxLayout* StartPage::make_buttons() {
  auto* column = new QVBoxLayout;
  const auto add = [&](const QString& words, const char* name, const QString& tip, std::function<void()>* call) {
    auto* button = new QPushButton(words);
    button->setObjectName(name);
    button->setToolTip(tip);
    connect(button, &QPushButton::clicked, this, [call] { (*call)(); });
    choices_.push_back(button);
    column->addWidget(button);
  };
  add(tr("&Import a CT…"), "import",
      tr("Make a case from a folder of DICOM files, a zip or ISO file, NIfTI, NRRD or MetaImage"),
      &events_.import_scan);
  add(tr("&Open a case…"), "open", tr("Open an .osteon file, or the case.json of a folder"), &events_.open_case);
  add(tr("&Join a room…"), "join", tr("Join a room on a server, with certificate and ticket"), &events_.join_room);
  column->addStretch();
  return column;
}

void StartPage::refresh() {
  examples_->clear();
  for (const ExampleBone& bone : example_bones()) examples_->addItem(bone.title);
  recent_->clear();
  for (const RecentEntry& entry : recent_entries()) recent_->addItem(entry.title);
  if (examples_->count() > 0) examples_->setCurrentRow(0);
}

void StartPage::show_work(const QString& what) {
  words_->setText(what);
  progress_->setRange(0, 0);
  progress_->show();
  cancel_->show();
  const QString reason = tr("A bone or a room is being opened. Wait for it, or cancel it.");
  for (QWidget* choice : choices_) set_enabled(*choice, false, reason);
}

void StartPage::show_progress(int percent) {
  progress_->setRange(0, 100);
  progress_->setValue(percent);
}

void StartPage::end_work(const QString& sentence) {
  words_->setText(sentence);
  progress_->hide();
  cancel_->hide();
  for (QWidget* choice : choices_) set_enabled(*choice, true, {});
}

}  // namespace osteon
