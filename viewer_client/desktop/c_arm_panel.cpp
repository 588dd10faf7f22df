#include "viewer_client/desktop/c_arm_panel.hpp"

#include <QApplication>
#include <QBuffer>
#include <QComboBox>
#include <QDateTime>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLocale>
#include <QMetaObject>
#include <QPainter>
#include <QPushButton>
#include <QSlider>
#include <QStringList>
#include <QTime>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/files.hpp"
#include "viewer_client/desktop/edge_letters.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/inside_link.hpp"

namespace osteon {

namespace {

constexpr int kPedalPeriod_ms = 10, kStatusPeriod_ms = 200;
constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr int kStepsOfUnit = 10;  // of a slider: tenths of a degree or of a millimetre

struct PedalKey {
  int key;
  ShotMode mode;
};
constexpr PedalKey kPedalKeys[] = {
    {Qt::Key_F7, ShotMode::single}, {Qt::Key_F8, ShotMode::pulse}, {Qt::Key_F9, ShotMode::live}};

// Null: the key is no pedal.
const PedalKey* pedal_of(int key) {
  for (const PedalKey& pedal : kPedalKeys)
    if (pedal.key == key) return &pedal;
  return nullptr;
}

ScreenPicture screen_picture(const CArmPicture& picture) {
  const QImage image(picture.grey.data(), picture.columns, picture.rows, picture.columns, QImage::Format_Grayscale8);
  return {image.copy(), picture.letters};
}

}  // namespace

// A picture as large as there is room for it, on black, with the letters of the patient's sides.
class CArmScreen : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(CArmScreen)

 public:
  CArmScreen(const QString& what, const char* name, int least_width) : what_(what) {
    setObjectName(name);
    setAccessibleName(what);
    setToolTip(what);
    setMinimumSize(least_width, least_width * 3 / 4);
    setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
  }
  void show_picture(const ScreenPicture& picture, const QString& what) {
    picture_ = picture;
    what_ = what;
    if (toolTip() != what) setToolTip(what);
    const EdgeLetters& at = picture.letters;
    const QString name = picture.image.isNull()
                             ? what_
                             : tr("%1: left %2, right %3, top %4, bottom %5")
                                   .arg(what_, QString::fromStdString(at.left), QString::fromStdString(at.right),
                                        QString::fromStdString(at.top), QString::fromStdString(at.bottom));
    // A reader of the screen hears of a new name. Live pictures keep theirs.
    if (name != accessibleName()) setAccessibleName(name);
    update();
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    QPainter painter(this);
    painter.fillRect(rect(), Qt::black);
    if (picture_.image.isNull()) {
      painter.setPen(Qt::gray);
      painter.drawText(rect(), Qt::AlignCenter | Qt::TextWordWrap, tr("No picture yet"));
      return;
    }
    QRect shown({}, picture_.image.size().scaled(size(), Qt::KeepAspectRatio));
    shown.moveCenter(rect().center());
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    painter.drawImage(shown, picture_.image);
    paint_edge_letters(painter, shown, picture_.letters);
  }

 private:
  QString what_;
  ScreenPicture picture_;
};

struct CArmPanel::Mailbox {
  Mutex mutex{LockRank::leaf};
  CArmPanel* panel OSTEON_GUARDED_BY(mutex) = nullptr;  // null: it is gone

  // `receive` takes it in the GUI thread. [inside thread]
  using Receive = void (CArmPanel::*)(const std::shared_ptr<const CArmPicture>&);
  void post(std::shared_ptr<const CArmPicture> picture, Receive receive) {
    const MutexLock lock(mutex);
    if (panel == nullptr) return;
    QMetaObject::invokeMethod(
        panel, [to = panel, receive, picture = std::move(picture)] { (to->*receive)(picture); }, Qt::QueuedConnection);
  }
};

