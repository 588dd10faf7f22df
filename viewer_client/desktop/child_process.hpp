// A program that the window starts. If the window dies, the kernel ends it.
#pragma once
#include <QProcess>
#include <QString>
#include <QStringList>
#include <chrono>
#include <filesystem>

namespace osteon {

class ChildProcess : public QProcess {
 public:
  // Its messages go to `log_file`.
  explicit ChildProcess(const QString& log_file);
  // As end(), with a patience of its own.
  ~ChildProcess() override;

  // Asks it to end and returns at once. From now on its signals reach nobody.
  void ask_to_end();
  // Asks it to end, waits so long, and then ends it by force.
  void end(std::chrono::milliseconds patience);

  // The last line of the log file: the sentence with which an Osteon program ends. Without it, that of a full disk, on
  // which the program could not write it. Empty: there is neither.
  [[nodiscard]] QString last_sentence() const;

 protected:
  void setupChildProcess() override;

 private:
  [[nodiscard]] QString last_line() const;

  QString log_file_;
  bool asked_ = false;  // to end; a second signal would end it in a hurry
};

// For a person, if the disk of the folder has less than 1 MiB left. Else empty.
[[nodiscard]] QString sentence_of_disk(const QString& folder, qint64 available_bytes);
// An Osteon program beside this one. Its bare name, if it is not there: then PATH decides.
[[nodiscard]] QString program_path(const QString& name);
[[nodiscard]] QString text_of(const std::filesystem::path& path);

}  // namespace osteon
