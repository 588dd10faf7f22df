// Shows the progress of long work: a bar on a terminal, otherwise a line for every tenth. Written to standard error.
#pragma once
#include <string>

namespace osteon {

class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();  // ends the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double fraction);  // 0 to 1

 private:
  std::string what_;
  bool terminal_;
  int shown_ = -1;  // percent on a terminal, otherwise tenths
};

}  // namespace osteon