CArmPanel::CArmPanel(InsideLink& inside, Events events, QWidget* parent)
    : QWidget(parent),
      inside_(inside),
      events_(std::move(events)),
      console_(static_cast<std::uint64_t>(QDateTime::currentMSecsSinceEpoch())),
      mailbox_(std::make_shared<Mailbox>()) {
  {
    const MutexLock lock(mailbox_->mutex);
    mailbox_->panel = this;
  }
  setObjectName("c_arm");
  const auto image = [this](Mailbox::Receive receiver) {
    return std::make_shared<CArmImage>([to = mailbox_, receiver](std::shared_ptr<const CArmPicture> picture) {
      to->post(std::move(picture), receiver);
    });
  };
  image_ = image(&CArmPanel::receive);
  others_image_ = image(&CArmPanel::receive_others);
  auto* all = new QVBoxLayout(this);
  all->addLayout(make_screens(), 1);
  words_ = new QLabel;
  words_->setObjectName("c_arm_words");
  words_->setWordWrap(true);
  words_->setTextFormat(Qt::PlainText);  // it has names of people
  all->addWidget(words_);
  all->addLayout(make_pedals());
  all->addLayout(make_views());
  auto* form = new QFormLayout;
  make_rows(*form);
  make_counters(*form);
  all->addLayout(form);
  others_ = new OthersShots([this](const std::optional<ShotRun>& run) { show_others(run); });
  all->addWidget(others_);
  pedal_timer_.setInterval(kPedalPeriod_ms);
  status_timer_.setInterval(kStatusPeriod_ms);
  share_timer_.setInterval(SharedShots::kApart);
  connect(&share_timer_, &QTimer::timeout, this, [this] { share(); });
  connect(&pedal_timer_, &QTimer::timeout, this, [this] { tick(); });
  connect(&status_timer_, &QTimer::timeout, this, [this] {
    take_others();
    show_status();
  });
  show_position();
  show_counters();
  show_status();
}

CArmPanel::~CArmPanel() {
  inside_.set_visible(image_, false);
  inside_.set_visible(others_image_, false);
  const MutexLock lock(mailbox_->mutex);
  mailbox_->panel = nullptr;
}

QLayout* CArmPanel::make_screens() {
  auto* screens = new QHBoxLayout;
  last_ = new CArmScreen(tr("The last picture"), "c_arm_last", 140);
  before_ = new CArmScreen(tr("The picture before it"), "c_arm_before", 70);
  screens->addWidget(last_, 2);
  screens->addWidget(before_, 1);
  return screens;
}

QLayout* CArmPanel::make_pedals() {
  auto* pedals = new QHBoxLayout;
  const auto button = [&](const QString& words, const char* name, const QString& tip) {
    auto* made = new QPushButton(words);
    made->setObjectName(name);
    made->setToolTip(tip);
    pedals->addWidget(made);
    return made;
  };
  single_ = button(tr("Shot"), "c_arm_shot", tr("One X-ray picture (F7)"));
  pulse_ = button(tr("Pulse"), "c_arm_pulse", tr("Hold it: %1 pictures a second (F8)").arg(kPulses_per_s));
  live_ = button(tr("Live"), "c_arm_live", tr("Hold it: X-rays all the time (F9)"));
  connect(single_, &QPushButton::clicked, this, [this] { press(ShotMode::single); });
  for (const auto& [held, mode] : {std::pair(pulse_, ShotMode::pulse), {live_, ShotMode::live}}) {
    connect(held, &QPushButton::pressed, this, [this, mode = mode] { press(mode); });
    connect(held, &QPushButton::released, this, [this] { release(); });
  }
  return pedals;
}

QLayout* CArmPanel::make_views() {
  auto* all = new QVBoxLayout;
  auto* views = new QHBoxLayout;
  auto* centres = new QHBoxLayout;
  const auto button = [&](QHBoxLayout& to, const QString& words, const char* name, const QString& tip,
                          std::function<void()> call) {
    auto* made = new QPushButton(words);
    made->setObjectName(name);
    made->setToolTip(tip);
    connect(made, &QPushButton::clicked, this, [this, call = std::move(call)] {
      call();
      show_position();
      moved();
    });
    to.addWidget(made);
  };
  button(*views, tr("AP"), "c_arm_ap", tr("Anteroposterior: the tube behind the patient"),
         [this] { console_.take_view(radiology::View::anteroposterior); });
  button(*views, tr("Lateral"), "c_arm_lateral", tr("From the side"),
         [this] { console_.take_view(radiology::View::lateral); });
  button(*views, tr("Axial"), "c_arm_axial", tr("Along the patient"),
         [this] { console_.take_view(radiology::View::axial); });
  button(*centres, tr("Bone in the middle"), "c_arm_middle", tr("The arm turns about the middle of the bone"),
         [this] { console_.set_isocentre(console_.middle_of_bone()); });
  button(*centres, tr("Tip in the middle"), "c_arm_tip", tr("The arm turns about the tip of your tool"), [this] {
    if (const std::optional<Vec3> tip = events_.in_beam().tip_mm) return console_.set_isocentre(*tip);
    events_.say(tr("Your hand holds no tool. Take one first."));
  });
  kind_ = new QComboBox;
  kind_->setObjectName("c_arm_kind");
  kind_->setAccessibleName(tr("Kind of picture"));
  kind_->setToolTip(tr("Maximum intensity: the densest bone on each ray, without X-rays"));
  kind_->addItem(tr("X-ray"));
  kind_->addItem(tr("Maximum intensity"));
  connect(kind_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, [this] { show_maximum(); });
  save_ = new QPushButton(tr("Save…"));
  save_->setObjectName("c_arm_save");
  save_->setToolTip(tr("Saves the picture that is shown as a PNG file"));
  connect(save_, &QPushButton::clicked, this, [this] { choose_file(); });
  auto* picture = new QHBoxLayout;  // beside the pedals it would make the panel wider than others are
  picture->addWidget(kind_, 1);
  picture->addWidget(save_);
  all->addLayout(picture);
  all->addLayout(views);
  all->addLayout(centres);
  return all;
}

