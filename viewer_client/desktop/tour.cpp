#include "viewer_client/desktop/tour.hpp"

#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QPushButton>
#include <QSettings>
#include <QVBoxLayout>
#include <algorithm>
#include <utility>

namespace osteon {

namespace {

constexpr const char* kSeenKey = "tour/seen";
constexpr int kSteps = 5;
constexpr const char* kTargets[kSteps] = {"examples", "tools", "bone", "push_set", "undo_button"};
constexpr int kCardWidth_px = 330, kGap_px = 10, kRing_px = 3;
constexpr int kPlacePeriod_ms = 200;  // what it points at may move

}  // namespace

Tour::Tour(QWidget* window) : QFrame(window) {
  setObjectName("tour");
  setFrameShape(QFrame::Box);
  setAutoFillBackground(true);
  ring_ = new QFrame(window);
  ring_->setObjectName("tour_ring");
  ring_->setAttribute(Qt::WA_TransparentForMouseEvents);
  ring_->setStyleSheet(QString("QFrame#tour_ring { border: %1px solid #e69f00; }").arg(kRing_px));
  title_ = new QLabel;
  QFont bold = title_->font();
  bold.setBold(true);
  title_->setFont(bold);
  words_ = new QLabel;
  words_->setObjectName("tour_words");
  words_->setWordWrap(true);
  next_ = new QPushButton(tr("&Next step"));
  next_->setObjectName("tour_next");
  skip_ = new QPushButton(tr("End the tour"));
  skip_->setObjectName("tour_skip");
  auto* buttons = new QHBoxLayout;
  buttons->addStretch();
  buttons->addWidget(skip_);
  buttons->addWidget(next_);
  auto* all = new QVBoxLayout(this);
  all->addWidget(title_);
  all->addWidget(words_);
  all->addLayout(buttons);
  connect(next_, &QPushButton::clicked, this, [this] { show_step(step_ + 1); });
  connect(skip_, &QPushButton::clicked, this, [this] { end(); });
  connect(&timer_, &QTimer::timeout, this, [this] { place(); });
  end();
}

void Tour::begin_once() {
  QSettings settings;
  if (settings.value(kSeenKey, false).toBool()) return;
  settings.setValue(kSeenKey, true);
  if (!running()) show_step(0);
}

void Tour::begin(TourStep from) {
  paused_ = false;
  show_step(static_cast<int>(from));
  next_->setFocus();
}

void Tour::end() {
  step_ = -1;
  timer_.stop();
  const bool focused = isAncestorOf(window()->focusWidget());
  ring_->hide();
  hide();
  // A keyboard without a place to type would be a trap.
  if (focused && parentWidget() != nullptr) parentWidget()->setFocus();
}

void Tour::pause(bool on) {
  if (std::exchange(paused_, on) == on || !running()) return;
  if (!on) return show_step(step_);
  timer_.stop();
  ring_->hide();
  hide();
}

void Tour::did(TourStep step) {
  if (running() && step_ == static_cast<int>(step)) show_step(step_ + 1);
}

void Tour::show_step(int step) {
  if (step >= kSteps) return end();
  step_ = step;
  const QString words[kSteps] = {
      tr("Open a bone: click on the skull, or choose it with the arrow keys and press Enter."),
      tr("Take a tool: click on the drill in this bar, or choose it in the menu Tools."),
      tr("Point at the bone and hold the left button. A hand then pushes the tool in."),
      tr("Turn the wheel over the bone, or change this number: it is how hard the hand pushes."),
      tr("Undo, also Ctrl+Z, takes back the last push. Help > Tour shows these steps again.")};
  title_->setText(tr("Step %1 of %2").arg(step + 1).arg(kSteps));
  words_->setText(words[step]);
  next_->setText(step + 1 < kSteps ? tr("&Next step") : tr("&Done"));
  setAccessibleName(title_->text());
  setAccessibleDescription(words_->text());
  next_->setAccessibleDescription(words_->text());
  if (paused_) return;
  place();
  show();
  timer_.start(kPlacePeriod_ms);
}

void Tour::place() {
  const QWidget* frame = parentWidget();
  const auto* target = frame->findChild<QWidget*>(kTargets[step_]);  // if it is hidden, the card is alone
  const bool seen = target != nullptr && target->isVisible();
  const QRect rect = seen ? QRect(target->mapTo(frame, QPoint(0, 0)), target->size()) : QRect();
  // Within a large target the card covers no neighbour, so it may become narrower.
  const int room_px = rect.width() - 2 * kGap_px;
  const bool wide = 3 * rect.width() > 2 * kCardWidth_px && room_px >= layout()->minimumSize().width();
  const int width_px = wide ? std::min(kCardWidth_px, room_px) : kCardWidth_px;
  resize(width_px, std::max(layout()->totalHeightForWidth(width_px), layout()->minimumSize().height()));
  QPoint at((frame->width() - width()) / 2, frame->height() - height() - 4 * kGap_px);
  if (seen) {
    ring_->setGeometry(rect.adjusted(-kRing_px, -kRing_px, kRing_px, kRing_px));
    if (wide && rect.height() > 2 * height())
      at = {rect.left() + kGap_px, rect.bottom() - height() - kGap_px};
    else if (rect.height() > rect.width())
      at = {rect.right() + kGap_px, rect.top() + kGap_px};
    else if (rect.center().x() > frame->width() / 2)
      at = {rect.left() - width() - kGap_px, rect.top()};
    else
      at = {rect.left(), rect.bottom() + kGap_px};
  }
  at.setX(std::clamp(at.x(), 0, std::max(0, frame->width() - width())));
  at.setY(std::clamp(at.y(), 0, std::max(0, frame->height() - height())));
  move(at);
  ring_->setVisible(seen);
  ring_->raise();
  raise();
}

bool Tour::event(QEvent* event) {
  const bool key = event->type() == QEvent::ShortcutOverride || event->type() == QEvent::KeyPress;
  if (key && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape) {
    // The window's own Escape also puts the tool down. Within the card it only ends the tour.
    event->accept();
    if (event->type() == QEvent::KeyPress) end();
    return true;
  }
  return QFrame::event(event);
}

}  // namespace osteon
