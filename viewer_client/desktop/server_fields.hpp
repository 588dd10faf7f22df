// The fields of a dialog that say how to reach a server. All dialogs share what was typed last.
#pragma once
#include <QCoreApplication>
#include <QLineEdit>
#include <QString>
#include <vector>

#include "common/wire/credentials.hpp"

class QFormLayout;

namespace osteon {

// A room on a server that others run.
struct RoomAddress {
  QString address, room, name;
  wire::ClientCredentials credentials;
};

// [GUI thread] The form owns the fields and outlives this.
class ServerFields {
  Q_DECLARE_TR_FUNCTIONS(ServerFields)

 public:
  explicit ServerFields(QFormLayout& form) : form_(form) {}

  void add_address();
  // Certificate and ticket.
  void add_credentials();
  // Another one. Its text stays under `key`.
  QLineEdit* add(const QString& words, const char* key);

  // Keeps what was typed.
  void remember() const;
  void set_enabled(bool on, const QString& reason) const;
  [[nodiscard]] QString address() const { return address_->text().trimmed(); }
  // Without certificate and ticket: plain text. Errors: those of wire::client_credentials().
  [[nodiscard]] Result<wire::ClientCredentials> credentials() const;

 private:
  QFormLayout& form_;
  std::vector<QLineEdit*> fields_;
  QLineEdit *address_ = nullptr, *certificates_ = nullptr, *ticket_ = nullptr;
};

// Keeps the text of another field, as if it had been typed.
void remember_field(const char* key, const QString& text);

}  // namespace osteon