void CArmPanel::make_rows(QFormLayout& form) {
  constexpr int kOrbit_deg = 180, kTilt_deg = 90;
  static_assert(kOrbit_deg * kDegree_rad - kMostOrbit_rad < 1e-9 && kTilt_deg * kDegree_rad - kMostTilt_rad < 1e-9);
  const QString degree = "°", mm = tr(" mm");
  rows_[0] = add_row(form, tr("Orbit"), "c_arm_orbit", kOrbit_deg, degree,
                     [this](double degrees) { console_.set_orbit(degrees * kDegree_rad); });
  rows_[1] = add_row(form, tr("Tilt"), "c_arm_tilt", kTilt_deg, degree,
                     [this](double degrees) { console_.set_tilt(degrees * kDegree_rad); });
  // DICOM LPS: x to the patient's left, y to the back, z to the head.
  const QString ways[] = {tr("To the left"), tr("To the back"), tr("To the head")};
  const char* names[] = {"c_arm_x", "c_arm_y", "c_arm_z"};
  for (int axis = 0; axis < 3; ++axis)
    rows_[static_cast<std::size_t>(2 + axis)] =
        add_row(form, ways[axis], names[axis], static_cast<int>(kMostTranslation_mm), mm,
                [this, axis](double moved_mm) { console_.set_translation(axis, moved_mm); });
}

CArmPanel::Row CArmPanel::add_row(QFormLayout& form, const QString& what, const char* name, int most,
                                  const QString& unit, std::function<void(double)> set) {
  Row row{new QSlider(Qt::Horizontal), new QDoubleSpinBox};
  row.slider->setObjectName(QString(name) + "_slider");
  row.slider->setRange(-most * kStepsOfUnit, most * kStepsOfUnit);
  row.slider->setSingleStep(kStepsOfUnit);
  row.slider->setPageStep(15 * kStepsOfUnit);
  row.box->setObjectName(name);
  row.box->setRange(-most, most);
  row.box->setDecimals(1);
  row.box->setSuffix(unit);
  row.box->setKeyboardTracking(false);  // half a typed number does not count
  for (QWidget* part : {static_cast<QWidget*>(row.slider), static_cast<QWidget*>(row.box)}) {
    part->setAccessibleName(what);
    part->setToolTip(tr("%1: at most %2 to either side").arg(what, QString::number(most) + unit));
  }
  const auto change = [this, set = std::move(set)](double value) {
    if (showing_) return;
    set(value);
    show_position();
    moved();
  };
  connect(row.slider, &QSlider::valueChanged, this,
          [change](int steps) { change(static_cast<double>(steps) / kStepsOfUnit); });
  connect(row.box, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this, change);
  auto* both = new QHBoxLayout;
  both->addWidget(row.slider, 1);
  both->addWidget(row.box);
  form.addRow(what, both);
  return row;
}

void CArmPanel::make_counters(QFormLayout& form) {
  const auto label = [&](const QString& what, const char* name) {
    auto* made = new QLabel;
    made->setObjectName(name);
    form.addRow(what, made);
    return made;
  };
  shots_ = label(tr("Shots"), "c_arm_shots");
  seconds_ = label(tr("Exposure"), "c_arm_seconds");
  dose_ = label(tr("Dose-area product"), "c_arm_dose");
  auto* warning = new QLabel(tr("Nominal: it follows from the setting of the tube alone.") + ' ' +
                             tr("It is no dose of a person."));
  warning->setObjectName("c_arm_warning");
  warning->setWordWrap(true);
  form.addRow(warning);
}

