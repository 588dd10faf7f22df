#include "viewer_client/desktop/send_dialog.hpp"

#include <QDialogButtonBox>
#include <QFile>
#include <QFormLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <system_error>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/field_sentences.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {

SendDialog::SendDialog(std::filesystem::path what, const QString& title, Stays stays,
                       std::function<void(bool sent)> ended, QWidget* parent)
    : QDialog(parent), what_(std::move(what)), drops_(stays == Stays::if_sent), ended_(std::move(ended)) {
  setObjectName("send_dialog");
  setWindowTitle(tr("Send %1 to a server").arg(title));
  auto* all = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  all->addLayout(form);
  fields_.emplace(*form);
  fields_->add_address();
  room_ = new QLineEdit;  // another case gets another room, so nobody remembers it
  room_->setObjectName("new_room");
  form->addRow(tr("Room to open with it (empty: none)"), room_);
  fields_->add_credentials();
  words_ = new QLabel;
  words_->setObjectName("send_words");
  words_->setWordWrap(true);
  words_->setTextFormat(Qt::PlainText);  // what a server says is no HTML
  all->addWidget(words_);
  progress_ = new QProgressBar;
  progress_->setObjectName("send_progress");
  progress_->setAccessibleName(tr("Progress"));
  all->addWidget(progress_);
  auto* buttons = new QDialogButtonBox;
  send_ = buttons->addButton(tr("&Send"), QDialogButtonBox::ActionRole);
  send_->setObjectName("send_case");
  send_->setToolTip(tr("Sends the case. The one on this computer stays as it is."));
  close_ = buttons->addButton(QDialogButtonBox::Close);
  close_->setObjectName("send_close");
  close_->setAutoDefault(false);  // a second Enter cancels nothing
  connect(send_, &QPushButton::clicked, this, [this] { send(); });
  connect(close_, &QPushButton::clicked, this, [this] { reject(); });
  all->addWidget(buttons);
  send_->setDefault(true);  // of the dialog, so not before it is in there
  QString first = tr("The server checks the case and keeps it. Whoever may open rooms there can send it.");
  if (drops_) {
    first += ' ' + stays_if_sent();
    // If this program is killed, the next one finds it.
    QFile mark(text_of(unsent_mark(what_)));
    mark.open(QIODevice::WriteOnly);
  }
  end(first);
}

QString SendDialog::stays_if_sent() { return tr("On this computer the case stays only if it is sent."); }

SendDialog::~SendDialog() {
  if (sending_) {
    sending_->stop();  // it reads the case
    if (sending_->server_may_have_it()) keep_it();
  }
  drop_unsent();
}

bool SendDialog::holds(const std::filesystem::path& what) const {
  std::error_code ignored;
  return std::filesystem::equivalent(what, what_, ignored);
}

void SendDialog::keep(const std::filesystem::path& bone) {
  if (!drops_ || !holds(bone)) return;
  keep_it();
  words_->setText(words_->text().remove(stays_if_sent()).trimmed());
}

void SendDialog::drop_unsent() {
  if (!drops_) return;
  keep_it();  // once: another case may get its name
  remove_unused_case(what_);
}

void SendDialog::keep_it() {
  drops_ = false;
  QFile::remove(text_of(unsent_mark(what_)));
}

void SendDialog::reject() {
  if (!sending_) {
    drop_unsent();
    return QDialog::reject();
  }
  words_->setText(tr("Cancelling…"));
  sending_->cancel();
}

void SendDialog::send() {
  if (sending_) return;
  fields_->remember();
  const auto credentials = fields_->credentials();
  if (!credentials) return end(sentence_of(credentials.error()));
  sending_ = std::make_unique<CaseSending>(
      what_, RoomAddress{fields_->address(), room_->text().trimmed(), {}, *credentials},
      CaseSending::Events{[this](CaseSending::Stage stage) { show_stage(stage); },
                          [this](int percent) {
                            progress_->setRange(0, 100);
                            progress_->setValue(percent);
                          },
                          [this](const QString& sentence, const QString& room) {
                            if (!room.isEmpty()) remember_field("room", room);  // where "Join a room" goes next
                            room_->clear();
                            end(sentence);
                            ended_(true);
                          },
                          [this](const QString& sentence) {
                            end(!sentence.isEmpty() ? sentence
                                : drops_ ? tr("Cancelled. The server stored nothing. Send the case again, or close.")
                                         : tr("Cancelled. The server stored nothing, and the case here stays."));
                            send_->setFocus();  // Enter sends it again
                            ended_(false);
                          }});
  progress_->show();
  enable_parts();
  sending_->start();
}

void SendDialog::show_stage(CaseSending::Stage stage) {
  progress_->setRange(0, 0);
  switch (stage) {
    case CaseSending::Stage::packing:
      return words_->setText(tr("The case is being packed"));
    case CaseSending::Stage::connecting:
      return words_->setText(tr("Connecting to %1").arg(fields_->address()));
    case CaseSending::Stage::sending:
      return words_->setText(tr("The case is being sent"));
    case CaseSending::Stage::checking:
      return words_->setText(tr("The server checks the case"));
    case CaseSending::Stage::opening:
      return words_->setText(tr("The server opens the room"));
  }
}

void SendDialog::end(const QString& sentence) {
  if (sending_) {
    if (sending_->server_may_have_it()) keep_it();
    sending_.release()->deleteLater();  // it is still in its event
  }
  words_->setText(sentence);
  progress_->hide();
  enable_parts();
}

void SendDialog::enable_parts() {
  const QString reason = tr("The case is being sent. Wait for it, or cancel it.");
  fields_->set_enabled(!sending_, reason);
  set_enabled(*room_, !sending_, reason);
  set_enabled(*send_, !sending_, reason);
  close_->setText(sending_ ? tr("Cancel") : tr("&Close"));
}

}  // namespace osteon
