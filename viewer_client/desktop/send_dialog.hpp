// The dialog that sends a case to a server. It stays open: after a refusal a person corrects the address and sends
// again.
#pragma once
#include <QCoreApplication>
#include <QDialog>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "viewer_client/desktop/case_sending.hpp"
#include "viewer_client/desktop/server_fields.hpp"

class QLabel;
class QProgressBar;
class QPushButton;

namespace osteon {

// [GUI thread]
class SendDialog : public QDialog {
  Q_DECLARE_TR_FUNCTIONS(SendDialog)

 public:
  // `what`: the folder of a case, or a file with one. `title`: for people.
  // `ended`: after each sending; `sent`: it went well.
  SendDialog(std::filesystem::path what, const QString& title, std::function<void(bool sent)> ended, QWidget* parent);
  ~SendDialog() override;

  [[nodiscard]] bool sending() const { return sending_ != nullptr; }
  // Cancels what is sent. Closes the dialog if nothing is.
  void reject() override;

 private:
  void send();
  void show_stage(CaseSending::Stage stage);
  void end(const QString& sentence);
  void enable_parts();

  std::filesystem::path what_;
  std::function<void(bool sent)> ended_;
  std::optional<ServerFields> fields_;
  QLineEdit* room_ = nullptr;
  QLabel* words_;
  QProgressBar* progress_;
  QPushButton *send_, *close_;
  std::unique_ptr<CaseSending> sending_;
};

}  // namespace osteon