void CArmPanel::show_position() {
  const CArmPosition& at = console_.position();
  const double values[] = {at.orbit_rad / kDegree_rad, at.tilt_rad / kDegree_rad, at.translation_mm.x(),
                           at.translation_mm.y(), at.translation_mm.z()};
  showing_ = true;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    rows_[i].slider->setValue(static_cast<int>(std::lround(values[i] * kStepsOfUnit)));
    rows_[i].box->setValue(values[i]);
  }
  showing_ = false;
}

void CArmPanel::show_counters() {
  const ShotTotals& totals = console_.totals();
  shots_->setText(QString::number(totals.shots));
  seconds_->setText(tr("%1 s").arg(QLocale().toString(totals.exposure_s, 'f', 2)));
  dose_->setText(tr("%1 Gy cm²").arg(QLocale().toString(totals.dose_area_gy_cm2, 'f', 5)));
}

QString CArmPanel::trouble() const {
  const std::optional<InsideStatus> now = inside_.status();
  if (!in_room_ || !now) return tr("Open a bone or join a room first.");
  switch (now->state) {
    case InsideState::begins:
      return tr("The inside of the bone is on its way.");
    case InsideState::makes:
      return tr("The inside of the bone is computed: %1 %").arg(std::lround(100.0 * now->progress));
    case InsideState::failed:
      return now->why ? QString::fromStdString(now->why->message) : tr("The inside of the bone is not there.");
    case InsideState::follows:
    case InsideState::interrupted:  // the pictures show the bone as it was
      break;
  }
  return {};
}

void CArmPanel::show_status() {
  const QString trouble = this->trouble();
  // What is on its way never comes then.
  if (!trouble.isEmpty()) stop();
  const std::optional<InsideStatus> now = inside_.status();
  const QString words = !trouble.isEmpty() ? trouble : now ? words_about(*now) : QString();
  if (words_->text() != words) words_->setText(words);
  words_->setVisible(!words.isEmpty());
  const QString reason = maximum() ? tr("Maximum intensity needs no X-rays. Choose X-ray first.") : trouble;
  for (QPushButton* pedal : {single_, pulse_, live_})
    if (pedal->isEnabled() != reason.isEmpty() || !reason.isEmpty()) set_enabled(*pedal, reason.isEmpty(), reason);
  const bool any = !shown().image.isNull();
  if (save_->isEnabled() != any || !any) set_enabled(*save_, any, tr("There is no picture yet."));
}

QString CArmPanel::words_about(const InsideStatus& now) const {
  QStringList words;
  if (others_->shown())
    words << tr("%1: made again from the bone and the tools as they were at %2.")
                 .arg(others_->title(*others_->shown()), others_time_);
  else if (others_->of_other())
    words << tr("The room has no picture of this person any more.");
  if (now.state == InsideState::interrupted) words << tr("The connection is lost. Pictures show the bone as it was.");
  if (!fault_.isEmpty()) words << fault_;
  if (observes_)
    words << tr("You are an observer: the others do not see your shots.");
  else if (not_shared_)
    words << tr("The others do not see your shots: %1").arg(QString::fromStdString(not_shared_->message));
  return words.join(' ');
}

const ScreenPicture& CArmPanel::shown() const {
  if (others_->of_other()) return others_shot_;
  return maximum() ? projection_ : shot_;
}

void CArmPanel::show_screens() {
  const bool others = others_->of_other();
  last_->show_picture(shown(), others ? tr("A picture of another person") : tr("The last picture"));
  before_->show_picture(maximum() || others ? ScreenPicture() : shot_before_, tr("The picture before it"));
}

void CArmPanel::enter(const Box& bone, const std::filesystem::path& session) {
  leave();
  in_room_ = true;
  ShotFile::Kept kept;
  if (!session.empty()) kept = file_.emplace(session).read();
  console_.begin(bone, kept.shots);
  fault_ = kept.fault ? QString::fromStdString(*kept.fault) : QString();
  show_position();
  show_counters();
  show_status();
}

