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
  enum class Stays { always, if_sent };  // the case, on this computer
  // `what`: the folder of a case, or a file with one. `title`: for people. A case that stays if it is sent goes with
  // the dialog, or when that is closed, together with its edit list and its report. It stays if a server may have it.
  // `ended`: after each sending; `sent`: it went well.
  SendDialog(std::filesystem::path what, const QString& title, Stays stays, std::function<void(bool sent)> ended,
             QWidget* parent);
  ~SendDialog() override;

  [[nodiscard]] bool sending() const { return sending_ != nullptr; }
  [[nodiscard]] bool holds(const std::filesystem::path& what) const;
  // Somebody opens a case. If it is the one of this dialog, it stays.
  void keep(const std::filesystem::path& bone);
  // Cancels what is sent. Closes the dialog if nothing is.
  void reject() override;

 private:
  void send();
  void show_stage(CaseSending::Stage stage);
  void end(const QString& sentence);
  [[nodiscard]] static QString stays_if_sent();
  // A case that stays if it is sent, and was not.
  void drop_unsent();
  // The case stays in any case.
  void keep_it();
  void enable_parts();

  const std::filesystem::path what_;
  bool drops_;  // the case is still one that stays only if it is sent
  std::function<void(bool sent)> ended_;
  std::optional<ServerFields> fields_;
  QLineEdit* room_ = nullptr;
  QLabel* words_;
  QProgressBar* progress_;
  QPushButton *send_, *close_;
  std::unique_ptr<CaseSending> sending_;
};

}  // namespace osteon
