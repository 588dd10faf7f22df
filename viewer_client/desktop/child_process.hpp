// A program that the window starts. If the window dies, the kernel ends it.
#pragma once
#include <QProcess>
#include <QString>
#include <QStringList>
#include <filesystem>

namespace osteon {

class ChildProcess : public QProcess {
 public:
  // Its messages go to `log_file`.
  explicit ChildProcess(const QString& log_file);
  // Asks it to end, waits, and ends it by force if it does not obey.
  ~ChildProcess() override;

  // The last line of the log file: the sentence with which an Osteon program ends. Empty: there is none.
  [[nodiscard]] QString last_sentence() const;

 protected:
  void setupChildProcess() override;

 private:
  QString log_file_;
};

// An Osteon program beside this one. Its bare name, if it is not there: then PATH decides.
[[nodiscard]] QString program_path(const QString& name);
[[nodiscard]] QString text_of(const std::filesystem::path& path);

}  // namespace osteon