void CArmPanel::leave() {
  stop();
  in_room_ = false;
  // Whoever has made room on the disk need not shoot again.
  if (file_)
    if (const Result<void> kept = file_->catch_up(); !kept) events_.say(QString::fromStdString(kept.error().message));
  file_.reset();
  metal_.reset();
  tools_known_ = 0;
  fault_.clear();
  console_.begin({}, {});
  picture_.reset();
  shot_ = shot_before_ = projection_ = {};
  shared_.begin();
  share_timer_.stop();
  observes_ = false;
  not_shared_.reset();
  others_->reset();
  kind_->setCurrentIndex(0);
  show_screens();
  show_position();
  show_counters();
  show_status();
}

void CArmPanel::stop() {
  console_.stop();
  pedal_timer_.stop();
  image_->drop();
}

bool CArmPanel::maximum() const { return kind_->currentIndex() == 1; }

void CArmPanel::show_maximum() {
  image_->show_maximum(maximum() ? std::optional(console_.position()) : std::nullopt);
  if (maximum()) {
    release();
    others_->choose_own();
  }
  inside_.wake();
  show_screens();
  show_status();
}

// While nobody presses a pedal, the last picture stays, wherever the arm goes: X-rays are shot by a pedal alone.
void CArmPanel::moved() {
  if (maximum()) {
    image_->show_maximum(console_.position());
    inside_.wake();
  }
  tick();
}

void CArmPanel::press(ShotMode mode) {
  if (!isVisible() || !isEnabled() || !in_room_ || !single_->isEnabled()) return;
  others_->choose_own();
  console_.press(mode, CArmConsole::Clock::now());
  run_begins_ = true;
  // What was refused once may be taken now, but a server that is too old stays so.
  if (not_shared_ && not_shared_->code != ErrorCode::unsupported) not_shared_.reset();
  pedal_timer_.start();
  tick();
}

void CArmPanel::release() { console_.release(); }

void CArmPanel::tick() {
  const std::optional<ShotOrder> order = console_.due(CArmConsole::Clock::now());
  if (!order) {
    if (console_.idle()) pedal_timer_.stop();
    return;
  }
  image_->make(*order, QDateTime::currentMSecsSinceEpoch(), metal_in_beam());
  inside_.wake();
}

std::vector<PlacedMetal> CArmPanel::metal_in_beam() {
  const InBeam seen = events_.in_beam();
  if (!metal_) metal_.emplace();
  for (; tools_known_ < seen.tools.size(); ++tools_known_) metal_->learn(seen.tools[tools_known_]);
  return metal_->of(seen.states, seen.items);
}

void CArmPanel::receive(const std::shared_ptr<const CArmPicture>& picture) {
  if (picture->order == 0) {
    if (!in_room_) return;
    // Kept while X-rays are shown, too: it is not made again unless something changes.
    projection_ = screen_picture(*picture);
    show_screens();
    return show_status();
  }
  const CArmConsole::Came came = console_.came(picture->order, picture->coarse, picture->shot);
  if (came == CArmConsole::Came::dropped) return;
  if (came == CArmConsole::Came::shot) keep_shot();
  picture_ = picture;
  shot_ = screen_picture(*picture);
  show_screens();
  show_status();
  tick();
  if (console_.idle()) pedal_timer_.stop();
}

// The picture beside the last one is that of the press before it: a live picture changes too soon to be compared with.
void CArmPanel::keep_shot() {
  const bool first = std::exchange(run_begins_, false);
  if (first) shot_before_ = shot_;
  show_counters();
  shared_.add(console_.shots().back(), first, console_.totals());
  share();
  if (!file_) return;
  if (const Result<void> kept = file_->add(console_.shots().back()); !kept) {
    fault_ = QString::fromStdString(kept.error().message);
    events_.say(fault_);
  } else if (file_->waiting() == 0) {
    fault_.clear();
  }
}

// The room is told of what was shot also after the panel was hidden.
void CArmPanel::share() {
  if (observes_ || not_shared_) shared_.begin();
  if (shared_.idle()) return share_timer_.stop();
  share_timer_.start();
  const std::optional<SharedShots::Message> message = shared_.due(SharedShots::Clock::now());
  if (!message) return;
  events_.share(*message, [this, run = message->run](const Result<RoomAnswer>& answer) {
    shared_.answered();
    if (answer || answer.error().code == ErrorCode::cancelled) return;
    // A room that is away for a while gets it later.
    if (answer.error().code == ErrorCode::unavailable) {
      shared_.put_back(run);
      return share_timer_.start();
    }
    not_shared_ = answer.error();
    show_status();
  });
}

