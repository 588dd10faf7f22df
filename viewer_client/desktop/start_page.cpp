#include "viewer_client/desktop/start_page.hpp"

#include <QCoreApplication>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QListWidget>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <utility>

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

  examples_ = new QListWidget;
  examples_->setObjectName("examples");
  examples_->setAccessibleName(tr("Bones to practise on"));
  recent_ = new QListWidget;
  recent_->setObjectName("recent");
  recent_->setAccessibleName(tr("Sessions to go on with"));
  // One click opens, as on any start page. Enter does the same for the keyboard.
  const auto open_example = [this](QListWidgetItem* item) {
    const auto bones = example_bones();
    const int row = examples_->row(item);
    if (row >= 0 && row < static_cast<int>(bones.size())) events_.open_example(bones[row]);
  };
  const auto open_recent = [this](QListWidgetItem* item) {
    const auto entries = recent_entries();
    const int row = recent_->row(item);
    if (row >= 0 && row < static_cast<int>(entries.size())) events_.open_recent(entries[row]);
  };
  connect(examples_, &QListWidget::itemClicked, this, open_example);
  connect(recent_, &QListWidget::itemClicked, this, open_recent);
  for (QListWidget* list : {examples_, recent_}) {
    connect(list, &QListWidget::itemActivated, this, [this, list, open_example, open_recent](QListWidgetItem* item) {
      // A double click activates, too; its first click has opened already.
      if (!list->isEnabled()) return;
      list == examples_ ? open_example(item) : open_recent(item);
    });
  }

  const auto button = [&](const QString& words, const char* name, const QString& tip, std::function<void()>& call) {
    auto* made = new QPushButton(words);
    made->setObjectName(name);
    made->setToolTip(tip);
    connect(made, &QPushButton::clicked, this, [call = &call] { (*call)(); });
    choices_.push_back(made);
    return made;
  };
  auto* buttons = new QVBoxLayout;
  buttons->addWidget(button(tr("&Import a CT…"), "import",
                            tr("Make a case from a folder of DICOM files, a zip or ISO file, NIfTI, NRRD or MetaImage"),
                            events_.import_scan));
  buttons->addWidget(button(tr("&Open a case…"), "open", tr("Open the folder of a case"), events_.open_case));
  buttons->addWidget(button(tr("&Join a room…"), "join", tr("Join a room on a server, with certificate and ticket"),
                            events_.join_room));
  buttons->addStretch();

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

  auto* grid = new QGridLayout;
  grid->addWidget(heading(tr("Bones to practise on")), 0, 0);
  grid->addWidget(heading(tr("Go on with")), 0, 1);
  grid->addWidget(heading(tr("Your own")), 0, 2);
  grid->addWidget(examples_, 1, 0);
  grid->addWidget(recent_, 1, 1);
  grid->addLayout(buttons, 1, 2);
  for (int column = 0; column < 3; ++column) grid->setColumnStretch(column, column < 2 ? 3 : 2);

  auto* all = new QVBoxLayout(this);
  all->setContentsMargins(40, 30, 40, 30);
  all->setSpacing(14);
  all->addWidget(title);
  all->addWidget(what);
  all->addLayout(grid, 1);
  all->addWidget(words_);
  all->addLayout(work);
  choices_.push_back(examples_);
  choices_.push_back(recent_);
  end_work({});
  refresh();
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
  for (QWidget* choice : choices_) choice->setEnabled(false);
}

void StartPage::show_progress(int percent) {
  progress_->setRange(0, 100);
  progress_->setValue(percent);
}

void StartPage::end_work(const QString& sentence) {
  words_->setText(sentence);
  progress_->hide();
  cancel_->hide();
  for (QWidget* choice : choices_) choice->setEnabled(true);
}

}  // namespace osteon
