#include "viewer_client/desktop/server_fields.hpp"

#include <QFormLayout>
#include <QSettings>

#include "viewer_client/desktop/enabled.hpp"

namespace osteon {

namespace {
constexpr int kFieldLetters = 40;  // most paths of files are seen as a whole
QString setting_of(const QString& key) { return "join/" + key; }
}  // namespace

QLineEdit* ServerFields::add(const QString& words, const char* key) {
  auto* edit = new QLineEdit(QSettings().value(setting_of(key)).toString());
  edit->setObjectName(key);
  edit->setMinimumWidth(kFieldLetters * edit->fontMetrics().averageCharWidth());
  form_.addRow(words, edit);
  fields_.push_back(edit);
  return edit;
}

void ServerFields::add_address() { address_ = add(tr("Server, HOST:PORT"), "address"); }

void ServerFields::add_credentials() {
  certificates_ = add(tr("Folder of your certificate"), "certificates");
  ticket_ = add(tr("File of your ticket"), "ticket");
}

void ServerFields::remember() const {
  for (const QLineEdit* edit : fields_) QSettings().setValue(setting_of(edit->objectName()), edit->text());
}

void ServerFields::set_enabled(bool on, const QString& reason) const {
  for (QLineEdit* edit : fields_) osteon::set_enabled(*edit, on, reason);
}

Result<wire::ClientCredentials> ServerFields::credentials() const {
  wire::CredentialArguments arguments;
  arguments.certificates = certificates_->text().toStdString();
  arguments.ticket = ticket_->text().toStdString();
  arguments.plain = certificates_->text().isEmpty() && ticket_->text().isEmpty();
  return wire::client_credentials(arguments);
}

void remember_field(const char* key, const QString& text) { QSettings().setValue(setting_of(key), text); }

}  // namespace osteon