void CArmPanel::take_others() {
  if (!in_room_) return;
  const ShotsOfAll all = events_.shots();
  const auto self = std::ranges::find(all.people, all.self, &PersonSeen::author);
  observes_ = self != all.people.end() && self->role == Role::observer;
  others_->take(all);
}

void CArmPanel::show_others(const std::optional<ShotRun>& run) {
  others_picture_.reset();
  // While a press goes on, its last picture stays until the next one is there, and each that comes is shown: the next
  // one may be asked for before this one is there.
  if (!run || !others_run_ || !same_press(*run, *others_run_)) {
    others_shot_ = {};
    others_first_id_ = others_id_ + 1;
  }
  others_run_ = run;
  if (others_->of_other()) kind_->setCurrentIndex(0);
  if (run) {
    others_time_ = QTime::currentTime().toString("HH:mm:ss");
    others_image_->make_again(++others_id_, run->last, metal_in_beam());
    inside_.wake();
  } else {
    others_image_->drop();
  }
  show_screens();
  show_status();
}

void CArmPanel::receive_others(const std::shared_ptr<const CArmPicture>& picture) {
  // One of an earlier choice may still be on its way.
  if (!others_->shown() || picture->order < others_first_id_) return;
  others_picture_ = picture;
  others_shot_ = screen_picture(*picture);
  show_screens();
  show_status();
}

Result<void> CArmPanel::save(const std::filesystem::path& file, bool replace) const {
  const QImage& image = shown().image;
  if (image.isNull()) return failure(ErrorCode::not_found, "there is no picture yet; shoot one first");
  std::error_code ignored;
  if (!replace && std::filesystem::exists(file, ignored))
    return failure(ErrorCode::exists, file.string() + " is there already; choose another name");
  QByteArray bytes;
  QBuffer buffer(&bytes);
  if (!image.save(&buffer, "PNG"))
    return failure(ErrorCode::internal, "there is not enough memory for " + file.string());
  return write_file(file, std::string_view(bytes.constData(), static_cast<std::size_t>(bytes.size())));
}

void CArmPanel::choose_file() {
  // With a suffix of its own the dialog asks before it names a file that is there.
  QFileDialog dialog(this, tr("Save the X-ray picture"), {}, tr("Pictures (*.png)"));
  dialog.setAcceptMode(QFileDialog::AcceptSave);
  dialog.setDefaultSuffix("png");
  dialog.selectFile("x-ray.png");
  if (dialog.exec() != QDialog::Accepted) return;
  const QString file = dialog.selectedFiles().constFirst();
  const Result<void> saved = save(file.toStdString(), true);
  events_.say(saved ? tr("Saved %1.").arg(file) : QString::fromStdString(saved.error().message));
}

void CArmPanel::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  qApp->installEventFilter(this);
  status_timer_.start();
  inside_.set_visible(image_, true);
  inside_.set_visible(others_image_, true);
  take_others();
  show_status();
}

void CArmPanel::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  qApp->removeEventFilter(this);
  status_timer_.stop();
  stop();
  inside_.set_visible(image_, false);
  inside_.set_visible(others_image_, false);
}

void CArmPanel::changeEvent(QEvent* event) {
  QWidget::changeEvent(event);
  if (event->type() == QEvent::EnabledChange && !isEnabled()) release();
}

// The pedals' keys work wherever the keyboard's focus is in the window, and let go with it.
bool CArmPanel::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::WindowDeactivate) release();
  if (event->type() != QEvent::KeyPress && event->type() != QEvent::KeyRelease)
    return QWidget::eventFilter(watched, event);
  const auto* key = static_cast<QKeyEvent*>(event);
  const PedalKey* pedal = pedal_of(key->key());
  if (pedal == nullptr) return QWidget::eventFilter(watched, event);
  // Whatever was pressed or has opened meanwhile, a pedal that comes up lets go.
  const bool comes_up = event->type() == QEvent::KeyRelease && console_.held() == pedal->mode;
  if (!comes_up && (key->modifiers() != Qt::NoModifier || QApplication::activeModalWidget() != nullptr))
    return QWidget::eventFilter(watched, event);
  if (key->isAutoRepeat()) return true;
  if (event->type() == QEvent::KeyPress)
    press(pedal->mode);
  else if (comes_up)
    release();
  return true;
}

}  // namespace osteon
